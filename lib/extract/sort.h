/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Many groups sorted side by side: wire k holds pixel k of as many groups as a
 * vector has lanes, and a network sorts them without a branch. */
#pragma once

#include "base/vector.h"
#include "extract/kernels.h"
#include "extract/network.h"
#include "extract/select.h"
#include "extract/split.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

/** Networks up to here are compiled as straight lines: few enough wires for
 * most values to stay in registers. */
constexpr int kStraight = 16;

struct Comparators {
  int low[64] = {}, high[64] = {};
  int size = 0;

  constexpr explicit Comparators (int n)
  {
    merge_exchange (n, [this] (int a, int b) {
      low[size] = a;
      high[size++] = b;
    });
  }
};

template <int N>
constexpr Comparators kComparators{N};

template <typename V>
CODEDEXPOSURE_INLINE void
compare (V &low, V &high)
{
  const V a = low;
  low = smaller (a, high);
  high = larger (a, high);
}

template <int N, typename V, int... I>
CODEDEXPOSURE_INLINE void
sort_wires ([[maybe_unused]] V *wires, std::integer_sequence<int, I...>)
{
  (compare (wires[kComparators<N>.low[I]], wires[kComparators<N>.high[I]]),
      ...);
}

/** Kernels::rank for groups of N pixels; N 0: any. */
template <int N, typename T>
T
rank_of (const Block<T> &block, const Layout<T> &layout, const Planes<T> &to)
{
  const int n = N > 0 ? N : layout.n;
  return for_chunks (
      block, layout, to, [&] (const Elements<T> &from, const Planes<T> &out) {
        for (int j = 0; j < from.rows; j++)
          for_strips<kLanes<T>> (from.cells, out.stream,
              [&] (int at, Put put) CODEDEXPOSURE_INLINE_BODY {
                Vector<T> wires[N > 0 ? N : 256];
#pragma GCC unroll 16
                for (int k = 0; k < n; k++)
                  wires[k] =
                      load (from.at + k * from.pitch + j * from.cells + at);
                if constexpr (N > 0)
                  sort_wires<N> (wires,
                      std::make_integer_sequence<int, kComparators<N>.size> ());
                else
                  merge_exchange (
                      n, [&] (int low, int high) CODEDEXPOSURE_INLINE_BODY {
                        compare (wires[low], wires[high]);
                      });
#pragma GCC unroll 16
                for (int k = 0; k < n; k++)
                  put (bytes_on (out.rows[k], j * out.stride) + at, wires[k]);
              });
      });
}

/** Kernels::rank where registers hold cells. */
template <int Width, typename T>
T
rank_squares (
    const Block<T> &block, const Layout<T> &layout, const Planes<T> &to)
{
  constexpr int kN = Width * Width;
  return for_squares<Width, T> (block, layout, to,
      [&] (const auto &parts, auto put) CODEDEXPOSURE_INLINE_BODY {
        Vector<T> wires[kN];
#pragma GCC unroll 16
        for (int p = 0; p < kN; p++)
          wires[p] = parts[p / Width][p % Width];
        sort_wires<kN> (
            wires, std::make_integer_sequence<int, kComparators<kN>.size> ());
#pragma GCC unroll 16
        for (int p = 0; p < kN; p++)
          put (p, wires[p]);
      });
}

template <typename T, int... N>
T
rank_of (const Block<T> &block, const Layout<T> &layout, const Planes<T> &to,
    std::integer_sequence<int, N...>)
{
  static constexpr decltype (&rank_of<0, T>) kAll[] = {&rank_of<N, T>...};
  return kAll[layout.n <= kStraight ? layout.n : 0](block, layout, to);
}

/** Numbers of 0 .. 255. */
struct Identity {
  std::uint8_t at[256] = {};

  constexpr Identity ()
  {
    for (int i = 0; i < 256; i++)
      at[i] = std::uint8_t (i);
  }
};
inline constexpr Identity kIdentity;

/** Kernels::rank: a group is sorted in any order of its pixels. */
template <typename T>
T
rank (const Block<T> &block, const Layout<T> &layout, const Planes<T> &to)
{
  const Layout<T> raster{
      nullptr, layout.n, 1, 1, 0, 0, nullptr, true, kIdentity.at};
  if (const auto run =
          for_square<[]<int Width> () { return &rank_squares<Width, T>; }> (
              block))
    return run (block, raster, to);
  return rank_of (
      block, raster, to, std::make_integer_sequence<int, kStraight + 1> ());
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET
