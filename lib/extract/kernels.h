/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What an instruction set offers to extraction: the border between the plan
 * and the files that are compiled once per instruction set. */
#pragma once

#include <cstddef>
#include <cstdint>

namespace cexp
{

/** How the cells of a row are cut into vectors. */
struct Strips {
  /** At least one vector's worth; the last vector is moved back to end with
   * the row. */
  int cells = 0;
  /** Past the caches: from cell @p lead on, which has to be aligned to a vector
   * in every plane. */
  bool stream = false;
  int lead = 0;
};

/** Cells of @p width by @p height pixels: pixel (x, y) of cell i is
 * row y [i width + x], rows @p stride bytes apart. */
template <typename Pixel>
struct Cells {
  const Pixel *pixels;
  std::ptrdiff_t stride;
  int width;
  int height;
};

/** Whole-number weights of a sample and of its neighbour. */
struct Weights {
  int near = 1;
  int far = 0;
};

/** One element along a row of cells, and how to bring it to the centre of the
 * cell: here [i] with the cell @p step (-1, 0 or 1) beside it, and the same two
 * of the cell above or below it, at there. */
template <typename Pixel>
struct ElementRow {
  const Pixel *here;
  const Pixel *there;
  Weights x, y;
  int step;
};

/** A sum of elements; see Decoder. */
struct TermList {
  const int *elements;
  const double *factors;
  int size;
};

/**
 * The kernels of one instruction set. None checks its arguments, allocates or
 * writes beyond the cells it was given; none reads beyond them either. Rows
 * need no alignment.
 */
template <typename Pixel>
struct Kernels {
  /** Cells in a vector: rows of fewer cells need a narrower instruction set. */
  int lanes;

  /** out[x][i] = pixel x of cell i, cells one row high. Returns the largest
   * pixel. */
  Pixel (*split) (
      const Pixel *row, int width, Pixel *const *out, const Strips &strips);

  /** out[k][i] = k-th smallest pixel of cell i. Returns the largest pixel. */
  Pixel (*rank) (
      const Cells<Pixel> &cells, Pixel *const *out, const Strips &strips);

  /**
   * out[e][i] = places[place[e repeat + (i + phase) mod repeat]][i], e < n.
   * @p comb  repeat + lanes pixels, all ones where the index is a multiple of
   *          repeat, else 0.
   */
  void (*relabel) (const Pixel *const *places, const std::uint8_t *place, int n,
      int repeat, int phase, const Pixel *comb, Pixel *const *out,
      const Strips &strips);

  /** out[k][i] = gain (elements[k][i] - elements[k - 1][i]) clamped to
   * 0..largest, n rows of @p cells; gain in 1..256. */
  void (*difference) (const Pixel *const *elements, int n, int cells, int gain,
      Pixel largest, Pixel *const *out);

  /** The same of interpolated elements, a quarter of the difference rounded to
   * nearest; cells at most kMaxRowCells. */
  void (*lerp_difference) (const ElementRow<Pixel> *elements, int n, int cells,
      Pixel largest, Pixel *const *out);

  /** out[s][i] = terms[s] over the elements, rounded and clamped. */
  void (*decode) (const ElementRow<Pixel> *elements, const TermList *terms,
      int n, int cells, Pixel largest, Pixel *const *out);

  /** Pixels that are not below @p largest. */
  std::uint64_t (*count) (const Pixel *row, int pixels, Pixel largest);

  /** Makes streamed stores visible to the threads that are told of them. */
  void (*fence) ();
};

/** Bound on the cells of one call of lerp_difference. */
constexpr int kMaxRowCells = 4096;

} // namespace cexp
