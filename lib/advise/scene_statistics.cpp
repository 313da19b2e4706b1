/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "advise/scene_statistics.h"

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "base/range.h"
#include "stats/matern.h"

namespace cexp
{

Result<void>
SceneStatistics::check () const
{
  return check_ranges ({
      {"level", level, 0.001, 1.0},
      {"contrast", contrast, 0.001, 1.0},
      {"detail (pixels)", detail, 0.1, 1000.0},
      {"speed (pixels/s)", speed, 0.0, 1e6},
  });
}

double
texture_correlation (const SceneStatistics &scene, double distance)
{
  return matern_3_2 (std::numbers::sqrt3 * distance / scene.detail);
}

std::vector<TimeStep>
time_steps (double first_length, double second_length, int samples)
{
  const auto time = [samples] (double length, int i) {
    return length * ((i + 0.5) / samples - 0.5);
  };
  std::map<long, TimeStep> merged; // by whole ns
  for (int i = 0; i < samples; i++)
    for (int j = 0; j < samples; j++) {
      const double seconds = time (second_length, j) - time (first_length, i);
      TimeStep &step = merged[std::lround (seconds * 1e9)];
      step.seconds = seconds;
      step.part += 1.0 / (samples * samples);
    }
  std::vector<TimeStep> steps;
  for (const auto &[ns, step] : merged)
    steps.push_back (step);
  return steps;
}

double
light_covariance (const SceneStatistics &scene, double dx, double dy,
    double between, const std::vector<TimeStep> &steps)
{
  constexpr int kDirections = 24;
  static const auto kCircle = [] {
    std::array<std::pair<double, double>, kDirections> circle;
    for (int d = 0; d < kDirections; d++) {
      const double turn = 2.0 * std::numbers::pi * (d + 0.5) / kDirections;
      circle[std::size_t (d)] = {std::cos (turn), std::sin (turn)};
    }
    return circle;
  }();
  double mean = 0.0;
  for (const auto &[seconds, part] : steps) {
    const double path = scene.speed * (between + seconds);
    for (const auto &[x, y] : kCircle)
      mean += part / kDirections *
              texture_correlation (
                  scene, std::hypot (dx - path * x, dy - path * y));
  }
  return scene.contrast * scene.contrast * mean;
}

} // namespace cexp
