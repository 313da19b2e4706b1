/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Converts C++ values to GValues and back, for fields of structures and for
 * properties. */
#pragma once

#include <concepts>
#include <string>
#include <vector>

#include <gst/gst.h>

#include "raii.h"
#include "schedule/timing.h"

namespace codedexposure::gst
{

/**
 * Converts a @p T to a GValue and back.
 *
 * type () is the type of the GValue; set () and get () write and read it. spec
 * (name, nick, blurb, limits..., standard, flags) describes a property: limits
 * are min and max of numbers, the GType of enums, nothing for others.
 */
template <typename T>
struct Wire;

template <GType Type, auto Set, auto Get, auto Spec>
struct PlainWire {
  static GType type () { return Type; }
  static constexpr auto set = Set;
  static constexpr auto get = Get;
  static constexpr auto spec = Spec;
};
template <>
struct Wire<gint> : PlainWire<G_TYPE_INT, g_value_set_int, g_value_get_int,
                        g_param_spec_int> {
};
template <>
struct Wire<guint> : PlainWire<G_TYPE_UINT, g_value_set_uint, g_value_get_uint,
                         g_param_spec_uint> {
};
template <>
struct Wire<gint64> : PlainWire<G_TYPE_INT64, g_value_set_int64,
                          g_value_get_int64, g_param_spec_int64> {
};
template <>
struct Wire<guint64> : PlainWire<G_TYPE_UINT64, g_value_set_uint64,
                           g_value_get_uint64, g_param_spec_uint64> {
};
template <>
struct Wire<gdouble> : PlainWire<G_TYPE_DOUBLE, g_value_set_double,
                           g_value_get_double, g_param_spec_double> {
};
template <>
struct Wire<bool> : PlainWire<G_TYPE_BOOLEAN, g_value_set_boolean,
                        g_value_get_boolean, g_param_spec_boolean> {
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
  static GParamSpec *spec (const char *name, const char *nick,
      const char *blurb, const std::string &standard, GParamFlags flags)
  {
    return g_param_spec_string (name, nick, blurb, standard.c_str (), flags);
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
  static GParamSpec *spec (const char *name, const char *nick,
      const char *blurb, FrameRate standard, GParamFlags flags)
  {
    return gst_param_spec_fraction (name, nick, blurb, 0, 1, G_MAXINT, 1,
        standard.num, standard.den, flags);
  }
};

/** A GST_TYPE_ARRAY; written only. */
template <typename T>
struct Wire<std::vector<T>> {
  static GType type () { return GST_TYPE_ARRAY; }
  static void set (GValue *array, const std::vector<T> &numbers)
  {
    for (const T number : numbers) {
      GValue value = G_VALUE_INIT;
      g_value_init (&value, Wire<T>::type ());
      Wire<T>::set (&value, number);
      gst_value_array_append_and_take_value (array, &value);
    }
  }
};

/** Properties only. */
template <typename T>
requires std::is_enum_v<T>
struct Wire<T> {
  static void set (GValue *value, T choice)
  {
    g_value_set_enum (value, int (choice));
  }
  static T get (const GValue *value) { return T (g_value_get_enum (value)); }
  static GParamSpec *spec (const char *name, const char *nick,
      const char *blurb, GType type, T standard, GParamFlags flags)
  {
    gst_type_mark_as_plugin_api (type, GstPluginAPIFlags (0));
    return g_param_spec_enum (name, nick, blurb, type, int (standard), flags);
  }
};

/** Read-only properties only. */
template <>
struct Wire<StructurePtr> {
  static void set (GValue *value, StructurePtr structure)
  {
    g_value_take_boxed (value, structure.release ());
  }
  static GParamSpec *spec (const char *name, const char *nick,
      const char *blurb, const StructurePtr &, GParamFlags flags)
  {
    return g_param_spec_boxed (name, nick, blurb, GST_TYPE_STRUCTURE, flags);
  }
};

} // namespace codedexposure::gst
