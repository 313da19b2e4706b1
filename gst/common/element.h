/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Helpers for elements of all kinds. */
#pragma once

#include <initializer_list>
#include <new>
#include <string>

#include <gst/base/gstbasetransform.h>
#include <gst/gst.h>

#include "caps.h"
#include "properties.h"
#include "raii.h"

namespace codedexposure::gst
{

/** Options of a pad template. */
struct PadOptions {
  GstPadPresence presence = GST_PAD_ALWAYS;
  GType type = G_TYPE_NONE; ///< none: GstPad
  const char *caps = CODED_EXPOSURE_VIDEO_CAPS;
  /** Unknown: a sink pad if its name is "sink", else a source pad. */
  GstPadDirection direction = GST_PAD_UNKNOWN;
};
/** Adds a pad template to @p klass. */
void add_pad_template (
    gpointer klass, const char *name, const PadOptions &options = {});

/** Sets the description in gst-inspect-1.0 and adds the templates of @p pads,
 * which are always there and carry grey video. */
void describe_element (gpointer klass, const char *name, const char *kind,
    const char *description,
    std::initializer_list<const char *> pads = {"sink", "src"});

/**
 * An instance of a type: that of its parent, and behind it a state that lives
 * as long as the instance.
 *
 * struct GstDmdSync : Instance<GstBaseTransform, SyncState> {};
 */
template <typename Parent, typename State>
struct Instance {
  Parent parent;
  State state;
};

template <typename Self>
Self *
as (gpointer object)
{
  return static_cast<Self *> (object);
}
template <typename Self>
auto &
state_in (gpointer object)
{
  return as<Self> (object)->state;
}
/** The class from which that of @p object is derived. */
template <typename Class>
Class *
parent_class (gpointer object)
{
  return static_cast<Class *> (
      g_type_class_peek_parent (G_OBJECT_GET_CLASS (object)));
}

/**
 * Registers the type @p name of a Self, whose state is made of its element if
 * it has such a constructor.
 *
 * @p SetUp          (klass) sets up the class.
 * @p SetUpInstance  (self) completes an instance.
 */
template <typename Self, auto SetUp, auto SetUpInstance = [] (Self *) {}>
GType
type_of (const char *name, GType parent, GTypeFlags flags = GTypeFlags (0))
{
  using State = decltype (Self::state);
  static const GType type = [=] {
    GTypeQuery base;
    g_type_query (parent, &base);
    const GClassInitFunc set_up = [] (gpointer klass, gpointer) noexcept {
      static const auto finalize = G_OBJECT_CLASS (klass)->finalize;
      G_OBJECT_CLASS (klass)->finalize = [] (GObject *object) noexcept {
        state_in<Self> (object).~State ();
        finalize (object);
      };
      SetUp (klass);
    };
    const GInstanceInitFunc create = [] (GTypeInstance *made,
                                         gpointer) noexcept {
      auto *self = reinterpret_cast<Self *> (made);
      if constexpr (requires { State{as<GstElement> (made)}; })
        new (&self->state) State{as<GstElement> (made)};
      else
        new (&self->state) State ();
      SetUpInstance (self);
    };
    return g_type_register_static_simple (
        parent, name, base.class_size, set_up, sizeof (Self), create, flags);
  }();
  return type;
}

/** A copy of the settings of @p self, by the object lock. */
template <typename Self>
auto
settings_of (Self *self)
{
  return locked (self, [self] { return self->state.settings; });
}

/** Installs the properties of @p Table (), whose values are in the state of a
 * Self. */
template <typename Self, auto Table,
    auto Changed = [] (GObject *, const GParamSpec *) {}>
void
install_state (gpointer klass)
{
  install_properties<Table, state_in<Self>, Changed> (G_OBJECT_CLASS (klass));
}

/** Changed of install_state () where a schedule without a text is the default
 * one. */
template <typename Self>
void
want_schedule (GObject *object, const GParamSpec *)
{
  auto &settings = state_in<Self> (object).settings;
  if (settings.schedule.text.empty ())
    settings.schedule = decltype (Self::state.settings) ().schedule;
}

/** What an element does when its state changes; null: nothing. */
struct StateHooks {
  using Try = bool (*) (
      GstElement *); ///< false, with an error posted: it fails
  using Do = void (*) (GstElement *);

