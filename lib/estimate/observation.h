/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What a pixel of a coded frame tells about the light in each slot. */
#pragma once

#include <optional>
#include <vector>

#include "estimate/sensor_noise.h"
#include "schedule/schedule.h"

namespace codedexposure
{

/** The response of an element's pixels to one slot. */
struct SlotShare {
  int slot;
  double response;
};
/** The slots to which an element responds; all others have no share. */
using SlotShares = std::vector<SlotShare>;

/**
 * The linear model y_e = sum over s of response (e, s) x_s + noise, where x_s
 * is the light of slot s and y_e the pixel of element e times gain (e), both
 * as parts of white (paper, Eq. 7). The responses of an element sum to 1, so
 * that y is a mean over slots for every code.
 */
class Observation
{
public:
  /**
   * @p schedule         none: an ordinary exposure, which is one slot.
   * @p noise            of the camera.
   * @p white_electrons  electrons of a pixel that is white in the coded frame.
   * @p steps            digital numbers between black and white.
   */
  Observation (const std::optional<Schedule> &schedule,
      const SensorNoise &noise, double white_electrons, double steps);

  int slots () const { return int (shares_.size ()); }
  const SlotShares &shares (int element) const
  {
    return shares_[std::size_t (element)];
  }
  /** Of every element. */
  const std::vector<SlotShares> &shares () const { return shares_; }
  double gain (int element) const { return gain_[std::size_t (element)]; }
  /** Whether any is other than 1. */
  bool gains () const;
  /** Variance of the noise of y where the light is @p light. */
  double variance (int element, double light) const;
  /** Every element passes one slot only: its pixel is the light of that slot.
   */
  bool exact () const { return exact_; }
  bool noise_free () const { return noise_.full_well <= 0.0; }

private:
  SensorNoise noise_;
  double white_electrons_;
  double steps_;
  std::vector<SlotShares> shares_;
  std::vector<double> gain_;
  bool exact_;
};

} // namespace codedexposure
