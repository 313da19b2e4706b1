/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "element.h"

#include <cerrno>

namespace codedexposure::gst
{

bool
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
      "%s cannot be set above the %s state; its value stays unchanged",
      pspec->name, gst_element_state_get_name (highest));
  return false;
}

void
add_pad_template (gpointer klass, const char *name, const PadOptions &options)
{
  const CapsPtr caps (gst_caps_from_string (options.caps));
  GstPadDirection direction = options.direction;
  if (direction == GST_PAD_UNKNOWN)
    direction = g_str_equal (name, "sink") ? GST_PAD_SINK : GST_PAD_SRC;
  gst_element_class_add_pad_template (GST_ELEMENT_CLASS (klass),
      options.type == G_TYPE_NONE
          ? gst_pad_template_new (
                name, direction, options.presence, caps.get ())
          : gst_pad_template_new_with_gtype (
                name, direction, options.presence, caps.get (), options.type));
}

void
describe_element (gpointer klass, const char *name, const char *kind,
    const char *description, std::initializer_list<const char *> pads)
{
  gst_element_class_set_static_metadata (GST_ELEMENT_CLASS (klass), name, kind,
      description, "The gst-codedexposure authors");
  for (const char *pad : pads)
    add_pad_template (klass, pad);
}

GstPad *
add_pad (GstElement *element, const char *name)
{
  GstPad *pad = gst_pad_new_from_template (
      gst_element_get_pad_template (element, name), name);
  gst_element_add_pad (element, pad);
  return pad;
}

GstPad *
add_ghost_pad (GstElement *bin, const char *name, GstElement *inner)
{
  GstPad *pad = gst_ghost_pad_new_no_target_from_template (
      name, gst_element_get_pad_template (bin, name));
  if (inner)
    gst_ghost_pad_set_target (GST_GHOST_PAD (pad), pad_of (inner, name).get ());
  gst_element_add_pad (bin, pad);
  return pad;
}

GstStateChangeReturn
StateHooks::change (
    Change parent, GstElement *element, GstStateChange transition) const
{
  const bool begins = transition == GST_STATE_CHANGE_READY_TO_PAUSED;
  const bool ends = transition == GST_STATE_CHANGE_PAUSED_TO_READY;
  const auto run = [element] (bool now, Do hook) {
    if (now && hook)
      hook (element);
  };
  if (transition == GST_STATE_CHANGE_NULL_TO_READY && open && !open (element))
    return GST_STATE_CHANGE_FAILURE;
  run (transition == GST_STATE_CHANGE_PLAYING_TO_PAUSED, pause);
  run (ends, halt);
  const auto changed = begins && begin && !begin (element)
                           ? GST_STATE_CHANGE_FAILURE
                           : parent (element, transition);
  const bool failed = begins && changed == GST_STATE_CHANGE_FAILURE;
  run (failed, halt);
  run (failed || ends, end);
  run (transition == GST_STATE_CHANGE_READY_TO_NULL, close);
  return changed;
}

GstBaseTransformClass *
base_transform_class ()
{
  return GST_BASE_TRANSFORM_CLASS (g_type_class_peek (GST_TYPE_BASE_TRANSFORM));
}

void
set_up_passing (gpointer transform)
{
  gst_base_transform_set_passthrough (GST_BASE_TRANSFORM (transform), TRUE);
  gst_base_transform_set_qos_enabled (GST_BASE_TRANSFORM (transform), FALSE);
}

GstFlowReturn
refuse_buffer (gpointer element, const GstVideoInfo &info, GstBuffer *buffer)
{
  POST_ERROR (element, STREAM, FORMAT, unreadable_text (info, buffer));
  return GST_FLOW_ERROR;
}

bool
counts_time (gpointer element, const GstSegment &segment)
{
  if (segment.format == GST_FORMAT_TIME)
    return true;
  POST_ERROR (element, STREAM, FORMAT,
      std::string ("The segment of the frames counts in ") +
          gst_format_get_name (segment.format) +
          ", but their times are needed. Let the source count in time, as "
          "appsrc does with format=time.");
  return false;
}

bool
refuse_settings (gpointer element, const std::string &why)
{
  POST_ERROR (element, RESOURCE, SETTINGS, why);
  return false;
}

void
post_progress (gpointer element, GstProgressType type, const char *code,
    const std::string &text)
{
  gst_element_post_message (
      GST_ELEMENT (element), gst_message_new_progress (GST_OBJECT (element),
                                 type, code, text.c_str ()));
}

GstClockTime
running_time (const GstSegment &segment, GstClockTime time)
{
  return segment.format == GST_FORMAT_TIME
             ? gst_segment_to_running_time (&segment, GST_FORMAT_TIME, time)
             : GST_CLOCK_TIME_NONE;
}

void
add_latency (GstQuery *query, GstClockTime own)
{
  gboolean live;
  GstClockTime min, max;
  gst_query_parse_latency (query, &live, &min, &max);
  gst_query_set_latency (
      query, live, min + own, GST_CLOCK_TIME_IS_VALID (max) ? max + own : max);
}

void
answer_caps (GstQuery *query, CapsPtr own)
{
  GstCaps *filter = nullptr;
  gst_query_parse_caps (query, &filter);
  if (filter)
    own = intersect_caps (filter, own.get ());
  gst_query_set_caps_result (query, own.get ());
}

EventPtr
gap_like (GstEvent *gap, GstClockTime pts, GstClockTime duration)
{
  GstGapFlags flags;
  gst_event_parse_gap_flags (gap, &flags);
  EventPtr own (gst_event_new_gap (pts, duration));
  gst_event_set_gap_flags (own.get (), flags);
  gst_event_set_seqnum (own.get (), gst_event_get_seqnum (gap));
  return own;
}

GstFlowReturn
refuse_after_end (GstElement *sink, const std::string &location)
{
  POST_ERROR (sink, RESOURCE, WRITE,
      location + " is finished, and what comes after the end of the stream, as "
                 "after a seek, would overwrite it; set the element to NULL "
                 "and choose another location");
  return GST_FLOW_ERROR;
}

void
post_write_error (
    GstElement *sink, std::string &problem, const std::string &why)
{
  locked (sink, [&] { problem = why; });
  if (why.find (g_strerror (ENOSPC)) != std::string::npos)
    POST_ERROR (sink, RESOURCE, NO_SPACE_LEFT, why);
  else
    POST_ERROR (sink, RESOURCE, WRITE, why);
}

} // namespace codedexposure::gst
