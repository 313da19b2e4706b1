/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "damage.h"

#include <utility>

#include "common/messages.h"

namespace codedexposure::gst
{

void
DamageReport::restart ()
{
  forget ();
  const ObjectLock lock (element_);
  counters_ = {};
}

void
DamageReport::count (guint64 Counters::*counter, guint64 by)
{
  const ObjectLock lock (element_);
  counters_.*counter += by;
}

void
DamageReport::frame_flagged (
    bool known, guint64 number, GstClockTime pts, const char *reason)
{
  count (known ? &Counters::frames_damaged : &Counters::frames_unknown);
  if (open_.count++ > 0)
    return;
  open_.frame = number;
  open_.from = pts;
  post_message (element_, FramesDamaged{.active = true,
                              .frame = number,
                              .count = {},
                              .from = pts,
                              .reason = reason});
}

void
DamageReport::end_sequence ()
{
  const Sequence over = std::exchange (open_, {});
  if (over.count > 0)
    post_message (element_, FramesDamaged{.active = false,
                                .frame = over.frame,
                                .count = over.count,
                                .from = over.from,
                                .reason = {}});
}

void
DamageReport::frames_missing (guint64 count, GstClockTime from)
{
  if (count == 0)
    return;
  this->count (&Counters::frames_missing, count);
  post_message (element_, FramesMissing{count, from});
}

void
DamageReport::stream_cut ()
{
  const guint64 frames = locked (element_, [&] { return counters_.frames; });
  post_message (element_, StreamCut{frames});
}

void
DamageReport::stream_ended (guint64 total)
{
  const guint64 known = locked (
      element_, [&] { return counters_.frames + counters_.frames_missing; });
  if (known >= total)
    return;
  count (&Counters::frames_missing, total - known);
  post_message (element_, StreamIncomplete{total - known});
}

StructurePtr
DamageReport::stats (guint64 lines_damaged) const
{
  Counters counters = counters_;
  counters.lines_damaged = lines_damaged;
  return StructurePtr (to_structure (counters));
}

} // namespace codedexposure::gst
