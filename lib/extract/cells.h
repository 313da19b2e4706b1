/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Work on cells that are small enough to be held in registers. */
#pragma once

#include "extract/split.h"

namespace cexp::CEXP_TARGET
{

/**
 * For every vector of cells: work (wires, put), where wires [y Width + x] are
 * pixels (x, y) and put (k, vector) writes a vector of subframe k. Returns the
 * largest pixel.
 */
template <typename Work, int Width, int Height, typename T>
T
run_in_registers (const Block<T> &block, const Planes<T> &to, Work work)
{
  constexpr int kN = Width * Height;
  Vector<T> most = {};
  T *out[kN];
  for (int j = 0; j < block.rows; j++) {
    const T *row =
        bytes_on (block.pixels, std::ptrdiff_t (j) * Height * block.stride);
    for (int k = 0; k < kN; k++)
      out[k] = bytes_on (to.rows[k], j * to.stride);
    for_strips<T> (block.cells, out[0], to.stream,
        [&] (int at, auto put) CEXP_INLINE_BODY {
          Vector<T> wires[kN];
#pragma GCC unroll 16
          for (int y = 0; y < Height; y++) {
            const T *from = bytes_on (row, y * block.stride) + at * Width;
            prefetch (
                bytes_on (from, Height * block.stride), Width * kVectorBytes);
            Vector<T> parts[Width];
            split_cells<Width, T> (from, parts);
#pragma GCC unroll 16
            for (int x = 0; x < Width; x++) {
              wires[y * Width + x] = parts[x];
              most = larger (most, parts[x]);
            }
          }
          work (wires, [&] (int k, Vector<T> v)
                           CEXP_INLINE_BODY { put (out[k] + at, v); });
        });
  }
  return largest_lane<T> (most);
}

template <typename Work, typename T>
using InRegisters = T (*) (const Block<T> &, const Planes<T> &, Work);

/** The squarest cells of 2 to 16 pixels, for which Work is compiled; null for
 * others. */
template <typename Work, typename T>
InRegisters<Work, T>
in_registers (int width, int height)
{
  struct Own {
    int width, height;
    InRegisters<Work, T> run;
  };
  static constexpr Own kOwn[] = {
      {2, 1, run_in_registers<Work, 2, 1, T>},
      {3, 1, run_in_registers<Work, 3, 1, T>},
      {2, 2, run_in_registers<Work, 2, 2, T>},
      {5, 1, run_in_registers<Work, 5, 1, T>},
      {3, 2, run_in_registers<Work, 3, 2, T>},
      {7, 1, run_in_registers<Work, 7, 1, T>},
      {4, 2, run_in_registers<Work, 4, 2, T>},
      {3, 3, run_in_registers<Work, 3, 3, T>},
      {5, 2, run_in_registers<Work, 5, 2, T>},
      {4, 3, run_in_registers<Work, 4, 3, T>},
      {5, 3, run_in_registers<Work, 5, 3, T>},
      {4, 4, run_in_registers<Work, 4, 4, T>},
  };
  for (const Own &own : kOwn)
    if (own.width == width && own.height == height)
      return own.run;
  return nullptr;
}

} // namespace cexp::CEXP_TARGET
