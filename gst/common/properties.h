/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The properties of an element as a table, and the states in which they may be
 * set. */
#pragma once

#include <functional>
#include <type_traits>
#include <vector>

#include <gst/gst.h>

#include "wire.h"

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

/** Whether the flags of @p pspec allow setting it in the state of @p element;
 * logs a warning if not. Object lock. */
bool may_set (gpointer element, const GParamSpec *pspec);

/** Access to a member of a member: within (&Settings::noise,
 * &SensorNoise::full_well). */
constexpr auto
within (auto... members)
{
  return [=](auto &state) -> auto &
  {
    return (state.*....*members);
  };
}

/**
 * A property of an element that keeps its values in a @p State.
 *
 * {"bits", "Bits", "Significant bits of a pixel", kReadWrite, &Settings::bits,
 * 0, 16}
 *
 * Access is a member, within (), or a function of a State; one that returns a
 * value, not a reference, makes a property that cannot be set. Limits follow
 * for numbers (min and max, whose type is that of the property) and enums (the
 * GType). The default is the value in State ().
 */
template <typename State>
class Property
{
public:
  template <typename Access, typename... Limits>
  Property (const char *name, const char *nick, const char *blurb,
      GParamFlags flags, Access access, Limits... limits)
  {
    using Kept = std::invoke_result_t<Access, State &>;
    using T = std::remove_cvref_t<Kept>;
    using Value = typename ValueOf<T, Limits...>::Type;
    Value standard{};
    if constexpr (std::is_reference_v<Kept>) {
      State fresh = State ();
      standard = Value (std::invoke (access, fresh));
      read_ = [access] (const GValue *value) -> Assignment {
        return [access, read = T (Wire<Value>::get (value))] (
                   State &state) { std::invoke (access, state) = read; };
      };
    }
    get_ = [access] (const State &state, GValue *value) {
      Wire<Value>::set (value, Value (std::invoke (access, state)));
    };
    spec_ = Wire<Value>::spec (name, nick, blurb, limits..., standard, flags);
  }

  GParamSpec *spec () const { return spec_; }
  void get (const State &state, GValue *value) const { get_ (state, value); }
  /** Assigns the value that was read to a State. */
  using Assignment = std::function<void (State &)>;
  /** Reads @p value, and the file if it names one. */
  Assignment read (const GValue *value) const { return read_ (value); }

private:
  template <typename T, typename...>
  struct ValueOf {
    using Type = T;
  };
  template <typename T, typename Low, typename High>
  struct ValueOf<T, Low, High> {
    using Type = Low;
  };

  GParamSpec *spec_;
  std::function<void (const State &, GValue *)> get_;
  std::function<Assignment (const GValue *)> read_;
};

/** All properties of a class, in the order of their ids, which begin at 1. */
template <typename State>
using PropertyTable = std::vector<Property<State>>;

/** The table that @p Table () makes, once: the class takes its specs. */
template <auto Table>
const auto &
table_of ()
{
  static const auto table = Table ();
  return table;
}

/**
 * Installs the properties of @p Table (), whose values are in @p StateOf
 * (object). They are set and read under the object lock, and set only where
 * may_set () allows it; then @p Changed (object, pspec) is called, under the
 * lock. A file that a value names is read before the lock is taken.
 */
template <auto Table, auto StateOf,
    auto Changed = [] (GObject *, const GParamSpec *) {}>
void
install_properties (GObjectClass *klass)
{
  klass->set_property = [] (GObject *object, guint id, const GValue *value,
                            GParamSpec *pspec) noexcept {
    const auto assign = table_of<Table> ()[id - 1].read (value);
    const ObjectLock lock (object);
    if (!may_set (object, pspec))
      return;
    assign (StateOf (object));
    Changed (object, pspec);
  };
  klass->get_property = [] (GObject *object, guint id, GValue *value,
                            GParamSpec *) noexcept {
    const ObjectLock lock (object);
    table_of<Table> ()[id - 1].get (StateOf (object), value);
  };
  for (guint id = 1; const auto &property : table_of<Table> ())
    g_object_class_install_property (klass, id++, property.spec ());
}

} // namespace codedexposure::gst
