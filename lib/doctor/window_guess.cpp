/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/window_guess.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace codedexposure
{

namespace
{

/** @p window with the gain and the offset that explain runs of one exposure
 * best. */
LightModel
with_best_gain (
    std::span<const LightSample> samples, int exposure, LightModel window)
{
  window.gain = 1.0;
  window.offsets.assign (window.lengths.size (), 0.0);
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (const LightSample &sample : samples) {
    if (sample.exposure != exposure)
      continue;
    const double seconds = window.light (sample);
    n += 1.0;
    x += seconds;
    y += sample.light;
    xx += seconds * seconds;
    xy += seconds * sample.light;
  }
  const double spread = n * xx - x * x;
  window.gain =
      spread > 1e-12 * n * xx ? std::max (0.0, (n * xy - x * y) / spread) : 0;
  window.offsets.assign (window.lengths.size (), (y - window.gain * x) / n);
  return window;
}

/** Squares that @p model does not explain, of runs of one exposure. */
double
misfit (
    std::span<const LightSample> samples, int exposure, const LightModel &model)
{
  double squares = 0.0;
  for (const LightSample &sample : samples)
    if (sample.exposure == exposure)
      squares += std::pow (sample.light - model.light (sample), 2);
  return squares;
}

/** The mean of what is seen in exposure 1 beyond @p model. */
double
mean_beyond (std::span<const LightSample> samples, const LightModel &model)
{
  double sum = 0.0, count = 0.0;
  for (const LightSample &sample : samples)
    if (sample.exposure == 1) {
      sum += sample.light - model.light (sample);
      count += 1.0;
    }
  return sum / std::max (1.0, count);
}

} // namespace

LightModel
guess_window (std::span<const LightSample> samples, double period)
{
  constexpr int kSteps = 96;
  LightModel best;
  double least = -1.0;
  for (int length = kSteps / 8; length < kSteps; length++)
    for (int start = 0; start < kSteps; start++) {
      LightModel window = with_best_gain (samples, 0,
          {.period = period,
              .start = period * start / kSteps,
              .lengths = {period * length / kSteps}});
      const double squares = misfit (samples, 0, window);
      if (least < 0.0 || squares < least) {
        least = squares;
        best = std::move (window);
      }
    }
  return best;
}

double
guess_length (std::span<const LightSample> samples, LightModel model)
{
  constexpr int kSteps = 200;
  double best = 0.0, least = -1.0;
  model.lengths.push_back (0.0);
  model.offsets.push_back (0.0);
  for (int step = 1; step <= kSteps; step++) {
    model.lengths[1] = 1.5 * model.period * step / kSteps;
    const double low = model.offsets[0];
    const double high =
        std::max (0.0, low) * model.lengths[1] / model.lengths[0];
    model.offsets[1] = 0.0;
    model.offsets[1] = std::clamp (mean_beyond (samples, model),
        std::min (low, high), std::max (low, high));
    const double squares = misfit (samples, 1, model);
    if (least < 0.0 || squares < least) {
      least = squares;
      best = model.lengths[1];
    }
  }
  return best;
}

} // namespace codedexposure
