/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Mean levels of a coded frame, which depend on the phase of the masks. */
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/image.h"
#include "schedule/pilot.h"
#include "schedule/schedule.h"

namespace codedexposure
{

/** Means over pixels, in digital numbers above the black level. */
struct Levels {
  std::vector<double> elements;              ///< of each element of the code
  std::array<double, kPilotColumns> pilot{}; ///< of the pilot's columns
};

/**
 * Measures the levels of frames of one size, from rows that contain every row
 * of the tile equally often: about 64 rows of the code and 16 of the pilot,
 * spread over the frame.
 */
class LevelMeter
{
public:
  /** @p black  digital number without light. */
  LevelMeter (
      const Schedule &schedule, int width, int height, double black = 0.0);

  /** Whether the frame is large enough to hold every element, and the pilot
   * where there is one. */
  bool complete () const { return complete_; }

  /** @p frame  of that size. The result is valid until the next call. */
  template <typename Pixel>
  const Levels &measure (ImageView<const Pixel> frame);

private:
  int width_;
  double black_;
  int tile_rows_;            // period of the tile in y
  int tile_columns_;         // and in x
  std::vector<int> element_; // of each pixel of the tile
  std::vector<int> blocks_;  // first rows of the tiles that are measured
  std::vector<int> pilot_rows_;
  std::vector<double> pixels_; // of each element, in what is measured
  bool complete_;

  std::vector<std::uint32_t> column_sums_;
  Levels levels_;
};

} // namespace codedexposure
