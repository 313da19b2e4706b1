/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What Rectifier::correct () takes off; for this folder only. */
#pragma once

#include <algorithm>
#include <cstdint>

#include "base/image.h"

namespace codedexposure::rectify
{

/** The largest value of light of 16 bits. */
constexpr float kWideWhite = 65535.0f;

/** @p expected in units of which kWideWhite are as much as @p largest of
 * @p mirrors, by the ratio of least squares. */
template <typename Pixel>
Image<std::uint16_t>
scaled_light (ImageView<const std::uint16_t> expected,
    ImageView<const Pixel> mirrors, int largest)
{
  double products = 0.0, squares = 0.0;
  for (int y = 0; y < expected.height; y++) {
    const std::uint16_t *light = expected.row (y);
    const Pixel *made = mirrors.row (y);
    float of_row = 0.0f, squares_of_row = 0.0f;
    for (int x = 0; x < expected.width; x++) {
      const float known = made[x] < largest ? float (light[x]) : 0.0f;
      of_row += known * float (made[x]);
      squares_of_row += known * known;
    }
    products += double (of_row);
    squares += double (squares_of_row);
  }
  const float scale =
      squares > 0.0 ? float (products / squares) * kWideWhite / float (largest)
                    : 0.0f;
  Image<std::uint16_t> scaled (expected.width, expected.height);
  for (int y = 0; y < expected.height; y++)
    for (int x = 0; x < expected.width; x++)
      scaled.view ().row (y)[x] = std::uint16_t (
          std::min (float (expected.row (y)[x]) * scale + 0.5f, kWideWhite));
  return scaled;
}

/** Takes what @p made is more than @p truth off a @p row, but for @p ends
 * mirrors at each end; what is saturated stays so, and nothing else gets it.
 * @p largest  of the row; kWideWhite is as much. */
template <typename Pixel>
void
take_off (const std::uint16_t *made, const std::uint16_t *truth, int count,
    int ends, int largest, Pixel *row)
{
  const float scale = float (largest) / kWideWhite;
  for (int x = ends; x < count - ends; x++) {
    const float better = std::clamp (
        float (row[x]) - float (int (made[x]) - int (truth[x])) * scale, 0.0f,
        float (largest - 1));
    row[x] = row[x] < largest ? Pixel (better + 0.5f) : row[x];
  }
}

} // namespace codedexposure::rectify
