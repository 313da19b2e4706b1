/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "element.h"

#include "caps.h"

namespace codedexposure::gst
{

namespace
{

void
add_pad (GstElementClass *klass, const char *name, GstPadDirection direction)
{
  const CapsPtr caps (gst_caps_from_string (CODED_EXPOSURE_VIDEO_CAPS));
  gst_element_class_add_pad_template (klass,
      gst_pad_template_new (name, direction, GST_PAD_ALWAYS, caps.get ()));
}

} // namespace

void
describe_element (GstElementClass *klass, const char *name, const char *kind,
    const char *description, bool has_sink)
{
  gst_element_class_set_static_metadata (
      klass, name, kind, description, "The gst-codedexposure authors");
  if (has_sink)
    add_pad (klass, "sink", GST_PAD_SINK);
  add_pad (klass, "src", GST_PAD_SRC);
}

GstBaseTransformClass *
base_transform_class ()
{
  return GST_BASE_TRANSFORM_CLASS (g_type_class_peek (GST_TYPE_BASE_TRANSFORM));
}

void
post_structure (gpointer element, GstStructure *structure)
{
  gst_element_post_message (GST_ELEMENT (element),
      gst_message_new_element (GST_OBJECT (element), structure));
}

void
post_latency (gpointer element)
{
  gst_element_post_message (
      GST_ELEMENT (element), gst_message_new_latency (GST_OBJECT (element)));
}

void
post_progress (gpointer element, GstProgressType type, const char *code,
    const std::string &text)
{
  gst_element_post_message (
      GST_ELEMENT (element), gst_message_new_progress (GST_OBJECT (element),
                                 type, code, text.c_str ()));
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

} // namespace codedexposure::gst
