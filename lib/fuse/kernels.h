/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What an instruction set offers to fusion: the border between the plan and
 * the files that are compiled once per instruction set. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace cexp::fuse
{

/**
 * One row through a filter bank whose weights repeat along it: output k at x is
 *
 *   sum over taps t of weights[(t outputs + k) width + (phase + x) mod period]
 *                      * source[x + offsets[t]],
 *
 * summed in the order of the taps, a product rounded before it is added. A row
 * of weights goes on for at least 15 after its period. As many as 15 more
 * pixels than @p count are read and written.
 */
struct FilterRow {
  const float *source;
  int count;
  const std::ptrdiff_t *offsets;
  int taps;
  const float *weights;
  int width;
  int outputs;
  int period;
  int phase;
};

/**
 * Overlapping blocks of kBlock x kBlock pixels x slots, kBlockStep apart, as
 * many side by side as a vector has lanes: column x of row y of block l is at
 * source[slot][y * stride + ((x + shift) mod kBlockStep) * split
 *              + (x + shift) / kBlockStep + l].
 */
constexpr int kBlock = 12;
constexpr int kBlockStep = 4;

struct ShrinkRow {
  const float *const *source; ///< of each slot, the first block's first row
  float *const *sum;          ///< the same places: += weight * block
  float *weight;              ///< the same places of one slot: += weight
  std::ptrdiff_t stride;
  std::ptrdiff_t split;
  int shift; ///< of the blocks to the right, 0 .. kBlockStep - 1
  int slots;
  const float *slot_transform; ///< orthonormal, slots x slots
  int blocks;                  ///< a multiple of 16
  float threshold;
  float *scratch; ///< slots * kBlock^2 * 16 floats
};

/** The kernels of one instruction set; all give the same numbers. */
struct Kernels {
  std::string_view name;
  /** outputs[k][x] = output k. */
  void (*filter) (const FilterRow &row, float *const *outputs);
  /** outputs[k][x] += scale[x] * output k, where scale is not 0. */
  void (*filter_add) (
      const FilterRow &row, const float *scale, float *const *outputs);
  /** to[x] = the sum of rows[i][x], in the order of the rows; the largest.
   * As many as 15 more than @p count are read and written. */
  void (*sum) (const float *const *rows, int rows_count, int count, float *to);
  void (*most) (const float *const *rows, int rows_count, int count, float *to);
  /** Transforms each block (slot_transform over slots, DCT in x and y), drops
   * coefficients below the threshold but the mean, transforms back, and adds
   * it weighted with 1 / coefficients kept. */
  void (*shrink) (const ShrinkRow &row);
};

/** Those that this processor can run, widest first; the last is the scalar
 * reference. */
std::span<const Kernels> supported_kernels ();

} // namespace cexp::fuse
