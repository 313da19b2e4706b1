/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the light of frames says of the exposure and of the lamp. */
#pragma once

#include <span>

#include "doctor/light_model.h"

namespace codedexposure
{

/** A model and how well it is known. */
struct LightFit {
  LightModel model = {};
  double epoch = 0.0; ///< of the model, in times of the samples
  Measured drift = {}, start = {};
  std::vector<Measured> lengths = {};
  struct Line {
    Measured frequency, depth;
  };
  std::vector<Line> lines = {}; ///< the strongest first
  double faintest = 0.0;        ///< depth of a line that would not be seen
  /** Of the trigger to the exposure, from frame to frame: standard deviation,
   * s. */
  Measured jitter = {};
  /** Which part of the changes of the light a frequency explains, before any
   * line was taken away: the largest in each of some stretches. */
  std::vector<Position> spectrum = {};
};

/**
 * Fits by least squares over all samples: for runs that the exposure cuts,
 * light is lost; lines show in runs at different times of the cycle, because
 * the frames alone see each frequency as one below half of their rate. Lines
 * are those of 0.15 to 1200 Hz, two at most.
 *
 * @p guess  period; start and lengths to a tenth of a period. gain, drift,
 *           offsets and lines are not read.
 */
LightFit fit_light (
    std::span<const LightSample> samples, const LightModel &guess);

} // namespace codedexposure
