/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Predicts the quality of schedules and recommends one. */
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "advise/exposure_model.h"
#include "advise/scene_statistics.h"
#include "schedule/schedule.h"

namespace codedexposure
{

/** Camera, light and scene of a prediction. */
struct Conditions {
  Camera camera;
  /** Electrons of white in one frame period of exposure without mirrors, as a
   * part of the full well. */
  double light = 1.0;
  SceneStatistics scene;
};

/** The predicted quality of a schedule. */
struct Prediction {
  std::optional<Schedule> schedule; ///< none: an ordinary exposure
  double frame_rate = 0.0;          ///< of the subframes
  Extent subframe;
  double efficiency = 0.0;     ///< ExposureModel::efficiency ()
  double slot_electrons = 0.0; ///< of white in one slot
  double snr_white = 0.0;      ///< dB, ExposureModel::snr ()
  double snr_grey = 0.0;       ///< dB, at kGrey of white
  double psnr = 0.0;           ///< dB, of LinearEstimate::error
  bool overexposed = false;
  /** Of a schedule with regions, the predictions of the parts: the background,
   * then the regions. The whole has the rate and the subframes of the slowest
   * part, the smallest number of electrons, and the means of light and errors
   * over all pixels. */
  std::vector<Prediction> parts = {};

  /** Middle grey in photography. */
  static constexpr double kGrey = 0.18;

  /** The schedule's text; "none" for an ordinary exposure. */
  std::string text () const;
};

/** Error when a number is out of range, the slots do not fit the frame period,
 * the code cannot be inverted or has more than LinearEstimate::kMaxElements. */
Result<Prediction> predict (
    const std::optional<Schedule> &schedule, const Conditions &conditions);

/** Common schedules, those with few slots first, with these times for switching
 * masks and for readout. */
std::vector<Schedule> usual_schedules (
    Nanoseconds switching, Nanoseconds readout);

/** The one with the highest PSNR of those that are not overexposed and reach
 * @p min_rate subframes/s; null if there is none. */
const Prediction *recommend (
    std::span<const Prediction> predictions, double min_rate);

} // namespace codedexposure
