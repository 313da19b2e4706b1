/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Weights of the pixels around a mirror; for the sources of lib/moire only. */
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "moire/rectify_elements.h"

namespace cexp
{

/** Correlations of the light of two mirrors, by how far they are apart: as a
 * scene's in space (Matern, 3/2). */
class SpaceCorrelation
{
public:
  /** For mirrors within @p reach of one, to each side. */
  SpaceCorrelation (int reach, double length);

  /** At (@p dx, @p dy), (@p dx + 1, @p dy) ... */
  const double *row (int dx, int dy) const
  {
    return values_.data () + (dy + far_) * (2 * far_ + 1) + dx + far_;
  }

private:
  int far_;
  std::vector<double> values_;
};

/**
 * What is known of the light of a mirror and of those around it together:
 * mirrors correlate in space as a scene does, and in time as the slots do in
 * which they are open.
 */
class Neighbourhood
{
public:
  /** @p around  elements of the mirrors up to @p reach to each side, row by
   *             row. */
  Neighbourhood (const Elements &elements, const std::vector<int> &around,
      int reach, const SpaceCorrelation &space);

  int reach () const { return reach_; }
  std::size_t count () const { return light_.size (); }
  /** Mean light of a mirror in a flat scene, in slots. */
  double light (std::size_t mirror) const { return light_[mirror]; }
  /** Whether all get the same light of a flat scene. */
  bool even () const;
  /** Of one mirror with each. */
  const double *covariances (std::size_t mirror) const
  {
    return covariance_.data () + mirror * light_.size ();
  }

private:
  int reach_;
  std::vector<double> light_;
  std::vector<double> covariance_;
};

/** How pixels look at mirrors around a place. */
struct PixelView {
  std::array<double, 4> slope; ///< d mirror / d camera
  double sigma;                ///< blur, pixels
  int taps;                    ///< pixels along a side of the window
};

/** mirror_share () along one axis, from a table. */
class ShareProfile
{
public:
  ShareProfile (double side, double sigma);

  /** 0 where it is next to nothing. */
  double at (double distance) const
  {
    const double step = kSteps * (distance < 0.0 ? -distance : distance);
    if (!(step < double (values_.size () - 1)))
      return 0.0;
    const std::size_t low = std::size_t (step);
    return values_[low] +
           (step - double (low)) * (values_[low + 1] - values_[low]);
  }

private:
  static constexpr int kSteps = 64; // a mirror
  std::vector<double> values_;
};

/**
 * Finds the weights of least mean square error of the pixels in a window, for
 * the mirror in its middle.
 */
class WeightSolver
{
public:
  explicit WeightSolver (const PixelView &view);

  int taps () const { return view_.taps; }
  /** Mirrors to each side of which the pixels of a window see anything. */
  int reach () const;
  /** Part of the light of the pixel @p dx, @p dy pixels from where the mirror
   * is seen that is of this mirror. */
  double own_share (double dx, double dy) const;
  /** Weights, row by row, for the mirror in the middle of @p mirrors, seen
   * @p fx, @p fy pixels from the window's middle one; one set after the other
   * for each of @p noises, a pixel's rms as a part of the scene's variation. A
   * still, flat scene keeps its brightness. At last how rough the window looks:
   * half the mean squared difference of the 5 x 5 pixels in its middle from
   * their neighbours, as a part of the scene's variance. */
  std::vector<float> solve (const Neighbourhood &mirrors, double fx, double fy,
      std::span<const double> noises) const;

private:
  struct Share {
    std::size_t mirror;
    double part;
  };
  /** Covariances of the pixels, upper triangle; a row of two for each pixel:
   * its covariance with the mirror, and its light in a flat scene. */
  struct System {
    std::vector<double> matrix, right;
  };
  std::vector<Share> shares_of (
      const Neighbourhood &mirrors, double dx, double dy) const;
  System system_of (const Neighbourhood &mirrors, double fx, double fy) const;
  double roughness (const std::vector<double> &matrix) const;

  PixelView view_;
  ShareProfile across_, down_;
};

} // namespace cexp
