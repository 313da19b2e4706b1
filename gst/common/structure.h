/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* C++ structs as GstStructures: the one way in which messages, events, queries
 * and statistics are built and parsed. */
#pragma once

#include <optional>
#include <string>
#include <tuple>

#include <gst/gst.h>

#include "raii.h"
#include "schedule/timing.h"

namespace codedexposure::gst
{

/**
 * One field of a structure: its name on the wire and the member that holds it.
 *
 * A struct that travels has its name and its fields beside its members:
 *
 *     struct FrameLate {
 *       static constexpr const char *kName = "dmdsync/frame-late";
 *       guint64 frame = 0;
 *       GstClockTime pts = 0;
 *       static auto fields ()
 *       {
 *         return std::tuple (field ("frame", &FrameLate::frame),
 *             field ("pts", &FrameLate::pts));
 *       }
 *     };
 *
 * Types of members: guint64, gint, guint, bool, gdouble, std::string and
 * FrameRate, and std::optional of one of them for a field that may be absent.
 */
template <typename Struct, typename Member>
struct Field {
  const char *name;
  Member Struct::*member;
};

template <typename Struct, typename Member>
constexpr Field<Struct, Member>
field (const char *name, Member Struct::*member)
{
  return {name, member};
}

template <GType Type, auto Set, auto Get>
struct PlainWire {
  static GType type () { return Type; }
  static constexpr auto set = Set;
  static constexpr auto get = Get;
};
/** How a @p T travels in a GValue. */
template <typename T>
struct Wire;
template <>
struct Wire<guint64>
    : PlainWire<G_TYPE_UINT64, g_value_set_uint64, g_value_get_uint64> {
};
template <>
struct Wire<gint> : PlainWire<G_TYPE_INT, g_value_set_int, g_value_get_int> {
};
template <>
struct Wire<guint>
    : PlainWire<G_TYPE_UINT, g_value_set_uint, g_value_get_uint> {
};
template <>
struct Wire<gint64>
    : PlainWire<G_TYPE_INT64, g_value_set_int64, g_value_get_int64> {
};
template <>
struct Wire<bool>
    : PlainWire<G_TYPE_BOOLEAN, g_value_set_boolean, g_value_get_boolean> {
};
template <>
struct Wire<gdouble>
    : PlainWire<G_TYPE_DOUBLE, g_value_set_double, g_value_get_double> {
};
template <>
struct Wire<std::string> {
  static GType type () { return G_TYPE_STRING; }
  static void set (GValue *value, const std::string &text)
  {
    g_value_set_string (value, text.c_str ());
  }
  static std::string get (const GValue *value)
  {
    return g_value_get_string (value) ?: "";
  }
};
/** Of a registered type; in properties only. */
template <typename T>
requires std::is_enum_v<T>
struct Wire<T> {
  static void set (GValue *value, T choice)
  {
    g_value_set_enum (value, int (choice));
  }
  static T get (const GValue *value) { return T (g_value_get_enum (value)); }
};
/** What is set is given away; in properties only. */
template <>
struct Wire<GstStructure *> {
  static void set (GValue *value, GstStructure *structure)
  {
    g_value_take_boxed (value, structure);
  }
};
template <>
struct Wire<FrameRate> {
  static GType type () { return GST_TYPE_FRACTION; }
  static void set (GValue *value, FrameRate rate)
  {
    gst_value_set_fraction (value, rate.num, rate.den);
  }
  static FrameRate get (const GValue *value)
  {
    return {gst_value_get_fraction_numerator (value),
        gst_value_get_fraction_denominator (value)};
  }
};

template <typename T>
void
set_value (GValue *value, const T &member)
{
  Wire<T>::set (value, member);
}

/** False, with @p member as it was, where @p value is of another type. */
template <typename T>
bool
get_value (const GValue *value, T &member)
{
  const bool fits = value && G_VALUE_HOLDS (value, Wire<T>::type ());
  if (fits)
    member = Wire<T>::get (value);
  return fits;
}

template <typename T>
void
set_field (GstStructure *structure, const char *name, const T &member)
{
  GValue value = G_VALUE_INIT;
  g_value_init (&value, Wire<T>::type ());
  set_value (&value, member);
  gst_structure_take_value (structure, name, &value);
}
template <typename T>
void
set_field (
    GstStructure *structure, const char *name, const std::optional<T> &member)
{
  if (member)
    set_field (structure, name, *member);
}

/** False, with @p member as it was, where there is no such field of that type.
 */
template <typename T>
bool
get_field (const GstStructure *structure, const char *name, T &member)
{
  return get_value (gst_structure_get_value (structure, name), member);
}
template <typename T>
bool
get_field (
    const GstStructure *structure, const char *name, std::optional<T> &member)
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
  std::apply (
      [&] (const auto &...field) {
        (set_field (structure, field.name, value.*field.member), ...);
      },
      T::fields ());
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

/** None where @p structure, which may be null, has another name or lacks a
 * field that is not optional. */
template <typename T>
std::optional<T>
from_structure (const GstStructure *structure)
{
  if (!structure || !gst_structure_has_name (structure, T::kName))
    return std::nullopt;
  T value;
  const bool complete = std::apply (
      [&] (const auto &...field) {
        return (get_field (structure, field.name, value.*field.member) && ...);
      },
      T::fields ());
  return complete ? std::optional (std::move (value)) : std::nullopt;
}

/** An element message of @p source; Transfer: full. */
template <typename T>
GstMessage *
new_message (gpointer source, const T &value)
{
  return gst_message_new_element (GST_OBJECT (source), to_structure (value));
}

template <typename T>
void
post_message (gpointer element, const T &value)
{
  gst_element_post_message (
      GST_ELEMENT (element), new_message (element, value));
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

/** A custom event, whose type T has as kType; Transfer: full. */
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

/** The answer to a query for a T; none where it was not answered. */
template <typename T>
std::optional<T>
parse_query (GstQuery *query)
{
  return is_query<T> (query)
             ? from_structure<T> (gst_query_get_structure (query))
             : std::nullopt;
}

} // namespace codedexposure::gst
