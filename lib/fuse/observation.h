/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What a pixel of a coded frame says of the light in each slot. */
#pragma once

#include <cstdint>
#include <vector>

#include "schedule/schedule.h"
#include "stats/sensor_noise.h"

namespace cexp
{

/**
 * The linear model y_e = sum over s of response (e, s) x_s + noise, where x_s
 * is the light of slot s and y_e the pixel of element e times gain (e), both
 * as parts of white (paper, Eq. 7). The responses of an element sum to 1, so
 * that y is a mean over slots, whatever the code.
 */
class Observation
{
public:
  /** @p noise  of a camera whose full well white fills where every slot is
   *            open, as in BenchOptions.
   *  @p steps  numbers between black and white, for the rounding. */
  Observation (
      const Schedule &schedule, const SensorNoise &noise, double steps);

  int slots () const { return n_; }
  /** The response to a slot, where it is not 0. */
  struct Share {
    int slot;
    double response;
  };
  const std::vector<Share> &shares (int element) const
  {
    return shares_[std::size_t (element)];
  }
  double gain (int element) const { return gain_[std::size_t (element)]; }
  /** Whether any is other than 1. */
  bool gains () const;
  /** Variance of the noise of y where the light is @p light. */
  double variance (int element, double light) const;
  /** Every element passes one slot only: its pixel is the light of that slot.
   */
  bool exact () const { return exact_; }
  bool noise_free () const { return noise_.full_well <= 0.0; }

private:
  int n_;
  SensorNoise noise_;
  double white_electrons_; ///< that make the coded frame's white
  double steps_;
  std::vector<std::vector<Share>> shares_;
  std::vector<double> gain_;
  bool exact_;
};

/**
 * Which elements lie around a pixel. Pixels with the same neighbourhood are of
 * one phase, so that filters are made once for each.
 *
 * Rows of pixels repeat as shifts of a few: pixel (x, y) has phase
 * first (y) + (x + shift (y)) mod period ().
 */
class Phases
{
public:
  explicit Phases (const Schedule &schedule);

  int period () const { return period_; }                 ///< along a row, px
  int rows () const { return int (row_starts_.size ()); } ///< distinct ones
  /** The distinct row that row @p y of the frame is a shift of. */
  int row_of (int y) const { return at (y).row; }
  int shift (int y) const { return at (y).shift; }
  /** Element at (x, y) from pixel @p x of distinct row @p row. */
  int element (int row, int x, int dx, int dy) const
  {
    return schedule_.element_at (x + dx, row_starts_[std::size_t (row)] + dy);
  }

private:
  struct Row {
    int row;
    int shift;
  };
  const Row &at (int y) const
  {
    return rows_[std::size_t (floor_mod (y, int (rows_.size ())))];
  }
  bool is_shift (int y, int from, int shift) const;

  Schedule schedule_;
  int period_;
  std::vector<Row> rows_;       ///< one period of the tile
  std::vector<int> row_starts_; ///< y of the first of each distinct row
};

} // namespace cexp
