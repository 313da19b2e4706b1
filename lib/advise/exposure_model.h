/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How much light of each slot a pixel gets, and how noisy that makes it. */
#pragma once

#include <optional>
#include <vector>

#include "base/result.h"
#include "schedule/schedule.h"
#include "stats/sensor_noise.h"

namespace cexp
{

/** What takes the coded frames. */
struct Camera {
  Extent size{768, 576};
  FrameRate rate;
  SensorNoise noise{10000.0, 5.0}; ///< its full well is above 0
  int bits = 8;                    ///< of the converter, 1..16
};

/**
 * A coded exposure as a linear map from the light of the slots to pixels, with
 * the noise of photons, of reading and of rounding.
 *
 * Values are parts of what white makes in one slot. The analog gain is such
 * that white just makes the largest number for the element that is open
 * longest, as codedexposure-sim has it.
 */
class ExposureModel
{
public:
  /**
   * @p schedule  none: an ordinary exposure, one slot without mirrors. Without
   *              regions, or a part of one with regions, by which the analog
   *              gain is set.
   * @p light     electrons that white makes in a frame period of exposure
   *              without mirrors, as a part of the full well; > 0.
   * Error when a number is out of range, or the slots do not fit the camera's
   * frame period.
   */
  static Result<ExposureModel> make (const std::optional<Schedule> &schedule,
      const Camera &camera, double light);

  int elements () const { return n_; }
  int slots () const { return n_; }
  /** Light of slot @p slot that an element lets through: 1, or the leak. */
  double open (int element, int slot) const
  {
    return open_[std::size_t (element * n_ + slot)];
  }
  /** Element of a pixel. */
  int element_at (int x, int y) const
  {
    return schedule_ ? schedule_->element_at (x, y) : 0;
  }
  /** Seconds of a slot's light, between the middles of two slots, and for
   * which a subframe stands. */
  double active () const { return active_; }
  double pitch () const { return pitch_; }
  double hold () const { return hold_; }

  /** Electrons that white makes in one slot of an open mirror. */
  double slot_electrons () const { return slot_electrons_; }
  /** Part of the light of a frame period that reaches the sensor, mean over
   * the elements, leaked light left out. */
  double efficiency () const { return efficiency_; }
  /** White is more than a pixel holds. */
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
  ExposureModel () = default;

  std::optional<Schedule> schedule_;
  int n_ = 1;
  std::vector<double> open_;
  double active_ = 0.0, pitch_ = 0.0, hold_ = 0.0;
  double slot_electrons_ = 0.0;
  SensorNoise noise_;
  double step_ = 0.0; ///< electrons a number
  double efficiency_ = 0.0;
  bool overexposed_ = false;
};

} // namespace cexp
