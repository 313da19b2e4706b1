/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The stream tag that carries a schedule and, if known, a mapping:
 * GST_TAG_COMMENT = "coded-exposure={...}". */
#pragma once

#include <optional>

#include <gst/gst.h>

#include "base/result.h"
#include "mapping/stream_setup.h"
#include "schedule/schedule.h"

namespace codedexposure::gst
{

/** A tag list with the schedule; Transfer: full. */
GstTagList *schedule_to_tags (const Schedule &schedule);
/** A TAG event with the schedule; Transfer: full. */
GstEvent *schedule_to_event (const Schedule &schedule);

/** A TAG event with schedule and mapping; Transfer: full. */
GstEvent *setup_to_event (const StreamSetup &setup);

/** Schedule and mapping in @p tags; as schedule_from_tags (). */
std::optional<Result<StreamSetup>> setup_from_tags (const GstTagList *tags);
/** The schedule in @p tags: none if no comment has one, an error if it cannot
 * be read. */
std::optional<Result<Schedule>> schedule_from_tags (const GstTagList *tags);

/** The TAG event @p event with @p setup in place of the one in its tags;
 * Transfer: full, of both. */
GstEvent *replace_setup (GstEvent *event, const StreamSetup &setup);

} // namespace codedexposure::gst
