/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Converts caps between coded frames and subframes. */
#pragma once

#include <initializer_list>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "raii.h"
#include "schedule/schedule.h"

/** Template of every pad of the plugin: GRAY8 and GRAY16_LE at any size and
 * rate. */
#define CODED_EXPOSURE_VIDEO_CAPS GST_VIDEO_CAPS_MAKE ("{ GRAY8, GRAY16_LE }")

namespace codedexposure::gst
{

/** A factor of num / den. */
struct Ratio {
  gint64 num = 1, den = 1;
  Ratio inverse () const { return {den, num}; }
};

/** How rate and size change between two pads. */
struct CapsScale {
  Ratio rate = {}, width = {}, height = {};
  /** Rows that are cropped before the height is scaled; negative: that many are
   * added after it. */
  int crop_rows = 0;

  CapsScale inverse () const;
};

/** Coded frames to the subframes of @p schedule, or of its background: rate x N
 * (only when @p raised_rate), size divided by the cell, the pilot's rows
 * cropped. */
CapsScale coded_to_subframes (const Schedule &schedule, bool raised_rate);

/**
 * @p caps with framerate, width, height and pixel-aspect-ratio scaled.
 *
 * Handles fixed values, ranges, lists and absent fields. Division rounds down,
 * because leftover pixels are cropped, so the inverse of a fixed size is the
 * range of sizes that give it. Values saturate at G_MAXINT. A framerate of 0/1
 * stays. Transfer: full.
 */
GstCaps *scale_caps (GstCaps *caps, const CapsScale &scale);

/** @p caps without these fields. */
CapsPtr without_fields (
    GstCaps *caps, std::initializer_list<const char *> fields);
/** @p caps without the fields that a schedule changes. */
CapsPtr unbind_caps (GstCaps *caps);
/** In the order of @p preferred. */
CapsPtr intersect_caps (GstCaps *preferred, GstCaps *other);

/** @p caps, and unless @p rate is 0/1, those of this rate with 0/1 as well. */
CapsPtr admit_unknown_rate (FrameRate rate, CapsPtr caps);
/** @p caps with @p rate in place of an unknown one, unless @p rate is 0/1. */
CapsPtr fill_in_rate (FrameRate rate, GstCaps *caps);

} // namespace codedexposure::gst
