/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The numbered source pads: which there can be, and their time. */
#include "demux.h"

#include "common/element.h"

namespace codedexposure::gst::demux
{

namespace
{

/* How many numbered pads of @kind @schedule allows; null: any schedule. */
int
numbered_pads (PadKind kind, const Schedule *schedule)
{
  if (kind == PadKind::region)
    return schedule ? int (schedule->regions ().size ())
                    : Schedule::kMaxRegions;
  return schedule ? schedule->elements () : Tile::kMaxElements;
}

} // namespace

std::string
pads_text (PadKind kind, const Schedule *schedule)
{
  const int n = numbered_pads (kind, schedule);
  const std::string prefix = prefix_of (kind);
  const std::string owner =
      schedule ? schedule->text () : "the largest schedule";
  if (n == 0)
    return owner + " has no regions.";
  return owner + " has " + prefix + "0" +
         (n > 1 ? " to " + prefix + std::to_string (n - 1) : "") + ".";
}

/* Before a schedule is in force, any number that a schedule can have is
 * allowed; check_pads () checks again. */
bool
Demux::allows_pad (PadKind kind, int index) const
{
  const ScheduleRef schedule =
      locked (element (), [&] { return shared_.schedule; });
  if (index >= 0 && index < numbered_pads (kind, schedule.get ()))
    return true;
  POST_WARNING (element (), STREAM, WRONG_TYPE,
      "There is no pad " + (prefix_of (kind) + std::to_string (index)) + ": " +
          pads_text (kind, schedule.get ()));
  return false;
}

/* Whether the schedule has a subframe or a region for each of @pads. */
bool
Demux::check_pads (const PadMap &pads) const
{
  const Schedule &schedule = format ().schedule;
  for (const PadKind kind : {PadKind::one, PadKind::region}) {
    const auto beyond =
        pads.lower_bound ({kind, numbered_pads (kind, &schedule)});
    if (beyond == pads.end () || beyond->first.first != kind)
      continue;
    return post_error (
        "Pad " + (prefix_of (kind) + std::to_string (beyond->first.second)) +
        " was requested, but " + pads_text (kind, &schedule));
  }
  return true;
}

/* Subframe k alone is pushed at the time of its slot, and so is what replaces
 * it. */
EventPtr
Demux::gap_for (const GstCodedPad *pad, GstEvent *gap) const
{
  const auto k = std::size_t (pad->state.index);
  if (pad->state.kind != PadKind::one || !plan_ ||
      k >= plan_->background ().boundaries.size ())
    return EventPtr (gst_event_ref (gap));
  GstClockTime pts, duration;
  gst_event_parse_gap (gap, &pts, &duration);
  return gap_like (
      gap, pts + GstClockTime (plan_->background ().boundaries[k]), duration);
}

} // namespace codedexposure::gst::demux
