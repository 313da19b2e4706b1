/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "stats_report.h"

#include <nlohmann/json.hpp>

#include "base/text.h"
#include "common/meta.h"

namespace codedexposure::gst
{

const char *const kStatsMetaName = "CodedExposureStats";

const char *const kCsvHead =
    "frame,subframe,pts_ns,mean,minimum,maximum,entropy,saturated,pixels,"
    "flags,histogram,profile,duration_ns,synchronised,lost_before";

namespace
{

/* Numbers in one field of a line of CSV. */
template <typename T>
std::string
listed (const std::vector<T> &numbers)
{
  std::string text;
  for (const T number : numbers) {
    if (!text.empty ())
      text += ' ';
    if constexpr (std::is_floating_point_v<T>)
      text += real_text (number);
    else
      text += std::to_string (number);
  }
  return text;
}

} // namespace

GstStructure *
set_stats_meta (GstBuffer *buffer, const StatsReport &report)
{
  GstCustomMeta *meta = gst_buffer_get_custom_meta (buffer, kStatsMetaName);
  if (!meta)
    meta = gst_buffer_add_custom_meta (buffer, kStatsMetaName);
  GstStructure *fields = gst_custom_meta_get_structure (meta);
  write_fields (fields, report);
  return fields;
}

std::string
json_line (const StatsReport &report)
{
  const PictureStats &stats = report.stats;
  nlohmann::ordered_json line;
  line["frame"] = report.frame;
  if (report.subframe >= 0)
    line["subframe"] = report.subframe;
  if (GST_CLOCK_TIME_IS_VALID (report.running_time))
    line["pts_ns"] = report.running_time;
  line["mean"] = stats.mean;
  line["minimum"] = stats.minimum;
  line["maximum"] = stats.maximum;
  line["entropy"] = stats.entropy;
  line["saturated"] = stats.saturated;
  line["pixels"] = stats.pixels;
  line["flags"] = report.flags;
  if (!stats.histogram.empty ())
    line["histogram"] = stats.histogram;
  if (!stats.profile.empty ())
    line["profile"] = stats.profile;
  if (GST_CLOCK_TIME_IS_VALID (report.duration))
    line["duration_ns"] = report.duration;
  if (report.synchronised)
    line["synchronised"] = *report.synchronised;
  line["lost_before"] = report.lost_before;
  return line.dump ();
}

std::string
csv_line (const StatsReport &report)
{
  const PictureStats &stats = report.stats;
  std::string flags;
  for (const char *flag : report.flags)
    flags.append (flags.empty () ? "" : " ").append (flag);
  const std::string fields[] = {std::to_string (report.frame),
      report.subframe >= 0 ? std::to_string (report.subframe) : "",
      time_text (report.running_time), real_text (stats.mean),
      std::to_string (stats.minimum), std::to_string (stats.maximum),
      real_text (stats.entropy), std::to_string (stats.saturated),
      std::to_string (stats.pixels), flags, listed (stats.histogram),
      listed (stats.profile), time_text (report.duration),
      !report.synchronised   ? ""
      : *report.synchronised ? "true"
                             : "false",
      std::to_string (report.lost_before)};
  std::string line;
  for (const std::string &field : fields)
    line.append (&field == fields ? "" : ",").append (field);
  return line;
}

} // namespace codedexposure::gst
