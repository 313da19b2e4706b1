/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What elements of several kinds do in the same way. */
#pragma once

#include <string>

#include <gst/base/gstbasetransform.h>
#include <gst/gst.h>

namespace codedexposure::gst
{

/** What gst-inspect-1.0 tells of an element, and its pads, which are always
 * there and take coded frames: "sink", if @p has_sink, and "src". */
void describe_element (GstElementClass *klass, const char *name,
    const char *kind, const char *description, bool has_sink = true);

/** What GstBaseTransform does by itself. */
GstBaseTransformClass *base_transform_class ();

/** Posts an element message; @p structure: Transfer: full. */
void post_structure (gpointer element, GstStructure *structure);
/** Posts that the latency has changed. */
void post_latency (gpointer element);
void post_progress (gpointer element, GstProgressType type, const char *code,
    const std::string &text);

/** Adds @p own to the latency in @p query, which upstream has answered. What
 * upstream can wait is counted from the PTS as well, so the maximum moves with
 * the minimum. */
void add_latency (GstQuery *query, GstClockTime own);

} // namespace codedexposure::gst

/** GST_ELEMENT_ERROR and GST_ELEMENT_WARNING with a std::string or a literal
 * as their only text. */
#define POST_ERROR(element, domain, code, text)                                \
  GST_ELEMENT_ERROR (                                                          \
      element, domain, code, ("%s", std::string (text).c_str ()), (nullptr))
#define POST_WARNING(element, domain, code, text)                              \
  GST_ELEMENT_WARNING (                                                        \
      element, domain, code, ("%s", std::string (text).c_str ()), (nullptr))
