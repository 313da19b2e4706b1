/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Flags of properties, and when they may be set. */
#pragma once

#include <gst/gst.h>

namespace codedexposure::gst
{

inline constexpr auto kReadWrite = GParamFlags (
    G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_PLAYING);
inline constexpr auto kReadOnly =
    GParamFlags (G_PARAM_READABLE | G_PARAM_STATIC_STRINGS);

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

} // namespace codedexposure::gst
