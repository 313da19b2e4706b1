/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "report.h"

#include <nlohmann/json.hpp>

#include "base/text.h"

namespace codedexposure::gst
{

const char *const kStatsMetaName = "CodedExposureStats";

const char *const kCsvHead =
    "frame,subframe,pts_ns,mean,minimum,maximum,entropy,saturated,pixels,"
    "flags,histogram,profile";

namespace
{

/* Takes the array: Transfer full, as gst_structure_take_value () does. */
template <typename T>
void
take_array (GstStructure *structure, const char *field,
    const std::vector<T> &numbers, GType type,
    void (*set) (GValue *value, T number))
{
  GValue array = G_VALUE_INIT;
  gst_value_array_init (&array, guint (numbers.size ()));
  for (const T number : numbers) {
    GValue value = G_VALUE_INIT;
    g_value_init (&value, type);
    set (&value, number);
    gst_value_array_append_and_take_value (&array, &value);
  }
  gst_structure_take_value (structure, field, &array);
}

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

void
register_stats_meta ()
{
  static const gchar *tags[] = {"video", nullptr};
  if (!gst_meta_get_info (kStatsMetaName))
    gst_meta_register_custom (kStatsMetaName, tags, nullptr, nullptr, nullptr);
}

GstStructure *
set_stats_meta (GstBuffer *buffer, const StatsReport &report)
{
  GstCustomMeta *meta = gst_buffer_get_custom_meta (buffer, kStatsMetaName);
  if (!meta)
    meta = gst_buffer_add_custom_meta (buffer, kStatsMetaName);
  GstStructure *fields = gst_custom_meta_get_structure (meta);
  const PictureStats &stats = report.stats;
  gst_structure_set (fields, "frame", G_TYPE_UINT64, report.frame, "subframe",
      G_TYPE_INT, report.subframe, "pts", G_TYPE_UINT64, report.pts, "mean",
      G_TYPE_DOUBLE, stats.mean, "minimum", G_TYPE_UINT, stats.minimum,
      "maximum", G_TYPE_UINT, stats.maximum, "entropy", G_TYPE_DOUBLE,
      stats.entropy, "saturated", G_TYPE_UINT64, guint64 (stats.saturated),
      "pixels", G_TYPE_UINT64, guint64 (stats.pixels), nullptr);
  take_array<std::uint64_t> (fields, "histogram", stats.histogram,
      G_TYPE_UINT64, [] (GValue *value, std::uint64_t number) {
        g_value_set_uint64 (value, number);
      });
  take_array<double> (
      fields, "profile", stats.profile, G_TYPE_DOUBLE, g_value_set_double);
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
      GST_CLOCK_TIME_IS_VALID (report.running_time)
          ? std::to_string (report.running_time)
          : "",
      real_text (stats.mean), std::to_string (stats.minimum),
      std::to_string (stats.maximum), real_text (stats.entropy),
      std::to_string (stats.saturated), std::to_string (stats.pixels), flags,
      listed (stats.histogram), listed (stats.profile)};
  std::string line;
  for (const std::string &field : fields)
    line.append (&field == fields ? "" : ",").append (field);
  return line;
}

} // namespace codedexposure::gst
