/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The light that a pixel gets from a grating, by its place. */
#pragma once

#include <vector>

namespace codedexposure
{

/**
 * A square grating seen by a square pixel without gaps through a Gaussian blur,
 * in closed form. The model has all harmonics, so that it contains the aliasing
 * at one pixel per mirror.
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
  static constexpr int kSteps = 128; ///< of the table, per mirror

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

} // namespace codedexposure
