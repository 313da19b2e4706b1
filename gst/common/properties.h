/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The properties of an element as a table, their flags, and when they may be
 * set. */
#pragma once

#include <functional>
#include <initializer_list>
#include <vector>

#include <gst/gst.h>

#include "structure.h"

namespace codedexposure::gst
{

inline constexpr auto kReadOnly =
    GParamFlags (G_PARAM_READABLE | G_PARAM_STATIC_STRINGS);
/** Set in the state NULL only. */
inline constexpr auto kReadWriteNull =
    GParamFlags (G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS);
/** Set up to the state READY. */
inline constexpr auto kReadWriteReady =
    GParamFlags (kReadWriteNull | GST_PARAM_MUTABLE_READY);
/** Set in all states. */
inline constexpr auto kReadWrite =
    GParamFlags (kReadWriteNull | GST_PARAM_MUTABLE_PLAYING);

/** Whether @p pspec, by its flags, may be set in the state that @p element is
 * in; a warning in the log where not. Object lock. */
inline bool
may_set (gpointer element, const GParamSpec *pspec)
{
  GstState highest = GST_STATE_NULL;
  if (pspec->flags & GST_PARAM_MUTABLE_PLAYING)
    highest = GST_STATE_PLAYING;
  else if (pspec->flags & GST_PARAM_MUTABLE_PAUSED)
    highest = GST_STATE_PAUSED;
  else if (pspec->flags & GST_PARAM_MUTABLE_READY)
    highest = GST_STATE_READY;
  if (GST_STATE (element) <= highest)
    return true;
  GST_WARNING_OBJECT (element,
      "%s cannot change above the %s state; it stays as it is", pspec->name,
      gst_element_state_get_name (highest));
  return false;
}

/** A property of an element whose values are in an @p Owner. */
template <typename Owner>
struct Property {
  GParamSpec *spec;
  std::function<void (Owner &, const GValue *)> set; ///< none: read-only
  std::function<void (const Owner &, GValue *)> get;
};

/** owner.*first.*second... */
template <typename Owner, typename... Path>
auto &
follow (Owner &owner, Path... path)
{
  return (owner.*....*path);
}

/** A property that is kept at the end of a path of members that begins in an
 * @p Owner. */
template <typename Owner, typename First, typename... Path>
Property<Owner>
setting (GParamSpec *spec, First Owner::*first, Path... path)
{
  using T = std::remove_reference_t<decltype (follow (
      std::declval<Owner &> (), first, path...))>;
  return {spec,
      [=] (Owner &owner, const GValue *value) {
        follow (owner, first, path...) = Wire<T>::get (value);
      },
      [=] (const Owner &owner, GValue *value) {
        Wire<T>::set (value, follow (owner, first, path...));
      }};
}

/** A read-only property; @p read is a member of @p Owner, or a function that
 * takes one. */
template <typename Owner, typename Read>
Property<Owner>
reading (GParamSpec *spec, Read read)
{
  using T = std::remove_cvref_t<std::invoke_result_t<Read, const Owner &>>;
  return {spec, {}, [read] (const Owner &owner, GValue *value) {
            Wire<T>::set (value, std::invoke (read, owner));
          }};
}

/** All properties of a class, in the order of their ids, which begin at 1. */
template <typename Owner>
class PropertyTable
{
public:
  PropertyTable (std::initializer_list<Property<Owner>> properties)
      : properties_ (properties)
  {
  }

  /** Once: the class takes the specs. */
  void install (GObjectClass *klass) const
  {
    guint id = 1;
    for (const Property<Owner> &property : properties_)
      g_object_class_install_property (klass, id++, property.spec);
  }
  void set (Owner &owner, guint id, const GValue *value) const
  {
    properties_[id - 1].set (owner, value);
  }
  void get (const Owner &owner, guint id, GValue *value) const
  {
    properties_[id - 1].get (owner, value);
  }

private:
  std::vector<Property<Owner>> properties_;
};

/**
 * Installs the properties of @p Table (), whose values are in
 * @p OwnerOf (object). They are set and read under the object lock, and set
 * only where may_set () allows it; an element that does more replaces
 * klass->set_property.
 */
template <auto Table, auto OwnerOf>
void
install_properties (GObjectClass *klass)
{
  klass->set_property = [] (GObject *object, guint id, const GValue *value,
                            GParamSpec *pspec) {
    const ObjectLock lock (object);
    if (may_set (object, pspec))
      Table ().set (OwnerOf (object), id, value);
  };
  klass->get_property = [] (GObject *object, guint id, GValue *value,
                            GParamSpec *) {
    const ObjectLock lock (object);
    Table ().get (OwnerOf (object), id, value);
  };
  Table ().install (klass);
}

} // namespace codedexposure::gst
