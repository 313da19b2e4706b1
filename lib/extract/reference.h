/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Extraction pixel by pixel: slow and readable. The kernels must equal it bit
 * for bit. */
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "base/image.h"
#include "extract/covered_cells.h"
#include "extract/decoder.h"
#include "extract/group_sort.h"
#include "extract/linear.h"
#include "schedule/sample_grid.h"

namespace codedexposure
{

/** The pixels of elements, found through the grid. */
template <typename Pixel>
struct Samples {
  ImageView<const Pixel> coded;
  const SampleGrid &grid;

  Pixel at (int element, int i, int j) const
  {
    const Offset d = grid.offset (element, i, j);
    const Extent cell = grid.cell ();
    return coded.at (i * cell.width + d.x, j * cell.height + d.y);
  }
};

/** The value of an element in cell (@p i, @p j), without looking at @p covered
 * cells. */
template <typename Pixel>
int
element_value (const Samples<Pixel> &samples, const Decoder &decoder,
    Extent size, const CoveredCells &covered, int element, int i, int j)
{
  const Offset offset = samples.grid.offset (element, i, j);
  const Lerp x = decoder.lerp_x (offset);
  const Lerp y = decoder.lerp_y (offset);
  const int xi = std::clamp (i + x.step, 0, size.width - 1);
  const int yj = std::clamp (j + y.step, 0, size.height - 1);
  const bool has_x = !covered.at (xi, j), has_y = !covered.at (i, yj);
  const int here = samples.at (element, i, j);
  const int beside_x = has_x ? samples.at (element, xi, j) : here;
  const int beside_y = has_y ? samples.at (element, i, yj) : here;
  const int across = has_x && has_y && !covered.at (xi, yj)
                         ? samples.at (element, xi, yj)
                         : beside_x + beside_y - here;
  return x.near * (y.near * here + y.far * beside_y) +
         x.far * (y.near * beside_x + y.far * across);
}

/* In all of these: @p coded is the coded frame, @p subframes are the n
 * subframes in exposure order. Pixel is std::uint8_t or std::uint16_t. */

/** Subframe k = k-th smallest of the group, by the paper's group_sort (). */
template <typename Pixel>
void
reference_rank (ImageView<const Pixel> coded, const SampleGrid &grid,
    std::span<const ImageView<Pixel>> subframes)
{
  const Samples<Pixel> samples{coded, grid};
  const int n = grid.elements ();
  std::array<Pixel, Tile::kMaxElements> group;

  for (int j = 0; j < subframes[0].height; j++) {
    for (int i = 0; i < subframes[0].width; i++) {
      for (int e = 0; e < n; e++)
        group[std::size_t (e)] = samples.at (e, i, j);
      group_sort (std::span (group).first (std::size_t (n)));
      for (int k = 0; k < n; k++)
        subframes[std::size_t (k)].at (i, j) = group[std::size_t (k)];
    }
  }
}

/** Subframe k = element @p elements[k]. */
template <typename Pixel>
void
reference_select (ImageView<const Pixel> coded, const SampleGrid &grid,
    std::span<const int> elements, std::span<const ImageView<Pixel>> subframes)
{
  const Samples<Pixel> samples{coded, grid};
  for (std::size_t k = 0; k < subframes.size (); k++)
    for (int j = 0; j < subframes[k].height; j++)
      for (int i = 0; i < subframes[k].width; i++)
        subframes[k].at (i, j) = samples.at (elements[k], i, j);
}

/** Pixel @p cell of subframe k = light of slot k by @p linear, without looking
 * at @p covered cells: a missing sample is the one beside it, as at the edge of
 * the frame, and where that one is known on both sides, in the plane through
 * all three. */
template <typename Pixel>
void
reference_decode (ImageView<const Pixel> coded, const SampleGrid &grid,
    const Decoder &decoder, const Linear &linear, const CoveredCells &covered,
    Offset cell, std::span<const ImageView<Pixel>> subframes)
{
  const Samples<Pixel> samples{coded, grid};
  const Extent size = {subframes[0].width, subframes[0].height};
  const auto [i, j] = cell;
  std::array<int, Tile::kMaxElements> values;
  for (int e = 0; e < grid.elements (); e++)
    values[std::size_t (e)] =
        element_value (samples, decoder, size, covered, e, i, j);
  for (int s = 0; s < decoder.slots (); s++)
    subframes[std::size_t (s)].at (i, j) =
        Pixel (linear.pixel (s, values.data ()));
}

/** Pixels of the @p rows of cells that are not below @p largest. */
template <typename Pixel>
std::uint64_t
reference_saturated (
    ImageView<const Pixel> coded, const SampleGrid &grid, int largest, int rows)
{
  const Extent cell = grid.cell ();
  const int width = coded.width / cell.width * cell.width;
  std::uint64_t count = 0;
  for (int y = 0; y < rows * cell.height; y++) {
    const Pixel *row = coded.row (y);
    count += std::uint64_t (std::count_if (row, row + width,
        [largest] (Pixel pixel) { return pixel >= largest; }));
  }
  return count;
}

} // namespace codedexposure
