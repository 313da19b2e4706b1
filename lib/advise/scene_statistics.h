/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What is taken for granted of a scene before anything is known of it. */
#pragma once

#include <vector>

#include "base/result.h"

namespace cexp
{

/**
 * A texture that moves at a known speed in an unknown direction. Its grey
 * values are a stationary Gaussian process whose correlation at a distance d is
 * Matern's of order 3/2, (1 + q) e^-q with q = sqrt 3 d / detail.
 */
struct SceneStatistics {
  double level = 0.45;    ///< mean, part of white
  double contrast = 0.15; ///< standard deviation, part of white
  double detail = 5.0;    ///< length of the correlation, pixels
  double speed = 100.0;   ///< pixels a second

  /** Error when a number is out of range. */
  Result<void> check () const;
};

/** Correlation of two points of the texture at that distance. */
double texture_correlation (const SceneStatistics &scene, double distance);

/** A difference of two times in seconds, and how much of all differences it
 * stands for. */
struct TimeStep {
  double seconds;
  double part;
};

/**
 * The differences between the times of two stretches with the same middle, each
 * stretch taken at @p samples even times. Covariances made of the same samples
 * are those of a process that can be, so that no error comes out negative.
 */
std::vector<TimeStep> time_steps (
    double first_length, double second_length, int samples);

/** Covariance of what two places (@p dx, @p dy) pixels apart collect in two
 * stretches of time, their middles @p between seconds apart: mean over the
 * steps and over directions of motion. */
double light_covariance (const SceneStatistics &scene, double dx, double dy,
    double between, const std::vector<TimeStep> &steps);

} // namespace cexp