  Try open = nullptr;  ///< NULL to READY
  Try begin = nullptr; ///< READY to PAUSED, before frames and events can come
  Do pause = nullptr;  ///< PLAYING to PAUSED
  /** PAUSED to READY, while the streaming thread may wait for something. */
  Do halt = nullptr;
  /** After that, when nothing can come any more. GstBaseTransform's start ()
   * and stop () run beside the streaming thread. */
  Do end = nullptr;
  Do close = nullptr; ///< after READY to NULL

  using Change = decltype (GstElementClass::change_state);
  GstStateChangeReturn change (
      Change parent, GstElement *element, GstStateChange transition) const;
};
/** @p Hooks: a constant. */
template <const StateHooks &Hooks>
void
install_run (gpointer klass)
{
  static const auto parent = GST_ELEMENT_CLASS (klass)->change_state;
  GST_ELEMENT_CLASS (klass)->change_state =
      [] (GstElement *element, GstStateChange transition) noexcept {
        return Hooks.change (parent, element, transition);
      };
}

/** Adds the pad @p name of the template of this name to @p element. */
GstPad *add_pad (GstElement *element, const char *name);
/** The same as a ghost of the pad @p name of @p inner, or without a target if
 * that is null. */
GstPad *add_ghost_pad (GstElement *bin, const char *name, GstElement *inner);

/** The class of GstBaseTransform, to call its default implementations. */
GstBaseTransformClass *base_transform_class ();

/** Completes an instance of GstBaseTransform whose pixels pass unchanged, and
 * which drops nothing because it is late: a SetUpInstance of type_of (). */
void set_up_passing (gpointer transform);

/** Posts that @p buffer cannot be mapped as a frame of @p info. */
GstFlowReturn refuse_buffer (
    gpointer element, const GstVideoInfo &info, GstBuffer *buffer);
/** False, with an error, if the times of frames in @p segment are not known. */
bool counts_time (gpointer element, const GstSegment &segment);
/** Posts an error of the settings. Returns false. */
bool refuse_settings (gpointer element, const std::string &why);
/** Sets @p own, the element's part of the latency, to what @p compute returns,
 * under the object lock, and posts it if it changes. */
template <typename Compute>
void
set_latency (gpointer element, GstClockTime &own, Compute compute)
{
  if (locked (element, [&] {
        const GstClockTime latency = compute ();
        return std::exchange (own, latency) != latency;
      }))
    gst_element_post_message (
        GST_ELEMENT (element), gst_message_new_latency (GST_OBJECT (element)));
}
void post_progress (gpointer element, GstProgressType type, const char *code,
    const std::string &text);

/** The running time of @p time; none in a segment that does not count time. */
GstClockTime running_time (const GstSegment &segment, GstClockTime time);

/** Adds @p own to the latency in @p query, which upstream has answered. The
 * maximum moves with the minimum, because both count from the PTS. */
void add_latency (GstQuery *query, GstClockTime own);

/** Answers the CAPS query @p query by @p own, as far as it asks for. */
void answer_caps (GstQuery *query, CapsPtr own);

/** A GAP event from @p pts for @p duration, otherwise as @p gap. */
EventPtr gap_like (GstEvent *gap, GstClockTime pts, GstClockTime duration);

/** Posts that @p location is finished, so that what comes after the end of the
 * stream is refused. */
GstFlowReturn refuse_after_end (GstElement *sink, const std::string &location);

/** Posts why the file of @p sink could not be written, and keeps it in @p
 * problem for a property. Takes the object lock. */
void post_write_error (
    GstElement *sink, std::string &problem, const std::string &why);

} // namespace codedexposure::gst

/** GST_ELEMENT_ERROR, _WARNING and _INFO with a std::string or a literal as
 * their text. Of an INFO, gst-launch-1.0 shows the debug text only. */
#define POST_ERROR(element, domain, code, text)                                \
  GST_ELEMENT_ERROR (                                                          \
      element, domain, code, ("%s", std::string (text).c_str ()), (nullptr))
#define POST_WARNING(element, domain, code, text)                              \
  GST_ELEMENT_WARNING (                                                        \
      element, domain, code, ("%s", std::string (text).c_str ()), (nullptr))
#define POST_INFO(element, domain, code, text)                                 \
  GST_ELEMENT_INFO (element, domain, code,                                     \
      ("%s", std::string (text).c_str ()),                                     \
      ("%s", std::string (text).c_str ()))
