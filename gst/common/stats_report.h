/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The measurements of subframestats as a meta, a message or a line of a file;
 * docs/streams.md describes the fields. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <gst/gst.h>

#include "common/structure.h"
#include "stats/picture_stats.h"

namespace codedexposure::gst
{

/** Name of the custom meta, "CodedExposureStats"; tagged {"video"}. */
extern const char *const kStatsMetaName;

/** The measurements of one picture. */
struct StatsReport {
  guint64 frame = 0;  ///< number of the coded frame
  gint subframe = -1; ///< -1 on a coded frame, or unknown
  GstClockTime pts = GST_CLOCK_TIME_NONE;
  GstClockTime running_time = GST_CLOCK_TIME_NONE;
  std::vector<const char *> flags; ///< flag_names () of the buffer
  /* For lines of a file only: */
  GstClockTime duration = GST_CLOCK_TIME_NONE;
  std::optional<bool> synchronised; ///< none: unknown
  guint64 lost_before = 0;          ///< coded frames
  const PictureStats &stats;
  CODED_FIELDS (frame, subframe, pts, stats.mean, stats.minimum, stats.maximum,
      stats.entropy, stats.saturated, stats.pixels, stats.histogram,
      stats.profile);
};

/** Writes @p report to the meta of @p buffer, which must be writable, and
 * returns the meta's structure; Transfer: none. */
GstStructure *set_stats_meta (GstBuffer *buffer, const StatsReport &report);

/** Lines of a file, without line ends. */
std::string json_line (const StatsReport &report);
std::string csv_line (const StatsReport &report);
extern const char *const kCsvHead;

} // namespace codedexposure::gst
