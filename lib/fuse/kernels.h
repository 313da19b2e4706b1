/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The kernels of fusion, which are compiled once per instruction set. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace codedexposure::fuse
{

/**
 * One row through a filter bank whose weights repeat along the row. Output k at
 * x is
 *
 *   sum over taps t of weights[(t outputs + k) width + (phase + x) mod period]
 *                      * source[x + offsets[t]],
 *
 * summed in the order of the taps; each product is rounded before it is added.
 * A row of weights continues for at least 15 values after its period. Up to 15
 * pixels more than @p count are read and written.
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
 * Overlapping blocks of kBlock x kBlock pixels x slots, kBlockStep apart. A
 * vector has one block per lane: column x of row y of block l is at
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

/** The kernels of one instruction set; all give the same values. */
struct Kernels {
  std::string_view name;
  /** outputs[k][x] = output k. */
  void (*filter) (const FilterRow &row, float *const *outputs);
  /** outputs[k][x] += scale[x] * output k, where scale is not 0. */
  void (*filter_add) (
      const FilterRow &row, const float *scale, float *const *outputs);
  /** to[x] = the sum of rows[i][x], in the order of the rows, or the largest.
   * Up to 15 values more than @p count are read and written. */
  void (*sum) (const float *const *rows, int rows_count, int count, float *to);
  void (*max) (const float *const *rows, int rows_count, int count, float *to);
  /** Transforms each block (slot_transform over slots, DCT in x and y), sets
   * all coefficients below the threshold but the mean to 0, transforms back,
   * and adds the block weighted with 1 / number of coefficients kept. */
  void (*shrink) (const ShrinkRow &row);
};

/** The kernels that this processor can run, widest first. */
std::span<const Kernels> supported_kernels ();

} // namespace codedexposure::fuse
