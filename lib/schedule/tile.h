/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The label map that repeats over the mirrors: which label each pixel bears. */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/geometry.h"
#include "base/result.h"

namespace codedexposure
{

/**
 * A doubly periodic map of labels 0..n-1, n = elements ().
 *
 * Named forms, also understood by parse ():
 *   "WxH"          raster groups; label = x mod W + W (y mod H); W H in 2..256
 *   "lattice:N/B"  label = (x + B y) mod N; N in 2..256, B in 0..N-1; N = 5,
 *                  B = 2 is the plus shape
 *   "diamond:N"    groups of all pixels within r steps of a centre, N =
 *                  2r^2 + 2r + 1 (5, 13, 25, ... 221); label = (x + (2r + 1)
 *                  y) mod N
 * Any other map is written out with from_labels ().
 */
class Tile
{
public:
  static constexpr int kMaxElements = 256;
  /** Bound on the period of a map that is written out, in pixels. */
  static constexpr int kMaxPeriod = 256;

  static Result<Tile> raster (int columns, int rows);
  static Result<Tile> lattice (int elements, int step);
  static Result<Tile> diamond (int elements);
  /** @p labels: period_y rows of period_x labels. Every label from 0 to the
   * largest must occur. Whether it has a cell () depends on the phase, which
   * Schedule::make () checks. */
  static Result<Tile> from_labels (
      int period_x, int period_y, std::vector<std::uint8_t> labels);
  static Result<Tile> parse (std::string_view text);

  /** What parse () takes, or "labels" for a map that was written out. */
  const std::string &name () const { return name_; }
  bool is_named () const { return name_ != "labels"; }

  int elements () const { return elements_; }
  int period_x () const { return period_x_; }
  int period_y () const { return period_y_; }
  /** Label of pixel (x, y), which may be negative. */
  int label (int x, int y) const
  {
    return labels_[std::size_t (
        floor_mod (y, period_y_) * period_x_ + floor_mod (x, period_x_))];
  }
  const std::vector<std::uint8_t> &labels () const { return labels_; }

  /**
   * The squarest block W x H, W H = n, that holds each label exactly once
   * wherever it is placed on the grid of its own size that starts at @p phase;
   * the wider of two equally square ones. Its sides divide the period. Error
   * when there is none.
   */
  Result<Extent> cell (Offset phase = {}) const;

  bool operator== (const Tile &) const = default;

private:
  Tile (std::string name, int elements, int period_x, int period_y,
      std::vector<std::uint8_t> labels);

  std::string name_;
  int elements_;
  int period_x_;
  int period_y_;
  std::vector<std::uint8_t> labels_;
};

} // namespace codedexposure
