/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What a camera sees of the light of the mirrors; for this folder only. */
#pragma once

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
      const Mapping &mapping, const WeightSolver &solver);

  /** Mirrors to each side that a pixel sees at most. */
  int reach () const { return taps_ / 2; }
  /** Frame of the mapping's camera, without noise, of @p light, of the first
   * rows of mirrors or of all. Pixels that also see others are 0. */
  void run (const rectify::Kernels &kernels,
      ImageView<const std::uint16_t> light, ImageView<std::uint16_t> camera,
      Workers &workers) const;

private:
  Sight (int taps, Extent camera);
  void add_filters (const WeightSolver &solver);
  rectify::Place place (Position at, Extent mirrors) const;

  int taps_;
  Image<rectify::Place> places_; ///< of each pixel, among the mirrors
  std::vector<float> weights_;   ///< of each part of a mirror
};

} // namespace codedexposure
