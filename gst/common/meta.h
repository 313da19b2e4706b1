/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What is known of one coded frame or subframe, as a GstCustomMeta. */
#pragma once

#include <optional>
#include <string>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "structure.h"

namespace codedexposure::gst
{

/** Name of the custom meta, "CodedExposureFrame"; tagged {"video"}. Fields:
 * docs/formats.md. */
extern const char *const kFrameMetaName;

struct FrameMeta {
  /** Number of the coded frame since the start of the stream, lost frames
   * counted. */
  guint64 frame = 0;
  /** Index of the subframe in its coded frame; -1 on a coded frame. */
  gint subframe = -1;
  /** Running PTS domain: start and length of the light of the coded frame, or
   * of the slot. */
  GstClockTime exposure_start = GST_CLOCK_TIME_NONE;
  GstClockTime exposure_duration = GST_CLOCK_TIME_NONE;
  /** By how much exposure_start may be wrong (95 of 100 frames keep below);
   * none where nobody says. */
  GstClockTime time_uncertainty = GST_CLOCK_TIME_NONE;
  /** The masks are known to be in phase with the exposure. */
  bool locked = false;
  /** Slots by which the masks were found late (> 0) or early; 0 when locked. */
  gint slip = 0;
  /** Coded frames lost between this one and the one before. */
  guint64 lost_before = 0;
  /** What the mirrors showed in place of the schedule; "": the schedule, or
   * not known, when they are about to change. */
  std::string pattern = {};
  /** Pixels at the largest value. */
  guint64 saturated = 0;
  /** Significant bits of a pixel, counted from the lowest, where they are fewer
   * than the format's; 0: all of them, as far as is known. */
  gint bits = 0;

  /** Those that are always there: all but the pattern. */
  CODED_FIELDS (frame, subframe, exposure_start, exposure_duration, locked,
      slip, lost_before, saturated, bits, time_uncertainty);
};

/** FrameMeta::bits of a picture of @p info with @p bits significant bits. */
inline int
significant_bits_of (int bits, const GstVideoInfo &info)
{
  return bits > 0 && bits < int (GST_VIDEO_INFO_COMP_DEPTH (&info, 0)) ? bits
                                                                       : 0;
}

/** Registers the custom meta @p name, tagged {"video"}, unless it is
 * registered. */
void register_meta (const char *name);
/** Writes @p meta to @p buffer, which must be writable, over what was there. */
void set_frame_meta (GstBuffer *buffer, const FrameMeta &meta);
std::optional<FrameMeta> get_frame_meta (GstBuffer *buffer);

/** Copies the metas of @p from to the picture @p to that was made of it, but
 * those that describe memory, and the frame's where @p to has one. What speaks
 * of places in the picture is scaled.
 */
void copy_metas (GstBuffer *from, const GstVideoInfo &from_info, GstBuffer *to,
    const GstVideoInfo &to_info);
/** The same where @p to was made of a part of the picture; what speaks of
 * places stays behind. */
void copy_metas_to_part (GstBuffer *from, GstBuffer *to);

} // namespace codedexposure::gst
