/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The kernels of extraction: the interface between the plan and the files that
 * are compiled once per instruction set. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace codedexposure
{

/**
 * Rows of cells of @p width by @p height pixels: pixel (x, y) of cell (i, j) is
 * in column i width + x of row j height + y; rows are @p stride bytes apart.
 * There are at least as many cells in a row as a vector has lanes.
 */
template <typename Pixel>
struct Block {
  const Pixel *pixels;
  std::ptrdiff_t stride;
  int width;
  int height;
  int cells; ///< in a row
  int rows;
};

/**
 * Rows of the subframes that take a block: row j of subframe k starts @p stride
 * bytes times j after rows[k].
 */
template <typename Pixel>
struct Planes {
  Pixel *const *rows;
  std::ptrdiff_t stride;
  /** Use non-temporal stores; all rows start with a line of the cache. */
  bool stream = false;
};

/**
 * Where the elements stand. In cell (i, j) of the block element e is at place,
 * counted by rows of the cell,
 *   place[((j + row) % rows * n + e) * repeat + (i + column) % repeat].
 */
template <typename Pixel>
struct Layout {
  const std::uint8_t *place;
  int n;
  int repeat, rows;
  int column, row;
  /** repeat + lanes pixels, all ones where the index is a multiple of repeat
   * and 0 elsewhere. */
  const Pixel *comb;
  /** Every element is at the place of its own number. */
  bool identity;
  /** With repeat = 1 the other way round: at place p of row j of the block is
   * element [(j + row) % rows * n + p]. */
  const std::uint8_t *element;
};

/** One element along a row of cells, and how to bring it to the centre of the
 * cell: here [i] with the cell @p step (-1, 0 or 1) beside it, and the same two
 * of the cell above or below it, at there. */
template <typename Pixel>
struct ElementRow {
  const Pixel *here;
  const Pixel *there;
  short here_near, here_far, there_near, there_far; ///< weights
  int step;
};

struct Linear;

/**
 * The kernels of one instruction set. None checks its arguments, allocates or
 * writes beyond the cells it was given; none reads beyond them either. Rows
 * need no alignment.
 */
template <typename Pixel>
struct Kernels {
  /** Cells in a vector: rows of fewer cells need a narrower instruction set. */
  int lanes;

  /* These return the largest pixel of the block. Vectors at the end of a row
   * are moved back to end with it. */

  /** Row e of the planes = element e. */
  Pixel (*select) (const Block<Pixel> &block, const Layout<Pixel> &layout,
      const Planes<Pixel> &to);

  /** Row k of the planes = k-th smallest pixel of each cell. */
  Pixel (*rank) (const Block<Pixel> &block, const Layout<Pixel> &layout,
      const Planes<Pixel> &to);

  /** Row s of the planes = the light of slot s. */
  Pixel (*decode) (const Block<Pixel> &block, const Layout<Pixel> &layout,
      const Linear &linear, const Planes<Pixel> &to);

  /** out[s][i] = the light of slot s from interpolated elements. */
  void (*decode_row) (const ElementRow<Pixel> *elements, const Linear &linear,
      int cells, Pixel *const *out);

  /** Pixels that are not below @p largest. */
  std::uint64_t (*count) (const Pixel *row, int pixels, Pixel largest);
};

/** The kernels of one instruction set, for both types of pixels. */
struct Target {
  std::string_view name;
  Kernels<std::uint8_t> u8;
  Kernels<std::uint16_t> u16;

  template <typename Pixel>
  const Kernels<Pixel> &kernels () const
  {
    if constexpr (sizeof (Pixel) == 1)
      return u8;
    else
      return u16;
  }
};

/** Those that this processor can run, widest first; found out once. None on a
 * processor without SSE4.1. */
std::span<const Target> supported_targets ();

} // namespace codedexposure
