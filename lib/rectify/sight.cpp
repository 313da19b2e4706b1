/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "rectify/sight.h"

#include <algorithm>
#include <cmath>

namespace codedexposure
{

using rectify::kNoises, rectify::Place, rectify::row_length;

namespace
{

constexpr int kWindows[] = {5, 7, 9};
constexpr int kParts = 32; // of a mirror

} // namespace

Sight::Sight (int taps, Extent camera)
    : taps_ (taps), places_ (camera.width, camera.height)
{
}

/* The kernels have room for filters for several amounts of noise, and here take
 * the first. */
void
Sight::add_filters (const WeightSolver &solver)
{
  const int length = row_length (taps_), half = taps_ / 2;
  const auto of_filter = std::size_t (kNoises * taps_ * length);
  weights_.assign (kParts * kParts * of_filter, 0.0f);
  for (int part = 0; part < kParts * kParts; part++) {
    const auto middle = [] (int i) { return (i + 0.5) / kParts - 0.5; };
    const double fx = middle (part % kParts), fy = middle (part / kParts);
    float *weights = weights_.data () + std::size_t (part) * of_filter;
    double sum = 0.0;
    for (int y = 0; y < taps_; y++)
      for (int x = 0; x < taps_; x++)
        sum += solver.share (fx + half - x, fy + half - y);
    for (int y = 0; y < taps_; y++)
      for (int x = 0; x < taps_; x++)
        weights[y * length + x] =
            float (solver.share (fx + half - x, fy + half - y) / sum);
  }
}

Place
Sight::place (Position at, Extent mirrors) const
{
  const double left = std::floor (at.x + 0.5) - taps_ / 2;
  const double top = std::floor (at.y + 0.5) - taps_ / 2;
  /* NaN must count as outside, too. */
  if (!(left >= 0.0 && left <= mirrors.width - taps_ && top >= 0.0 &&
          top <= mirrors.height - taps_))
    return {};
  const auto part_of = [] (double along) {
    return std::clamp (
        int ((along + 0.5 - std::floor (along + 0.5)) * kParts), 0, kParts - 1);
  };
  return {std::int16_t (left), std::int16_t (top),
      part_of (at.y) * kParts + part_of (at.x)};
}

std::optional<Sight>
Sight::make (const Mapping &mapping, const WeightSolver &solver)
{
  for (const int taps : kWindows) {
    const double beyond = taps / 2 + 0.5;
    if (solver.share (beyond, 0.0) > 0.0 || solver.share (0.0, beyond) > 0.0)
      continue;
    Sight sight (taps, mapping.camera ());
    sight.add_filters (solver);
    for (int y = 0; y < sight.places_.height (); y++)
      for (int x = 0; x < sight.places_.width (); x++)
        sight.places_.at (x, y) =
            sight.place (mapping.mirror_at (x, y), mapping.mirrors ());
    return sight;
  }
  return std::nullopt;
}

void
Sight::run (const rectify::Kernels &kernels,
    ImageView<const std::uint16_t> light, ImageView<std::uint16_t> camera,
    Workers &workers) const
{
  const rectify::Filters with{
      weights_.data (), nullptr, nullptr, {}, 1.0f, 65535.0f};
  const rectify::Source<std::uint16_t> source{
      light.row (0), light.stride, light.width};
  workers.run (camera.height, [&] (int y, int) {
    const Place *places = places_.view ().row (y);
    std::vector<Place> inside (places, places + camera.width);
    for (Place &place : inside)
      if (place.y + taps_ > light.height)
        place = {};
    kernels.words[(taps_ - kWindows[0]) / 2](
        source, inside.data (), camera.width, with, camera.row (y), nullptr);
  });
}

} // namespace codedexposure
