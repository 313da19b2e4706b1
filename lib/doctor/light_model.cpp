/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/light_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace codedexposure
{

double
LightLine::depth () const
{
  return std::hypot (cosine, sine);
}

double
LightModel::seconds_of (double from, double until) const
{
  const double half = 0.5 * (until - from), middle = from + half;
  double even = 1.0 + drift * middle;
  for (const LightLine &line : lines) {
    const double turn = 2.0 * std::numbers::pi * line.frequency;
    const double damp =
        turn * half > 1e-9 ? std::sin (turn * half) / (turn * half) : 1.0;
    even += damp * (line.cosine * std::cos (turn * middle) +
                       line.sine * std::sin (turn * middle));
  }
  return 2.0 * half * even;
}

double
LightModel::light (const LightSample &sample) const
{
  const auto exposure = std::size_t (sample.exposure);
  double seconds = 0.0;
  each_lit_time (*this, sample, [&] (double from, double until) {
    seconds += seconds_of (sample.time + from, sample.time + until);
  });
  if (leak > 0.0) {
    const double begin = sample.time + start, length = lengths[exposure];
    seconds += leak * (seconds_of (begin, begin + length) - length);
  }
  return offsets[exposure] + gain * seconds;
}

double
LightModel::match (
    std::span<const LightSample> samples, std::span<const double> weights)
{
  gain = 1.0;
  offsets.assign (lengths.size (), 0.0);
  struct Sums {
    double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  };
  std::vector<Sums> sums (offsets.size ());
  std::vector<double> seconds;
  for (std::size_t i = 0; i < samples.size (); i++) {
    const double x = light (samples[i]), y = samples[i].light;
    seconds.push_back (x);
    if (!weights.empty () && weights[i] == 0.0)
      continue;
    Sums &sum = sums[std::size_t (samples[i].exposure)];
    sum.n += 1.0;
    sum.x += x;
    sum.y += y;
    sum.xx += x * x;
    sum.xy += x * y;
  }
  double xx = 0.0, xy = 0.0;
  for (const Sums &sum : sums) {
    const double n = std::max (sum.n, 1.0);
    xx += sum.xx - sum.x * sum.x / n;
    xy += sum.xy - sum.x * sum.y / n;
  }
  gain = xx > 0.0 && xy > 0.0 ? xy / xx : 1.0;
  for (std::size_t e = 0; e < sums.size (); e++)
    offsets[e] = (sums[e].y - gain * sums[e].x) / std::max (sums[e].n, 1.0);
  double squares = 0.0;
  for (std::size_t i = 0; i < samples.size (); i++) {
    const double rest = samples[i].light - gain * seconds[i] -
                        offsets[std::size_t (samples[i].exposure)];
    squares += std::pow ((weights.empty () ? 1.0 : weights[i]) * rest, 2);
  }
  return squares;
}

LightModel
guess_window (std::span<const LightSample> samples, double period)
{
  constexpr int kSteps = 96;
  LightModel best;
  double least = -1.0;
  for (int length = kSteps / 8; length < kSteps; length++)
    for (int start = 0; start < kSteps; start++) {
      LightModel window{.period = period,
          .start = period * start / kSteps,
          .lengths = {period * length / kSteps}};
      const double squares = window.match (samples);
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
    std::vector<double> rests; // what is seen in exposure 1 beyond the model
    double mean = 0.0, squares = 0.0;
    for (const LightSample &sample : samples)
      if (sample.exposure == 1) {
        rests.push_back (sample.light - model.light (sample));
        mean += rests.back ();
      }
    mean /= std::max (1.0, double (rests.size ()));
    const double offset =
        std::clamp (mean, std::min (low, high), std::max (low, high));
    for (const double rest : rests)
      squares += std::pow (rest - offset, 2);
    if (least < 0.0 || squares < least) {
      least = squares;
      best = model.lengths[1];
    }
  }
  return best;
}

} // namespace codedexposure
