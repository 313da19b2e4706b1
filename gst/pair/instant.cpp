/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "pair/instant.h"

#include "common/element.h"
#include "common/meta.h"

namespace codedexposure::gst
{

GstSegment
segment_at (GstAggregatorPad *pad)
{
  return locked (pad, [pad] { return pad->segment; });
}

Instant
instant_of (GstAggregatorPad *pad, GstBuffer *frame)
{
  const auto known = [] (GstClockTime time) {
    return GST_CLOCK_TIME_IS_VALID (time)
               ? std::optional (GstClockTimeDiff (time))
               : std::nullopt;
  };
  const GstSegment segment = segment_at (pad);
  const auto meta = get_frame_meta (frame);
  Instant instant{known (meta ? meta->exposure_start : GST_CLOCK_TIME_NONE),
      known (running_time (segment, GST_BUFFER_PTS (frame)))};
  if (instant.said && segment.rate < 0.0)
    instant.said = -*instant.said;
  return instant;
}

std::optional<GstClockTimeDiff>
later_by (const Instant &one, const Instant &other)
{
  for (const auto member : {&Instant::said, &Instant::running})
    if (one.*member && other.*member)
      return *(one.*member) - *(other.*member);
  return std::nullopt;
}

GstClockTime
period_of (const GstVideoInfo &info, GstBuffer *frame)
{
  if (info.fps_n > 0)
    return gst_util_uint64_scale (GST_SECOND, info.fps_d, info.fps_n);
  return GST_BUFFER_DURATION_IS_VALID (frame) ? GST_BUFFER_DURATION (frame)
                                              : 40 * GST_MSECOND;
}

Found
find_partner (GstAggregatorPad *on, GstAggregatorPad *off, GstBuffer *coded,
    GstClockTimeDiff slack, bool late, BufferPtr &partner,
    std::vector<BufferPtr> &dropped)
{
  const Instant start = instant_of (on, coded);
  while (const BufferPtr next{gst_aggregator_pad_peek_buffer (off)}) {
    const auto late_by = later_by (instant_of (off, next.get ()), start);
    if (late_by && *late_by > slack)
      return Found::kNone;
    if (late_by && *late_by >= -slack) {
      partner.reset (gst_aggregator_pad_pop_buffer (off));
      return Found::kPartner;
    }
    dropped.emplace_back (gst_aggregator_pad_pop_buffer (off));
  }
  return late || gst_aggregator_pad_is_eos (off) ? Found::kNone : Found::kWait;
}

} // namespace codedexposure::gst
