/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What a camera sees of the light of the mirrors; for this folder only. */
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/image.h"
#include "base/workers.h"
#include "mapping/mapping.h"
#include "rectify/kernels.h"
#include "rectify/weights.h"

namespace codedexposure
{

/** The part of each mirror in each pixel's light, to 1/32 of a mirror. */
class Sight
{
public:
  /** None when pixels see too many mirrors, more than 9 along a side. */
  static std::optional<Sight> make (
      const Mapping &mapping, const WeightSolver &solver)
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

  /** Mirrors to each side that a pixel sees at most. */
  int reach () const { return taps_ / 2; }

  /** Frame of the mapping's camera, without noise, of @p light, of the first
   * rows of mirrors or of all. Pixels that also see others are 0. */
  void run (const rectify::Kernels &kernels,
      ImageView<const std::uint16_t> light, ImageView<std::uint16_t> camera,
      Workers &workers) const
  {
    const rectify::Filters with{
        weights_.data (), nullptr, nullptr, {}, 1.0f, 65535.0f};
    const rectify::Source<std::uint16_t> source{
        light.row (0), light.stride, light.width};
    workers.run (camera.height, [&] (int y, int) {
      const rectify::Place *places = places_.view ().row (y);
      std::vector<rectify::Place> inside (places, places + camera.width);
      for (rectify::Place &place : inside)
        if (place.y + taps_ > light.height)
          place = {};
      kernels.words[(taps_ - kWindows[0]) / 2](
          source, inside.data (), camera.width, with, camera.row (y), nullptr);
    });
  }

private:
  static constexpr int kWindows[] = {5, 7, 9};
  static constexpr int kParts = 32; // of a mirror

  Sight (int taps, Extent camera)
      : taps_ (taps), places_ (camera.width, camera.height)
  {
  }

  /* The kernels have room for filters for several amounts of noise, and here
   * take the first. */
  void add_filters (const WeightSolver &solver)
  {
    const int length = rectify::row_length (taps_), half = taps_ / 2;
    const auto of_filter = std::size_t (rectify::kNoises * taps_ * length);
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

  rectify::Place place (Position at, Extent mirrors) const
  {
    const double left = std::floor (at.x + 0.5) - taps_ / 2;
    const double top = std::floor (at.y + 0.5) - taps_ / 2;
    /* NaN must count as outside, too. */
    if (!(left >= 0.0 && left <= mirrors.width - taps_ && top >= 0.0 &&
            top <= mirrors.height - taps_))
      return {};
    const auto part_of = [] (double along) {
      return std::clamp (
          int ((along + 0.5 - std::floor (along + 0.5)) * kParts), 0,
          kParts - 1);
    };
    return {std::int16_t (left), std::int16_t (top),
        part_of (at.y) * kParts + part_of (at.x)};
  }

  int taps_;
  Image<rectify::Place> places_; ///< of each pixel, among the mirrors
  std::vector<float> weights_;   ///< of each part of a mirror
};

} // namespace codedexposure
