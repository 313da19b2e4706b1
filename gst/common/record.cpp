/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "record.h"

#include <algorithm>

#include "element.h"
#include "extract/saturation.h"
#include "meta.h"
#include "raii.h"
#include "record/pixel_hash.h"

namespace codedexposure::gst
{

namespace
{

constexpr struct {
  GstBufferFlags flag;
  const char *name;
} kFlags[] = {
    {GST_BUFFER_FLAG_DISCONT, "discont"},
    {GST_BUFFER_FLAG_CORRUPTED, "corrupted"},
    {GST_BUFFER_FLAG_GAP, "gap"},
    {GST_BUFFER_FLAG_DROPPABLE, "droppable"},
};

constexpr const char *kCarriedHash = "CodedExposureHash";

std::optional<guint64>
carried_hash (GstBuffer *frame)
{
  guint64 hash = 0;
  GstCustomMeta *meta = gst_meta_get_info (kCarriedHash)
                            ? gst_buffer_get_custom_meta (frame, kCarriedHash)
                            : nullptr;
  return meta && gst_structure_get_uint64 (
                     gst_custom_meta_get_structure (meta), "hash", &hash)
             ? std::optional (hash)
             : std::nullopt;
}

std::optional<Nanoseconds>
known_time (GstClockTime time)
{
  return GST_CLOCK_TIME_IS_VALID (time)
             ? std::optional (
                   Nanoseconds (std::min<GstClockTime> (time, G_MAXINT64)))
             : std::nullopt;
}

/** What comes from the meta. */
void
record_meta (FrameRecord &record, const FrameMeta &meta)
{
  record.frame = meta.frame;
  record.exposure_duration = known_time (meta.exposure_duration);
  record.time_uncertainty = known_time (meta.time_uncertainty);
  record.locked = meta.locked;
  record.slip = meta.slip;
  record.lost_before = meta.lost_before;
  record.pattern = meta.pattern;
  record.bits = meta.bits;
}

GstClockTime
time_or_none (const std::optional<Nanoseconds> &time)
{
  return time ? GstClockTime (*time) : GST_CLOCK_TIME_NONE;
}

} // namespace

std::string
too_far_text (GstClockTime time)
{
  return "A coded frame has a time of " + std::to_string (time) +
         " ns, but none may be farther from 0 than 73 years (" +
         std::to_string (kFarthestTime) +
         " ns). Let the source begin its times near 0.";
}

std::vector<const char *>
flag_names (GstBuffer *buffer)
{
  std::vector<const char *> names;
  for (const auto &[flag, name] : kFlags)
    if (GST_BUFFER_FLAG_IS_SET (buffer, flag))
      names.push_back (name);
  return names;
}

void
carry_hash (GstBuffer *frame, guint64 hash)
{
  register_meta (kCarriedHash);
  gst_structure_set (gst_custom_meta_get_structure (
                         gst_buffer_add_custom_meta (frame, kCarriedHash)),
      "hash", G_TYPE_UINT64, hash, nullptr);
}

std::optional<guint64>
hash_of (GstBuffer *frame, const GstVideoInfo &info)
{
  MappedFrame mapped (info, frame, GST_MAP_READ);
  if (!mapped)
    return std::nullopt;
  return read_pixels (mapped, [] (auto pixels) { return pixel_hash (pixels); });
}

FrameRecord
record_of (GstBuffer *frame, const GstVideoInfo &info,
    const GstSegment &segment, int pilot, guint64 number)
{
  const auto running = [&segment] (GstClockTime time) {
    return known_time (running_time (segment, time));
  };
  FrameRecord record;
  record.frame = number;
  record.pts = running (GST_BUFFER_PTS (frame));
  record.duration = known_time (GST_BUFFER_DURATION (frame));
  const auto meta = get_frame_meta (frame);
  if (meta) {
    record_meta (record, *meta);
    record.exposure_start = running (meta->exposure_start);
    if (meta->subframe >= 0)
      record.slot = meta->subframe;
  }
  for (const char *flag : flag_names (frame))
    record.flags.emplace_back (flag);

  if (const auto hash = carried_hash (frame)) {
    record.hash = hash;
    record.saturated = meta ? std::optional (meta->saturated) : std::nullopt;
    return record;
  }
  if (!info.finfo)
    return record;
  MappedFrame mapped (info, frame, GST_MAP_READ);
  if (!mapped)
    return record;
  read_pixels (mapped, [&] (auto pixels) {
    record.hash = pixel_hash (pixels);
    /* Those of a subframe were counted when it was extracted. */
    if (meta && meta->subframe >= 0)
      record.saturated = meta->saturated;
    else if (meta)
      record.saturated = codedexposure::count_saturated (
          pixels.rows (0, std::max (0, pixels.height - pilot)),
          significant_bits_of (meta->bits, info));
  });
  return record;
}

void
apply_record (
    GstBuffer *frame, const FrameRecord &record, GstClockTimeDiff offset)
{
  if (record.pts)
    GST_BUFFER_PTS (frame) = GstClockTime (*record.pts + offset);
  if (record.duration)
    GST_BUFFER_DURATION (frame) = GstClockTime (*record.duration);
  for (const auto &[flag, name] : kFlags)
    if (std::ranges::find (record.flags, name) != record.flags.end ())
      GST_BUFFER_FLAG_SET (frame, flag);

  FrameMeta meta;
  meta.frame = record.frame;
  meta.subframe = record.slot.value_or (-1);
  if (record.exposure_start)
    meta.exposure_start = GstClockTime (*record.exposure_start + offset);
  meta.exposure_duration = time_or_none (record.exposure_duration);
  meta.time_uncertainty = time_or_none (record.time_uncertainty);
  meta.locked = record.locked;
  meta.slip = record.slip.value_or (0);
  meta.lost_before = record.lost_before.value_or (0);
  meta.pattern = record.pattern;
  meta.saturated = record.saturated.value_or (0);
  meta.bits = record.bits;
  if (!record.slot)
    meta.hash = record.hash;
  set_frame_meta (frame, meta);
}

} // namespace codedexposure::gst
