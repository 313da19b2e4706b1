/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The stream tag of a schedule alone. */
#pragma once

#include "common/raii.h"
#include "common/tag.h"

namespace codedexposure::gst
{

/** A TAG event with the schedule; Transfer: full. */
inline GstEvent *
schedule_to_event (const Schedule &schedule)
{
  return setup_to_event ({schedule, {}});
}

/** A tag list with the schedule; Transfer: full. */
inline GstTagList *
schedule_to_tags (const Schedule &schedule)
{
  const EventPtr event (schedule_to_event (schedule));
  return gst_tag_list_copy (tags_of (event.get ()));
}

/** The schedule of setup_from_tags (). */
inline std::optional<Result<Schedule>>
schedule_from_tags (const GstTagList *tags)
{
  const auto setup = setup_from_tags (tags);
  if (!setup)
    return std::nullopt;
  return *setup ? Result<Schedule> (setup->value ().schedule)
                : Result<Schedule> (setup->error ());
}

} // namespace codedexposure::gst
