/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The slip of a DMD seen in the mean levels of the elements. */
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
 * Reads from the levels of the elements for how many slots each mask stood.
 *
 * A slip inside an exposure shows one mask twice and another never; solving the
 * code for the slots gives 2 and 0 for these and 1 for all others. Light that
 * changes during the exposure moves the levels, too, but hardly ever to such
 * numbers: a slip is only read where they fit. In the frames after the one in
 * which it happened every mask stands for one slot again, and the slip is
 * invisible here: the sum of the masks does not depend on their order.
 *
 * What texture in step with the tile does to the levels is learned from the
 * frames, and so is the blur of the lens where the code's own levels show it.
 */
class SlipSignature
{
public:
  explicit SlipSignature (const Schedule &schedule);

  /** Whether a slip by one slot changes the levels of the code enough to be
   * told from the scene, wherever inside the exposure it happens. */
  bool distinct () const { return distinct_; }

  /** Reads one frame, and learns from it. @p levels: of each element. */
  PhaseReading read (std::span<const double> levels);

private:
  using Vector = std::vector<double>; // a value for each element, or each slot

  struct Lens {
    Vector code;  // levels of the code, in light of 1 a slot
    Matrix slots; // from the levels of the elements to the light of the slots
    Vector stood; // slots for which each mask stood in this frame, by this lens
    double unrest; // of these in frames without a slip
    bool likely;   // it could have made the usual levels
  };
  struct Slip {
    std::vector<int> stood; // slots for which each mask stood
    int slots;
    bool certain;
  };

  void add_lens (const Schedule &schedule, double blur);
  void add_slip (int slots, int from, int late);
  Vector slots_stood (std::span<const double> levels, const Lens &lens) const;
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
  double parked_part_; // of it that parked mirrors let through

  Vector usual_;          // levels in light of 1 a slot
  double brightness_ = 0; // light of a slot in the last frame in phase
  int learned_ = 0;       // frames
};

} // namespace codedexposure
