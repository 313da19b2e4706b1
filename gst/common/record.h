/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What is known of a frame, as a recording keeps it. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "record/frame_record.h"

namespace codedexposure::gst
{

/**
 * The record of @p frame: its meta, flags and pixels. Times are running times.
 * @p info    of the frame.
 * @p pilot   rows of the pilot at the bottom, whose saturated pixels do not
 *            count.
 * @p number  of a frame without a meta.
 */
FrameRecord record_of (GstBuffer *frame, const GstVideoInfo &info,
    const GstSegment &segment, int pilot, guint64 number);

/** Gives @p frame, which is writable, the meta, flags, PTS and DURATION of
 * @p record. Times of the record count from a moment that is @p offset before
 * zero of the frame's clock. */
void apply_record (
    GstBuffer *frame, const FrameRecord &record, GstClockTimeDiff offset);

/** The error of a frame at @p time, which is beyond kFarthestTime. */
std::string too_far_text (GstClockTime time);

/** Names of the flags of @p buffer that describe its quality: "discont",
 * "corrupted", "gap", "droppable". */
std::vector<const char *> flag_names (GstBuffer *buffer);

/** Lets a frame that is encoded carry the hash of its pixels, for record_of ().
 */
void carry_hash (GstBuffer *frame, guint64 hash);

/** pixel_hash () of @p frame; none if it cannot be mapped. */
std::optional<guint64> hash_of (GstBuffer *frame, const GstVideoInfo &info);

} // namespace codedexposure::gst
