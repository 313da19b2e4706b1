/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What passes a pad, and what the pad says of its stream. */
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "common/raii.h"
#include "record/provenance.h"

namespace codedexposure::app
{

using Probe = std::function<GstPadProbeReturn (GstPad *, GstPadProbeInfo *)>;

/** gst_pad_add_probe () for a function object, which exists as long as the
 * probe. @p what  GstPadProbeTypes. Returns the number of the probe. */
gulong add_probe (GstPad *pad, int what, Probe probe);
/** Calls @p take with each buffer that passes @p pad, before it passes. */
void watch_buffers (
    GstPad *pad, std::function<void (GstPad *, GstBuffer *)> take);

/** The element that @p pad is linked to; null: there is none. */
gst::ObjectPtr<GstElement> element_behind (GstPad *pad);
/** None: no segment has come. */
std::optional<GstSegment> segment_at (GstPad *pad);
/** On the time axis of the recording, where positions count. */
GstClockTime stream_time (GstPad *pad, GstClockTime time);
/** None: no caps have come, or not those of raw video. */
std::optional<GstVideoInfo> video_at (GstPad *pad);
/** The events with tags that have come. */
std::vector<gst::EventPtr> tags_at (GstPad *pad);
/** What they say of how pictures were made; none: nothing. */
std::optional<Provenance> provenance_in (
    const std::vector<gst::EventPtr> &tags);

} // namespace codedexposure::app
