/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* When the frames of two pads were exposed. */
#pragma once

#include <optional>
#include <vector>

#include <gst/base/gstaggregator.h>
#include <gst/video/video.h>

#include "common/raii.h"

namespace codedexposure::gst
{

/** As the frame's meta says, on the clock of both cameras, or before its zero
 * if time runs backwards, and by its PTS, as running time. */
struct Instant {
  std::optional<GstClockTimeDiff> said, running;
};
Instant instant_of (GstAggregatorPad *pad, GstBuffer *frame);

/** By how much @p one is played later; none: it is not known. Recordings of
 * both cameras may begin with different frames, so what was said comes first.
 */
std::optional<GstClockTimeDiff> later_by (
    const Instant &one, const Instant &other);

/** From one frame to the next. @p info: of their caps. */
GstClockTime period_of (const GstVideoInfo &info, GstBuffer *frame);

enum class Found { kPartner, kNone, kWait };
/** Takes the partner of @p coded, the next frame of @p on, from @p off, and the
 * frames before it into @p dropped. @p slack: how far their times may differ.
 * @p late: no longer waits for it. */
Found find_partner (GstAggregatorPad *on, GstAggregatorPad *off,
    GstBuffer *coded, GstClockTimeDiff slack, bool late, BufferPtr &partner,
    std::vector<BufferPtr> &dropped);

GstSegment segment_at (GstAggregatorPad *pad);

} // namespace codedexposure::gst
