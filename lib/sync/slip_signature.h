/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Slips of a DMD in the mean levels of the elements. */
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "schedule/matrix.h"
#include "schedule/schedule.h"
#include "sync/phase_reading.h"

namespace codedexposure
{

/**
 * Determines from the levels of the elements for how many slots each mask was
 * shown.
 *
 * After a slip within an exposure, one mask is shown twice and another never;
 * solving the code for the slots gives 2 and 0 for these and 1 for all others.
 * Light that changes during the exposure changes the levels, too, but hardly
 * ever to such numbers: a slip is only reported if they fit. In later frames
 * every mask is shown for one slot again, and the slip is invisible here,
 * because the sum of the masks does not depend on their order.
 *
 * The effect of texture that repeats with the tile is learned from the frames,
 * as is the blur of the lens if the levels of the code show it.
 */
class SlipSignature
{
public:
  explicit SlipSignature (const Schedule &schedule);

  /** Whether a slip by one slot, anywhere within the exposure, changes the
   * levels more than the scene does. */
  bool distinct () const { return distinct_; }

  /** Reads one frame, and learns from it. @p levels: of each element. */
  PhaseReading read (std::span<const double> levels);

private:
  using Vector = std::vector<double>; // a value for each element, or each slot

  struct Lens {
    Vector code;  // levels of the code, in light of 1 a slot
    Matrix slots; // from the levels of the elements to the light of the slots
    Vector shown; // slots for which each mask was shown, by this lens
    double deviation; // of these in frames without a slip
    bool likely;      // it explains the usual levels
  };
  struct Slip {
    std::vector<int> shown; // slots for which each mask was shown
    int slots;
    bool certain;
  };

  void add_lens (const Schedule &schedule, double blur);
  void add_slip (int slots, int from, int late);
  Vector slots_shown (std::span<const double> levels, const Lens &lens) const;
  PhaseReading read_slip (double light) const;
  bool is_parked (std::span<const double> levels) const;
  void guess_usual (std::span<const double> levels);
  bool is_steady () const;
  void learn (std::span<const double> levels, double light, bool steady);
  void judge_lenses ();

  std::vector<Lens> lenses_; // from sharp to blurred
  std::vector<Slip> slips_;
  bool distinct_ = false;
  double code_light_;  // sum of the levels in light of 1 a slot
  double parked_part_; // of it with parked mirrors, by off-state leakage

  Vector usual_;          // levels in light of 1 a slot
  double brightness_ = 0; // light of a slot in the last frame in phase
  int learned_ = 0;       // frames
};

} // namespace codedexposure
