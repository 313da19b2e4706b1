/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "measure.h"

#include "common/meta.h"
#include "common/partner.h"
#include "common/stats_report.h"
#include "pipeline/decoder.h"
#include "pipeline/pads.h"
#include "pipeline/recording.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

/* The numbers of the field @name. */
template <typename T>
std::vector<T>
numbers_in (const GstStructure *structure, const char *name)
{
  std::vector<T> numbers;
  const GValue *array = gst_structure_get_value (structure, name);
  if (!array || !GST_VALUE_HOLDS_ARRAY (array))
    return numbers;
  for (guint i = 0; i < gst_value_array_get_size (array); i++)
    if (const GValue *value = gst_value_array_get_value (array, i);
        G_VALUE_HOLDS (value, Wire<T>::type ()))
      numbers.push_back (Wire<T>::get (value));
  return numbers;
}

/* A chain's end that measures into @stream. */
void
add_meter (Chain chain, const MeasureOptions &options, MeasuredStream &stream,
    const std::string &csv)
{
  const auto location = csv.empty () ? std::nullopt : std::optional (csv);
  chain.to ("queue").to ("subframestats",
      {{"format", "csv"}, {"post-messages", false}, {"line", options.line},
          {"bits", options.decode.bits}, {"location", location}});
  watch_buffers (pad_of (chain.last (), "src").get (),
      [&stream] (
          GstPad *pad, GstBuffer *picture) { stream.add (pad, picture); });
  chain.to ("fakesink");
}

Measurement
measure_once (const MeasureOptions &options, bool salvage)
{
  Measurement all;
  Job job ("report", options.run);
  job.options.json = job.has_result = false;
  job.salvage = all.salvaged = salvage;
  job.times = options.times;
  job.said = options.said;
  all.coded.details = all.subframes.details = options.details;
  if (options.decode.bits)
    all.coded.bits = all.subframes.bits = *options.decode.bits;
  Chain frames = read_recording (job, options.recording);
  watch_buffers (
      pad_of (job.reader, "src").get (), [&all] (GstPad *, GstBuffer *frame) {
        all.pairs += get_partner (frame).has_value ();
      });
  const DecoderPads pads = add_demux (job, frames, options.decode, {});
  add_meter (pads.pictures, options, all.subframes, options.subframes_csv);
  add_meter (pads.coded (), options, all.coded, options.coded_csv);
  all.result = play (job);
  return all;
}

} // namespace

void
MeasuredStream::add (GstPad *pad, GstBuffer *picture)
{
  if (const auto info = video_at (pad); pictures.empty () && info) {
    const auto meta = get_frame_meta (picture);
    const int depth = int (GST_VIDEO_INFO_COMP_DEPTH (&*info, 0));
    const int known = meta ? significant_bits_of (meta->bits, *info) : 0;
    if (bits == 0)
      bits = known > 0 ? known : depth;
    size = {info->width, info->height};
    rate = {info->fps_n, info->fps_d};
    provenance = provenance_in (tags_at (pad));
  }
  MeasuredPicture measured;
  auto *meta = gst_buffer_get_custom_meta (picture, kStatsMetaName);
  if (!meta)
    return;
  const GstStructure *fields = gst_custom_meta_get_structure (meta);
  if (!read_fields (fields, measured))
    return;
  const auto segment = segment_at (pad);
  measured.pts =
      gst_segment_to_stream_time (&*segment, GST_FORMAT_TIME, measured.pts);
  measured.damaged =
      GST_BUFFER_FLAG_IS_SET (picture, GST_BUFFER_FLAG_CORRUPTED);
  if (details) {
    measured.stats.histogram = numbers_in<guint64> (fields, "histogram");
    measured.stats.profile = numbers_in<gdouble> (fields, "profile");
  }
  pictures.push_back (std::move (measured));
}

Measurement
measure (const MeasureOptions &options)
{
  Measurement found = measure_once (options, false);
  return found.result.container_damaged && !options.times.is_part ()
             ? measure_once (options, true)
             : found;
}

} // namespace codedexposure::app
