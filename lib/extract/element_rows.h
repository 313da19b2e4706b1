/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Rows of cells cut into vectors, and taken apart into a row per element. */
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/image.h"
#include "extract/targets.h"
#include "schedule/sample_grid.h"

namespace cexp
{

/** A row of pixels for each element or rank. */
template <typename Pixel>
using RowPointers = std::array<Pixel *, Tile::kMaxElements>;

/** @p rows moved on by @p cells. */
template <typename Pixel>
RowPointers<Pixel>
moved (const RowPointers<Pixel> &rows, int n, int cells)
{
  RowPointers<Pixel> result;
  for (int k = 0; k < n; k++)
    result[std::size_t (k)] = rows[std::size_t (k)] + cells;
  return result;
}

/**
 * Calls @p body (kernels, first, count) for parts that cover @p cells cells:
 * the widest vectors as far as they are well filled, narrower ones for the
 * rest. Parts may overlap. @p cells is at least the lanes of the last target.
 */
template <typename Pixel, typename Body>
void
for_segments (std::span<const Target> targets, int cells, Body body)
{
  const int narrowest = targets.back ().kernels<Pixel> ().lanes;
  int at = 0;
  for (const Target &target : targets) {
    const Kernels<Pixel> &kernels = target.kernels<Pixel> ();
    const int lanes = kernels.lanes;
    if (at == cells)
      return;
    if (cells < lanes)
      continue;
    const int left_over = (cells - at) % lanes;
    const bool to_the_end =
        lanes == narrowest || left_over == 0 || left_over > lanes / 2;
    const int end = to_the_end ? cells : cells - left_over;
    if (end == at)
      continue;
    const int first = std::min (at, end - lanes);
    body (kernels, first, end - first);
    at = end;
  }
}

/**
 * How the cells of one call are cut; past the caches where @p large and all
 * rows meet the vector's alignment at the same cell.
 */
template <typename Pixel>
Strips
strips_for (const Kernels<Pixel> &kernels, int cells, bool large,
    Pixel *const *rows, int n)
{
  /* Narrower stores leave lines half written, which memory punishes. */
  constexpr std::uintptr_t kLine = 64;
  const int bytes = kernels.lanes * int (sizeof (Pixel));
  Strips strips = {.cells = cells};
  if (!large || bytes < int (kLine))
    return strips;
  const auto address = [rows] (int k) {
    return reinterpret_cast<std::uintptr_t> (rows[k]);
  };
  for (int k = 1; k < n; k++)
    if ((address (k) ^ address (0)) % kLine != 0)
      return strips;
  const auto bytes_to_line = (kLine - address (0) % kLine) % kLine;
  strips.lead = int (bytes_to_line / sizeof (Pixel));
  strips.stream = strips.lead + kernels.lanes <= cells;
  if (!strips.stream)
    strips.lead = 0;
  return strips;
}

/** Rows of elements by the kernels, for any tile. Shared by threads. */
template <typename Pixel>
class ElementRows
{
public:
  /** @p targets  not empty, widest first. */
  ElementRows (const SampleGrid &grid, std::span<const Target> targets);

  /**
   * rows[e][i] = pixel of element e in cell (@p first + i, @p j), i < @p count.
   * @p count  at least the lanes of the last target.
   * @p large  write past the caches where possible.
   * Returns the largest pixel of these cells.
   */
  Pixel gather (ImageView<const Pixel> coded, int j, int first, int count,
      const RowPointers<Pixel> &rows, bool large) const;

private:
  Pixel split (ImageView<const Pixel> coded, int j, int first, int count,
      const RowPointers<Pixel> &places, bool large) const;
  Pixel split_and_relabel (ImageView<const Pixel> coded, int j, int first,
      int count, const RowPointers<Pixel> &rows, bool large) const;
  const std::uint8_t *places_of_row (int j) const
  {
    return places_.data () +
           std::size_t (j % repeat_.height * n_ * repeat_.width);
  }

  std::span<const Target> targets_;
  int n_;
  Extent cell_;
  Extent repeat_;
  /** Place in the cell, by rows, of each element in each of the repeat_.width
   * cells after which places repeat, for each of repeat_.height rows. */
  std::vector<std::uint8_t> places_;
  /** For Kernels::relabel. */
  std::vector<Pixel> comb_;
};

} // namespace cexp
