/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Converts C++ structs to GstStructures and back. Messages, events, queries,
 * metas and statistics are built and parsed with it. */
#pragma once

#include <optional>
#include <tuple>
#include <vector>

#include <gst/gst.h>

#include "wire.h"

namespace codedexposure::gst
{

/**
 * Declares which members of a struct become fields, in their order. The name of
 * a field is that of its member with hyphens for underscores:
 *
 * struct FrameLate { static constexpr const char *kName = "dmdsync/frame-late";
 * guint64 lost_before = 0; // "lost-before" GstClockTime pts = 0; CODED_FIELDS
 * (lost_before, pts); };
 *
 * A member of a member has its own name only: `stats.mean` is "mean". Types are
 * those of Wire, std::optional of them for a field that may be absent, and
 * structs with fields, which become fields of the whole.
 */
#define CODED_FIELDS(...)                                                      \
  static constexpr const char *kFields = #__VA_ARGS__;                         \
  auto members ()                                                              \
  {                                                                            \
    return std::tie (__VA_ARGS__);                                             \
  }                                                                            \
  auto members () const                                                        \
  {                                                                            \
    return std::tie (__VA_ARGS__);                                             \
  }

/** The names of fields, from the text of their members. */
std::vector<GQuark> field_names (const char *members);

template <typename T>
concept HasFields = requires
{
  T::kFields;
};

/** Calls @p visit with the name and the member of each field of @p value. */
template <typename Struct, typename Visit>
void
each_field (Struct &value, Visit visit)
{
  static const auto names = field_names (Struct::kFields);
  std::apply ([&, name = names.begin ()] (
                  auto &...member) mutable { (visit (*name++, member), ...); },
      value.members ());
}

template <typename T>
void
set_field (GstStructure *structure, GQuark name, const T &member)
{
  GValue value = G_VALUE_INIT;
  g_value_init (&value, Wire<T>::type ());
  Wire<T>::set (&value, member);
  gst_structure_id_take_value (structure, name, &value);
}
template <typename T>
void
set_field (GstStructure *structure, GQuark name, const std::optional<T> &member)
{
  if (member)
    set_field (structure, name, *member);
}

/** A count of another integer type, as other programs may write it; false if it
 * is none. */
bool get_count (const GValue *value, guint64 &count);

/** False, with @p member unchanged, if there is no such field of that type. */
template <typename T>
bool
get_field (const GstStructure *structure, GQuark name, T &member)
{
  const GValue *value = gst_structure_id_get_value (structure, name);
  if constexpr (std::is_same_v<T, guint64>)
    if (value && !G_VALUE_HOLDS_UINT64 (value))
      return get_count (value, member);
  const bool fits = value && G_VALUE_HOLDS (value, Wire<T>::type ());
  if (fits)
    member = Wire<T>::get (value);
  return fits;
}
template <typename T>
bool
get_field (const GstStructure *structure, GQuark name, std::optional<T> &member)
{
  T read{};
  member.reset ();
  if (get_field (structure, name, read))
    member = std::move (read);
  return true;
}

/** Sets the fields of @p value in @p structure. */
template <typename T>
void
write_fields (GstStructure *structure, const T &value)
{
  each_field (value, [=]<typename M> (GQuark name, const M &member) {
    if constexpr (HasFields<M>)
      write_fields (structure, member);
    else
      set_field (structure, name, member);
  });
}

/** False if @p structure lacks a field that is not optional; its member keeps
 * its value. */
template <typename T>
bool
read_fields (const GstStructure *structure, T &value)
{
  bool complete = true;
  each_field (value, [&]<typename M> (GQuark name, M &member) {
    if constexpr (HasFields<M>)
      complete &= read_fields (structure, member);
    else
      complete &= get_field (structure, name, member);
  });
  return complete;
}

/** Transfer: full. */
template <typename T>
GstStructure *
to_structure (const T &value)
{
  GstStructure *structure = gst_structure_new_empty (T::kName);
  write_fields (structure, value);
  return structure;
}

/** None if @p structure is null, has another name or lacks a field that is not
 * optional. */
template <typename T>
std::optional<T>
from_structure (const GstStructure *structure)
{
  if (!structure || !gst_structure_has_name (structure, T::kName))
    return std::nullopt;
  T value;
  return read_fields (structure, value) ? std::optional (std::move (value))
                                        : std::nullopt;
}

template <typename T>
void
post_message (gpointer element, const T &value)
{
  gst_element_post_message (GST_ELEMENT (element),
      gst_message_new_element (GST_OBJECT (element), to_structure (value)));
}

/** None for another message. */
template <typename T>
std::optional<T>
parse_message (GstMessage *message)
{
  return GST_MESSAGE_TYPE (message) == GST_MESSAGE_ELEMENT
             ? from_structure<T> (gst_message_get_structure (message))
             : std::nullopt;
}

/** A custom event of type T::kType; Transfer: full. */
template <typename T>
GstEvent *
new_event (const T &value)
{
  return gst_event_new_custom (T::kType, to_structure (value));
}

/** None for another event. */
template <typename T>
std::optional<T>
parse_event (GstEvent *event)
{
  return GST_EVENT_TYPE (event) == T::kType
             ? from_structure<T> (gst_event_get_structure (event))
             : std::nullopt;
}

/** A custom query for a T; Transfer: full. */
template <typename T>
GstQuery *
new_query ()
{
  return gst_query_new_custom (
      GST_QUERY_CUSTOM, gst_structure_new_empty (T::kName));
}

/** Whether @p query asks for a T. */
template <typename T>
bool
is_query (GstQuery *query)
{
  return GST_QUERY_TYPE (query) == GST_QUERY_CUSTOM &&
         gst_structure_has_name (gst_query_get_structure (query), T::kName);
}

/** Answers @p query, which is one for a T. */
template <typename T>
void
answer_query (GstQuery *query, const T &value)
{
  write_fields (gst_query_writable_structure (query), value);
}

/** The answer to a query for a T; none if it was not answered. */
template <typename T>
std::optional<T>
parse_query (GstQuery *query)
{
  return is_query<T> (query)
             ? from_structure<T> (gst_query_get_structure (query))
             : std::nullopt;
}

} // namespace codedexposure::gst
