/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Weights of the pixels around a mirror; for this folder only. */
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "estimate/covariance.h"
#include "estimate/kriging.h"
#include "schedule/element_map.h"

namespace codedexposure
{

/** What is known about the light of the mirrors up to `reach` to each side of
 * one, row by row, before a frame is seen. */
struct Neighbourhood {
  int reach;
  /** Mean light in a flat scene, in slots. */
  std::vector<double> light;
  /** Of each mirror with each. */
  std::vector<double> covariance;

  /** @p around  elements of the mirrors. */
  Neighbourhood (const ElementMap &elements, const CodedCovariance &covariance,
      const std::vector<int> &around);

  std::size_t count () const { return light.size (); }
  /** Whether all get the same light of a flat scene. */
  bool even () const;
  /** Of one mirror with each. */
  const double *covariances (std::size_t mirror) const
  {
    return covariance.data () + mirror * light.size ();
  }
};

/** Geometry of pixels and mirrors around a place. */
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

  /** 0 for shares below 1e-4. */
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
  static constexpr int kSteps = 64; // per mirror
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
  /** Mirrors to each side that the pixels of a window see, which is @p shifted
   * by up to so many pixels. */
  int reach (int shifted = 0) const;
  /** Mirrors in the window with that reach. */
  double mirrors () const { return std::pow (2.0 * reach () + 1.0, 2); }
  /** Multiplications of solve () for one noise, about. */
  double work () const;
  /** Part of a pixel's light, about, that comes from a mirror @p across and
   * @p down mirrors from where it looks. */
  double share (double across, double down) const
  {
    return across_.at (across) * down_.at (down);
  }
  /** The same of the mirror seen @p dx, @p dy pixels from its centre. */
  double own_share (double dx, double dy) const;
  /** Weights for the mirror in the middle of @p mirrors, which is seen @p fx,
   * @p fy pixels from the centre of the window: row by row, one set for each of
   * @p noises, a pixel's rms in units of the scene's standard deviation. A
   * flat, static scene keeps its brightness. Then, for each of them, the
   * squared error that is not noise; and last the roughness of the window: half
   * the mean squared difference of its central 5 x 5 pixels from their
   * neighbours; both in units of the scene's variance. */
  std::vector<float> solve (const Neighbourhood &mirrors, double fx, double fy,
      std::span<const double> noises) const;

private:
  struct Share {
    std::size_t mirror;
    double part;
  };
  std::vector<Share> shares_of (
      const Neighbourhood &mirrors, double dx, double dy) const;
  KrigingSystem equations (
      const Neighbourhood &mirrors, double fx, double fy) const;
  double roughness (const std::vector<double> &covariances) const;
  static double squared_error (const KrigingSystem &system,
      std::span<const double> weights, double variance);

  PixelView view_;
  ShareProfile across_, down_;
};

} // namespace codedexposure
