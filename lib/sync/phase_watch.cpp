/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "sync/phase_watch.h"

namespace codedexposure
{

namespace
{

/** Regions change the levels of elements, which are means over the frame; those
 * of a one-hot code cannot be told from a flash. */
bool
has_signature (const Schedule &schedule)
{
  return schedule.regions ().empty () && !schedule.code ().one_hot ();
}

} // namespace

SlipObservable
slip_observable (const Schedule &schedule)
{
  if (schedule.pilot_rows () > 0)
    return SlipObservable::always;
  if (!has_signature (schedule) || !SlipSignature (schedule).distinct ())
    return SlipObservable::never;
  return SlipObservable::in_the_frame;
}

PhaseWatch::PhaseWatch (
    const Schedule &schedule, int width, int height, double black)
    : meter_ (schedule, width, height, black)
{
  if (!meter_.complete ())
    return;
  const bool pilot = schedule.pilot_rows () > 0;
  if (pilot)
    pilot_slots_ = schedule.slots ();
  /* With a pilot, the signature of a one-hot code is useful, too: the next
   * frame distinguishes a slip from a flash. */
  SlipSignature signature (schedule);
  if (signature.distinct () && schedule.regions ().empty () &&
      (pilot || !schedule.code ().one_hot ()))
    signature_ = std::move (signature);
}

PhaseSight
PhaseWatch::judge (const Levels &levels)
{
  PhaseReading by_levels;
  if (signature_)
    by_levels = signature_->read (levels.elements);
  if (pilot_slots_ == 0)
    return {by_levels};

  const PhaseReading by_pilot = read_pilot (pilot_slots_, levels.pilot);
  if (by_pilot.kind == PhaseReading::Kind::slipped ||
      by_levels.kind != PhaseReading::Kind::slipped)
    return {by_pilot};
  return {by_levels, true};
}

} // namespace codedexposure
