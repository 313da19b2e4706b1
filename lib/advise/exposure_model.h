/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The light of each slot in a pixel, and the noise of the pixel. */
#pragma once

#include <optional>

#include "base/result.h"
#include "estimate/observation.h"
#include "schedule/schedule.h"

namespace codedexposure
{

/** The camera that records coded frames. */
struct Camera {
  Extent size{768, 576};
  FrameRate rate;
  SensorNoise noise{10000.0, 5.0}; ///< the full well must be above 0
  int bits = 8;                    ///< of a pixel, 1..16
};

/**
 * A coded exposure as a linear map from the light of the slots to pixels, with
 * the noise of photons, of reading and of rounding.
 *
 * Values are parts of white in one slot. With the analog gain, white has the
 * largest pixel value for the element that is on longest, as in
 * codedexposure-sim.
 */
class ExposureModel
{
public:
  /**
   * @p schedule  none: an ordinary exposure, one slot without mirrors. Without
   *              regions, or a part of one with regions, by which the analog
   *              gain is set.
   * @p light     electrons of white in one frame period of exposure without
   *              mirrors, as a part of the full well; > 0.
   * Error when a number is out of range, or the slots do not fit the camera's
   * frame period.
   */
  static Result<ExposureModel> make (const std::optional<Schedule> &schedule,
      const Camera &camera, double light);

  int elements () const { return observation_.slots (); }
  int slots () const { return observation_.slots (); }
  /** Light of all slots together. */
  double light (int element) const;
  /** The same exposure in parts of the coded frame's white. */
  const Observation &observation () const { return observation_; }
  /** Element of a pixel. */
  int element_at (int x, int y) const
  {
    return schedule_ ? schedule_->element_at (x, y) : 0;
  }
  /** Duration of a slot's light, distance of two slots, and duration of a
   * subframe, seconds. */
  double active () const { return active_; }
  double pitch () const { return pitch_; }
  double hold () const { return hold_; }

  /** Electrons of white in one slot of a mirror that is on. */
  double slot_electrons () const { return slot_electrons_; }
  /** Part of the light of a frame period that reaches the sensor, mean over
   * the elements, without leaked light. */
  double efficiency () const { return efficiency_; }
  /** White exceeds the full well. */
  bool overexposed () const { return overexposed_; }

  /** Variance of an element's pixel where the scene is @p level of white in
   * every slot. */
  double variance (int element, double level) const;
  /**
   * Signal to noise, dB, of a pixel of a subframe where the scene is @p level
   * of white: the code solved without interpolation, mean noise power over the
   * slots. Error when the code cannot be inverted.
   */
  Result<double> snr (double level) const;

private:
  ExposureModel (const std::optional<Schedule> &schedule, const Camera &camera,
      double slot_electrons);

  std::optional<Schedule> schedule_;
  double white_slots_;
  double slot_electrons_;
  Observation observation_;
  double active_ = 0.0, pitch_ = 0.0, hold_ = 0.0;
  double efficiency_ = 0.0;
  bool overexposed_ = false;
};

} // namespace codedexposure
