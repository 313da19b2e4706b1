/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What each schedule would be worth, and which one to take. */
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "advise/exposure_model.h"
#include "advise/scene_statistics.h"
#include "schedule/schedule.h"

namespace cexp
{

/** What is asked. */
struct Conditions {
  Camera camera;
  /** Electrons that white makes in a frame period of exposure without mirrors,
   * as a part of the full well. */
  double light = 1.0;
  SceneStatistics scene;
};

/** What a schedule would do. */
struct Prediction {
  std::optional<Schedule> schedule; ///< none: an ordinary exposure
  double frame_rate = 0.0;          ///< of the subframes
  Extent subframe;
  double efficiency = 0.0;     ///< ExposureModel::efficiency ()
  double slot_electrons = 0.0; ///< that white makes in a slot
  double snr_white = 0.0;      ///< dB, ExposureModel::snr ()
  double snr_grey = 0.0;       ///< dB, at kGrey of white
  double psnr = 0.0;           ///< dB, LinearEstimate::psnr ()
  bool overexposed = false;
  /** Of a schedule with regions, what each part would do: the background, then
   * the regions. The whole has the rate and the subframes of the slowest part,
   * the fewest electrons, and the means over all pixels of light and errors. */
  std::vector<Prediction> parts = {};

  /** A photographer's middle grey. */
  static constexpr double kGrey = 0.18;

  /** The schedule's text; "none" for an ordinary exposure. */
  std::string text () const;
};

/** Error when a number is out of range, the slots do not fit the frame period,
 * the code cannot be inverted or has more than LinearEstimate::kMaxElements. */
Result<Prediction> predict (
    const std::optional<Schedule> &schedule, const Conditions &conditions);

/** Schedules that are worth a thought, fewest slots first, with these times
 * between masks and for reading out. */
std::vector<Schedule> usual_schedules (
    Nanoseconds switching, Nanoseconds readout);

/** The one with the highest PSNR of those that are not overexposed and reach
 * @p least_rate subframes/s; null where there is none. */
const Prediction *recommend (
    std::span<const Prediction> predictions, double least_rate);

} // namespace cexp
