/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The best linear estimate of a pixel in every slot from coded pixels around
 * it (ordinary space-time kriging). */
#pragma once

#include <span>
#include <vector>

#include "fuse/observation.h"
#include "fuse/scene_model.h"

namespace cexp
{

/** Covariances of coded pixels with each other and with the scene under one
 * class of patches, in units of the scene's variance. */
class Covariance
{
public:
  /** Most slots at which patches can move: tables grow with their square. */
  static constexpr int kMaxMovingSlots = 16;

  /** @p reach  largest distance along an axis, px. Moving classes need
   * kMaxMovingSlots or less. */
  Covariance (
      const SceneClass &patch, const Observation &observation, int reach);

  /** Coded pixels of elements @p a and @p b, that of a at (dx, dy) from b. */
  double coded (int dx, int dy, int a, int b) const
  {
    return moving_ ? coded_[index (dx, dy, a, b)]
                   : space_[place (dx, dy)] * coded_[pair (a, b)];
  }
  /** A coded pixel of element @p a at (dx, dy) from a point in @p slot. */
  double cross (int dx, int dy, int a, int slot) const
  {
    return moving_ ? cross_[index (dx, dy, a, slot)]
                   : space_[place (dx, dy)] * cross_[pair (a, slot)];
  }

private:
  std::size_t pair (int a, int b) const { return std::size_t (a * n_ + b); }
  std::size_t place (int dx, int dy) const
  {
    return std::size_t ((dy + reach_) * (2 * reach_ + 1) + dx + reach_);
  }
  std::size_t index (int dx, int dy, int a, int b) const
  {
    return place (dx, dy) * pair (n_, 0) + pair (a, b);
  }
  void fill_still (const SceneClass &patch, const Observation &observation);
  void fill_moving (const SceneClass &patch, const Observation &observation);
  void fill_astray (const SceneClass &patch, const Observation &observation);

  int n_;
  int reach_;
  bool moving_;
  std::vector<double> space_, coded_, cross_;
};

/** Filters of one phase and class over its taps. */
struct KrigingFilter {
  /** Weight of tap i for slot s at [s * taps + i]. */
  std::vector<float> slots;
  /** Prediction of the pixel in the middle by all others, less that pixel. */
  std::vector<float> residual;
};

/** @p taps      places of coded pixels around (0, 0), which is among them.
 *  @p elements  of each tap.
 *  @p noise     variance of each element in units of the scene's variance. */
KrigingFilter solve_kriging (const Covariance &covariance,
    const Observation &observation, std::span<const Offset> taps,
    std::span<const int> elements, std::span<const double> noise);

/** The same for the pixels at @p x of distinct row @p row of the phases. */
KrigingFilter solve_phase (const Covariance &covariance,
    const Observation &observation, const Phases &phases, int row, int x,
    std::span<const Offset> taps, std::span<const double> noise);

/** The places within @p radius px and a half, row by row. */
std::vector<Offset> disc (int radius);

} // namespace cexp
