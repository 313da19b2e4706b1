/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Helpers for elements of all kinds. */
#pragma once

#include <initializer_list>
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

/** The state of an element whose struct points to it by a member `state`. */
template <typename Element>
auto &
state_in (gpointer element)
{
  return *static_cast<Element *> (element)->state;
}

/**
 * For the class of a final type whose instances create their `state`: installs
 * the properties of @p Table (), as install_properties (), and deletes the
 * state with the instance.
 */
template <typename Element, auto Table,
    auto Changed = [] (GObject *, const GParamSpec *) {}>
void
install_state (gpointer klass)
{
  auto *object_class = G_OBJECT_CLASS (klass);
  install_properties<Table, state_in<Element>, Changed> (object_class);
  object_class->finalize = [] (GObject *object) noexcept {
    delete &state_in<Element> (object);
    G_OBJECT_CLASS (g_type_class_peek_parent (G_OBJECT_GET_CLASS (object)))
        ->finalize (object);
  };
}

/**
 * For the class of a final type: calls @p Begin from READY to PAUSED, before
 * frames and events can come, and @p End from PAUSED to READY, when none can
 * come any more. GstBaseTransform's start () and stop () run beside the
 * streaming thread. If @p Begin returns false, it has posted an error.
 */
template <auto Begin, auto End>
void
install_run (gpointer klass)
{
  GST_ELEMENT_CLASS (klass)->change_state =
      [] (GstElement *element, GstStateChange transition) noexcept {
        const bool begins = transition == GST_STATE_CHANGE_READY_TO_PAUSED;
        auto changed = GST_STATE_CHANGE_FAILURE;
        if (!begins || Begin (element))
          changed = GST_ELEMENT_CLASS (
              g_type_class_peek_parent (G_OBJECT_GET_CLASS (element)))
                        ->change_state (element, transition);
        if (transition == GST_STATE_CHANGE_PAUSED_TO_READY ||
            (begins && changed == GST_STATE_CHANGE_FAILURE))
          End (element);
        return changed;
      };
}

/** The class of GstBaseTransform, to call its default implementations. */
GstBaseTransformClass *base_transform_class ();

/** Posts that the latency has changed. */
void post_latency (gpointer element);
void post_progress (gpointer element, GstProgressType type, const char *code,
    const std::string &text);

/** The running time of @p time; none in a segment that does not count time. */
GstClockTime running_time (const GstSegment &segment, GstClockTime time);

/** Adds @p own to the latency in @p query, which upstream has answered. The
 * maximum moves with the minimum, because both count from the PTS. */
void add_latency (GstQuery *query, GstClockTime own);

/** A GAP event from @p pts for @p duration, otherwise as @p gap. */
EventPtr gap_like (GstEvent *gap, GstClockTime pts, GstClockTime duration);

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
