/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Weights of the pixels around a mirror; for the sources of lib/moire only. */
#pragma once

#include <array>
#include <span>
#include <vector>

#include "schedule/matrix.h"
#include "schedule/schedule.h"

namespace cexp
{

/**
 * Which element each mirror around one of them is, and what is known of their
 * light together: mirrors correlate as a scene does in space (Matern, 3/2) and
 * as the slots in which they are open do in time.
 */
class Neighbourhood
{
public:
  /** Around mirror (@p x, @p y), @p reach mirrors to each side. */
  Neighbourhood (const Schedule &schedule, const Matrix &elements, int x, int y,
      int reach, double correlation_length);

  int reach () const { return reach_; }
  std::size_t count () const { return light_.size (); }
  /** Mean light of a mirror in a flat scene, in slots. */
  double light (std::size_t mirror) const { return light_[mirror]; }
  double covariance (std::size_t a, std::size_t b) const
  {
    return covariance_[a * light_.size () + b];
  }

private:
  int reach_;
  std::vector<double> light_;
  std::vector<double> covariance_;
};

/** Covariance of the elements' light, n x n, of a scene that correlates with
 * itself a slot later by @p persistence. */
Matrix element_covariance (const Schedule &schedule, double persistence);

/** How pixels look at mirrors around a place. */
struct PixelView {
  std::array<double, 4> slope; ///< d mirror / d camera
  double sigma;                ///< blur, pixels
  int taps;                    ///< pixels along a side of the window
};

/** Part of the light of the pixel @p dx, @p dy pixels from where the mirror is
 * seen that is of this mirror. */
double own_share (const PixelView &view, double dx, double dy);

/** Mirrors to each side of which the pixels of a window see anything. */
int needed_reach (const PixelView &view);

/**
 * The weights of least mean square error of the pixels in a window, row by row,
 * for the mirror in the middle of @p mirrors. The mirror is seen @p fx, @p fy
 * pixels from the window's middle one. A still, flat scene keeps its
 * brightness.
 */
void solve_weights (const Neighbourhood &mirrors, const PixelView &view,
    double fx, double fy, double noise, std::span<float> weights);

} // namespace cexp
