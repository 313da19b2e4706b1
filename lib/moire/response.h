/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The light that a pixel gets from a grating, by where it looks. */
#pragma once

#include <vector>

namespace cexp
{

/**
 * A square grating seen by a square pixel without gaps through a Gaussian blur:
 * the period's on half, convolved with both, in closed form. It has all its
 * harmonics, so what aliases at one pixel a mirror aliases in the model, too.
 */
class GratingResponse
{
public:
  /** Light of a grating of phase 0 in 0..1, at one place. */
  struct Value {
    float light = 0.0f;
    float slope = 0.0f; ///< d light / d place, 1 / mirrors
    float blur = 0.0f;  ///< d light / d variance of the blur, 1 / mirrors^2
    float unused = 0.0f;
  };
  static constexpr int kSteps = 128; ///< of the table, a mirror

  /** @p period in mirrors; @p side of a pixel and @p sigma of the blur in
   * mirrors. */
  GratingResponse (int period, double side, double sigma);

  int period () const { return period_; }
  /** Two periods and one step; entry i is the light at place i / kSteps. */
  const Value *table () const { return table_.data (); }
  Value at (double place) const;

private:
  int period_;
  std::vector<Value> table_;
};

/** Part of a pixel's light that it gets from a mirror @p distance mirrors away
 * along one axis; @p side and @p sigma as above. */
double mirror_share (double distance, double side, double sigma);

} // namespace cexp
