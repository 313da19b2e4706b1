/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The kernels of fusion, which are compiled once per instruction set. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace codedexposure::fuse
{

/** Values of a row are filtered in blocks of this many. */
constexpr int kRunBlock = 16;

/** Some values of a row; both multiples of kRunBlock. */
struct Run {
  int first, count;
};

/**
 * Filters of pixels that all have the same ones, which are every few pixels of
 * a row, over pairs of pixels. The value at i of a source is the pixel at i in
 * its lower 16 bits and the pixel to the right of it in its upper ones, both
 * signed; weights are pairs like it. Output k at i is
 *
 *   scale[k] * sum + base,
 *
 * where sum is over pairs, of both products of weight k and sources[number][i].
 * It fits into 32 bits, so that its order does not matter. No weight is -32768.
 */
struct FilterRow {
  const std::int32_t *const *sources;
  /** Of each pair, number and weights, which are read one after the other. */
  const std::int32_t *pairs;
  int pairs_count;
  int outputs;
  const float *scale;
  float base;
  const Run *runs;
  int runs_count;
};

/** A row of pixels and its parts: pixel x is at part[x mod period * stride + x
 * / period]. */
struct Parts {
  int period;
  std::ptrdiff_t stride;
  int count; ///< pixels of the row
};

/**
 * Overlapping blocks of kBlock x kBlock pixels x slots, kBlockStep apart. A
 * vector has one block per lane: column x of row y of block l is at
 * source[slot][y * stride + ((x + shift) mod kBlockStep) * split
 *              + (x + shift) / kBlockStep + l].
 */
constexpr int kBlock = 12;
constexpr int kBlockStep = 6;

struct ShrinkRow {
  const float *const *source; ///< of each slot, the first block's first row
  float *const *sum;          ///< the same places: += weight * block
  float *weight;              ///< the same places of one slot: += weight
  std::ptrdiff_t stride;
  std::ptrdiff_t split;
  int shift; ///< of the blocks to the right, 0 .. kBlockStep - 1
  int slots;
  const float *slot_transform; ///< dct_matrix () of the slots
  int blocks;                  ///< a multiple of 16
  float threshold;
  float *scratch; ///< slots * kBlock^2 * 16 floats
};

/** Light of slots after shrinking: of each slot, light + step * (sum / weight -
 * light) where there is a weight, but the coded light where it is measured. */
struct SettleRow {
  float *const *light; ///< of each slot
  float *const *sum;   ///< likewise; set to 0, as is weight
  float *weight;
  const float *coded;
  const std::uint8_t *measured; ///< slot, or a larger number
  int slots;
  int count; ///< a multiple of 16
  float step;
};

/** 1 up to @p none, 0 from @p all on, linear between them. */
struct Fade {
  float none, all;
};

/** Squared differences of two rows in units of their variance, 2 (slope light +
 * offset) + floor. */
struct CompareRow {
  const float *now, *other;
  const float *slope, *offset;
  const float *frames; ///< of which other is the mean; null: one
  float floor;
  int count;
};

/** fade of sum / area, times fade of max, times unrepeated, which has a value
 * for every two pixels. */
struct RateRow {
  const float *sum, *max, *unrepeated;
  float area;
  Fade mean_fade, max_fade;
  int count;
};

/** What each of several models has a share of, by their squared errors. */
struct PreferRow {
  const float *const *errors; ///< sums of squared errors of each model
  int models;
  float floor;      ///< added to these sums
  float min_weight; ///< relative to the best model's; less is 0
  int count;
};

/** Classes of motion by their mean squared errors. */
struct WeighRow {
  /** errors[c][x] of class c, which becomes its weight: the power of 8 of the
   * best error / its error, of a sum of 1. */
  float *const *errors;
  const float *factors; ///< of the errors of each class
  int classes;
  float floor;      ///< added to the errors
  float min_weight; ///< relative to the best class's; less is 0
  int count;
};

/** Models that are the best ones of fewer moving pixels of a block than one of
 * this many are left out there. */
constexpr int kWantedPart = 16;

/** The light of static pixels and the shares of models. */
struct ShareRow {
  const float *weight, *light; ///< of static pixels
  /** For each model, a value for every two pixels; null: there is one model. */
  const float *const *preferences;
  int models;
  int block; ///< pixels for which models are left out
  int count;
};

/** Slots and what a partner saw of them: the mean, weighted with responses. */
struct MissRow {
  const float *const *light;     ///< of each slot
  const float *const *responses; ///< likewise
  int slots;
  const float *partner;
  int count;
};

/** How slots move to what a partner saw; PartnerFit. */
struct MoveRow {
  const float *missed;           ///< by the slots, of the partner's light
  const float *sum, *squares;    ///< of that, and of its squares, of the pixels
                                 ///< around
  float around;                  ///< number of these
  const float *partner;          ///< its light, which has noise of the variance
  const float *slope, *offset;   ///< slope light + offset
  float noise, floor;            ///< factor of the variance; added to squares
  const float *step;             ///< 1 / sum of the squared responses
  const float *const *responses; ///< of each slot
  int slots;
  int count;
};

/** Outputs of a convolution come in multiples of this, 1 or 2 times. */
constexpr int kConvolveLanes = 16;

/**
 * One row of a 3x3 convolution of 16-bit integers. A pixel of a source row has
 * @p inputs values, an even number, and one of the result @p outputs. The sum
 * of output k at x is
 *
 *   bias[k] + sum over taps t = 3 row + column, then inputs i, of
 *             weights[((t inputs + i) / 2 outputs + k) 2 + i mod 2]
 *             * source[row][(x + column) inputs + i],
 *
 * where i / 2 is a whole number: weights of two inputs are neighbours, because
 * processors multiply pairs. Whatever the sources, no sum may need more than 32
 * bits, so that its order does not matter: |bias[k]| + 32768 * sum of |weights|
 * of output k must be less than 2^31. No weight is -32768.
 *
 * The result is value = scale[k] * sum, in 32-bit floating point. A hidden
 * layer rounds it, without what is negative, and adds its input:
 *
 *   min (floor (clamp (value + 0.5, 0, 32767)) + add, 32767).
 */
struct ConvolveRow {
  /** Three rows, from the pixel before the first. */
  const std::int16_t *const *source;
  int inputs;
  const std::int16_t *weights;
  const std::int32_t *bias;
  const float *scale;
  int outputs; ///< kConvolveLanes or twice as many
  int pixels;
  const std::int16_t *add; ///< of the result's layout; or null
  std::int16_t *hidden;    ///< result of a hidden layer; null: it is the last
  float *to;               ///< result of the last layer
};

/** The kernels of one instruction set; all give the same values. */
struct Kernels {
  std::string_view name;
  /** to[k][i] += the square of output k, or share[i] * output k, in the runs.
   */
  void (*filter_squared) (const FilterRow &row, float *const *to);
  void (*filter_add) (
      const FilterRow &row, const float *share, float *const *to);
  /** A row to its parts. */
  void (*split_pairs) (
      const Parts &parts, const std::int32_t *from, std::int32_t *to);
  void (*split) (const Parts &parts, const float *from, float *to);
  /** Parts to their row, which is added to @p add if it is not null. */
  void (*join) (
      const Parts &parts, const float *from, const float *add, float *to);
  /** to[x] = the sum of rows[i][x], in the order of the rows, or the largest.
   * Up to 15 values more than @p count are read and written. */
  void (*sum) (const float *const *rows, int rows_count, int count, float *to);
  void (*max) (const float *const *rows, int rows_count, int count, float *to);
  /** to[x] = sum over t of weights[t] * source[x + t step], in this order. Up
   * to 15 values more than @p count are read and written. */
  void (*blur) (const float *source, std::ptrdiff_t step, const float *weights,
      int taps, int count, float *to);
  /** to[x] = the change of pixel x. */
  void (*compare) (const CompareRow &row, float *to);
  /** Up to 15 values more than count are read and written. */
  void (*rate) (const RateRow &row, float *to);
  /** to[x] = fade of a[x] / (floor + b[x]). Up to 15 values more than count are
   * read and written. */
  void (*fade_ratio) (const float *a, const float *b, float floor,
      const Fade &fade, int count, float *to);
  /** to[i][x] = preference for model i: 1 for the best one, in proportion to
   * the inverse of the models' errors to the power of 8. Up to 15 values more
   * than count are read and written. */
  void (*prefer) (const PreferRow &row, float *const *to);
  /** base[x] = static light times its weight; shares[i][x] = share of model i
   * in the rest. Models that too few pixels of a block want are left out
   * there: kept[i * blocks + b] = whether model i is used in block b. Up to 15
   * values more than count are read and written. */
  void (*share) (const ShareRow &row, float *base, float *const *shares,
      std::uint8_t *kept);
  /** to[x] = values 2x and 2x + 1 of both rows. Up to 15 values more than count
   * are written, and up to 30 more read. */
  void (*sum_blocks) (
      const float *upper, const float *lower, int count, float *to);
  /** least[x] = the error of the best class and the floor, without its factor.
   * Up to 15 values more than count are read and written. */
  void (*weigh) (const WeighRow &row, float *least);
  /** Pixels of 16 bits, kSmallest more than light times @p steps, rounded. */
  void (*to_steps) (
      const float *light, float steps, int count, std::int32_t *to);
  /** Pairs of each value and the next one, in place. */
  void (*pair) (std::int32_t *values, int count);
  /** Light times scale as pixels of 0 .. largest, rounded. */
  void (*to_bytes) (const float *light, float scale, float largest, int count,
      std::uint8_t *to);
  void (*to_words) (const float *light, float scale, float largest, int count,
      std::uint16_t *to);
  /** Transforms each block (slot_transform over slots, DCT in x and y), sets
   * all coefficients below the threshold but the mean to 0, transforms back,
   * and adds the block weighted with 1 / number of coefficients kept. */
  void (*shrink) (const ShrinkRow &row);
  void (*settle) (const SettleRow &row);
  /** missed[x] = partner - mean of the slots, and its square. Up to 15 values
   * more than count are read and written. */
  void (*miss) (const MissRow &row, float *missed, float *squared);
  /** light[s][x] += response * step * (missed - its mean around) * (1 - noise /
   * variance around), or nothing where noise is all. Likewise. */
  void (*move) (const MoveRow &row, float *const *light);
  void (*convolve) (const ConvolveRow &row);
};

/** The kernels that this processor can run, widest first. */
std::span<const Kernels> supported_kernels ();

} // namespace codedexposure::fuse
