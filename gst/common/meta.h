/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Metadata of one coded frame or subframe, in a GstCustomMeta. */
#pragma once

#include <optional>
#include <string>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "structure.h"

namespace codedexposure::gst
{

/** Name of the custom meta, "CodedExposureFrame"; tagged {"video"}. Fields:
 * docs/streams.md. */
extern const char *const kFrameMetaName;

/** FrameMeta::pattern of a frame during which the mirrors may have changed from
 * the schedule to a pattern, or back. */
inline constexpr const char *kSwitch = "switch";

struct FrameMeta {
  /** Number of the coded frame since the start of the stream, lost frames
   * counted. */
  guint64 frame = 0;
  /** Index of the subframe in its coded frame; -1 on a coded frame. */
  gint subframe = -1;
  /** Start, on the clock of the PTS, and length of the exposure of the coded
   * frame or of the slot. */
  GstClockTime exposure_start = GST_CLOCK_TIME_NONE;
  GstClockTime exposure_duration = GST_CLOCK_TIME_NONE;
  /** The error of exposure_start that 95 % of frames stay below; none: unknown.
   */
  GstClockTime time_uncertainty = GST_CLOCK_TIME_NONE;
  /** Whether the masks are synchronised with the exposure; none: unknown. */
  std::optional<bool> locked = {};
  /** Slots by which the masks were found late (> 0) or early; 0 unless locked
   * is false. */
  gint slip = 0;
  /** Coded frames lost between this one and the one before. */
  guint64 lost_before = 0;
  /** The pattern that the mirrors showed in place of the schedule, or kSwitch;
   * empty: the schedule. Only a frame of the schedule can be decoded. */
  std::string pattern = {};
  /** Pixels at the largest value. */
  guint64 saturated = 0;
  /** Significant bits of a pixel, counted from the lowest, if they are fewer
   * than the format's; 0: all, or unknown. */
  gint bits = 0;
  /** pixel_hash () of a coded frame of a recording, as it was recorded. */
  std::optional<guint64> hash = {};

  /** All but the pattern; always present, except locked and hash. */
  CODED_FIELDS (frame, subframe, exposure_start, exposure_duration, locked,
      slip, lost_before, saturated, bits, time_uncertainty, hash);
};

/** Whether the pixels of @p picture may not be those of the scene at its time:
 * they are damaged, or repeat others because its frame was lost. */
inline bool
is_corrupted (GstBuffer *picture)
{
  return GST_BUFFER_FLAGS (picture) &
         (GST_BUFFER_FLAG_CORRUPTED | GST_BUFFER_FLAG_GAP);
}

/** A time in a table, ns; "": it is not known. */
inline std::string
time_text (GstClockTime time)
{
  return GST_CLOCK_TIME_IS_VALID (time) ? std::to_string (time) : "";
}

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
/** Sets the meta of @p buffer, which must be writable. */
void set_frame_meta (GstBuffer *buffer, const FrameMeta &meta);
std::optional<FrameMeta> get_frame_meta (GstBuffer *buffer);

/** Significant bits of the pixels of @p frame: @p set unless that is 0, else
 * what its metadata say, else its tags, @p tagged, else all of @p info. */
int bits_of (
    GstBuffer *frame, const GstVideoInfo &info, int set, int tagged = 0);
/** Its pixels are not the scene through the masks of the schedule. */
inline bool
shows_pattern (GstBuffer *frame)
{
  const auto meta = get_frame_meta (frame);
  return meta && !meta->pattern.empty ();
}

/** Copies the metas of @p from to the picture @p to that was made from it,
 * except those that describe memory, and the frame meta if @p to has one.
 * Coordinates are scaled. */
void copy_metas (GstBuffer *from, const GstVideoInfo &from_info, GstBuffer *to,
    const GstVideoInfo &to_info);
/** The same, and flags and times, for @p to with pixels of its own, of the same
 * @p info. */
void copy_description (
    GstBuffer *from, const GstVideoInfo &info, GstBuffer *to);
/** The same for @p to made from a part of the picture; metas with coordinates
 * are not copied. */
void copy_metas_to_part (GstBuffer *from, GstBuffer *to);

} // namespace codedexposure::gst
