/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Weights of the pixels around a mirror; for this folder only. */
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "estimate/covariance.h"
#include "estimate/kriging.h"
#include "estimate/mirror_share.h"
#include "schedule/element_map.h"

namespace codedexposure
{

/* Smaller shares count as 0. */
constexpr double kMinShare = 1e-4;

/** What is known about the light of the mirrors up to `reach` to each side of
 * one, row by row, before a frame is seen. */
struct Neighbourhood {
  int reach;
  /** Mean light in a flat scene, in slots. */
  std::vector<double> light;
  /** Of each mirror with each. */
  std::vector<double> covariance;

  /** @p around  elements of the mirrors. */
  Neighbourhood (const ElementMap &elements, const CodedCovariance &covariances,
      const std::vector<int> &around)
      : reach ((int (std::lround (std::sqrt (around.size ()))) - 1) / 2)
  {
    for (const int element : around)
      light.push_back (elements.light (element));
    const int side = 2 * reach + 1, mirrors = side * side;
    covariance.reserve (around.size () * around.size ());
    for (int a = 0; a < mirrors; a++)
      for (int b = 0; b < mirrors; b++)
        covariance.push_back (
            covariances.coded ({a % side - b % side, a / side - b / side},
                around[std::size_t (a)], around[std::size_t (b)]));
  }

  std::size_t count () const { return light.size (); }

  /** Whether all get the same light of a flat scene. */
  bool even () const
  {
    return std::equal (light.begin () + 1, light.end (), light.begin ());
  }

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
  ShareProfile (double side, double sigma)
  {
    do
      values_.push_back (
          mirror_share (double (values_.size ()) / kSteps, side, sigma));
    while (values_.back () > kMinShare);
  }

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
  explicit WeightSolver (const PixelView &view)
      : view_ (view),
        across_ (std::hypot (view.slope[0], view.slope[1]),
            view.sigma * std::hypot (view.slope[0], view.slope[1])),
        down_ (std::hypot (view.slope[2], view.slope[3]),
            view.sigma * std::hypot (view.slope[2], view.slope[3]))
  {
  }

  int taps () const { return view_.taps; }

  /** Mirrors to each side that the pixels of a window see, which is @p shifted
   * by up to so many pixels. */
  int reach (int shifted = 0) const
  {
    const auto &slope = view_.slope;
    const double pixels = 0.5 * view_.taps + shifted + 0.5 + 2.5 * view_.sigma;
    const double along_x = std::abs (slope[0]) + std::abs (slope[1]);
    const double along_y = std::abs (slope[2]) + std::abs (slope[3]);
    return int (std::ceil (pixels * std::max (along_x, along_y)));
  }

  /** Mirrors in the window with that reach. */
  double mirrors () const { return std::pow (2.0 * reach () + 1.0, 2); }

  /** Multiplications of solve () for one noise, about. */
  double work () const
  {
    const int reach = this->reach ();
    double shares = 0.0;
    for (int y = -reach; y <= reach; y++)
      for (int x = -reach; x <= reach; x++)
        shares += share (x, y) > kMinShare;
    const double pixels = double (view_.taps) * view_.taps;
    return pixels * shares * (mirrors () + 0.5 * pixels);
  }

  /** Part of a pixel's light, about, that comes from a mirror @p across and
   * @p down mirrors from where it looks. */
  double share (double across, double down) const
  {
    return across_.at (across) * down_.at (down);
  }

  /** The same of the mirror seen @p dx, @p dy pixels from its centre. */
  double own_share (double dx, double dy) const
  {
    return share (view_.slope[0] * dx + view_.slope[1] * dy,
        view_.slope[2] * dx + view_.slope[3] * dy);
  }

  /** Weights for the mirror in the middle of @p mirrors, which is seen @p fx,
   * @p fy pixels from the centre of the window: row by row, one set for each of
   * @p noises, a pixel's rms in units of the scene's standard deviation. A
   * flat, static scene keeps its brightness. Then, for each of them, the
   * squared error that is not noise; and last the roughness of the window: half
   * the mean squared difference of its central 5 x 5 pixels from their
   * neighbours; both in units of the scene's variance. */
  std::vector<float> solve (const Neighbourhood &mirrors, double fx, double fy,
      std::span<const double> noises) const
  {
    KrigingSystem system = equations (mirrors, fx, fy);
    const std::size_t middle = mirrors.count () / 2;
    const double variance = mirrors.covariances (middle)[middle];
    std::vector<float> weights, errors;
    for (const double noise : noises) {
      system.noise.assign (system.flat.size (), noise * noise * variance);
      const std::vector<double> solved = solve_kriging (system);
      weights.insert (weights.end (), solved.begin (), solved.end ());
      errors.push_back (
          float (squared_error (system, solved, variance) / variance));
    }
    weights.insert (weights.end (), errors.begin (), errors.end ());
    weights.push_back (float (roughness (system.covariance) / variance));
    return weights;
  }

private:
  struct Share {
    std::size_t mirror;
    double part;
  };

  /* Part of the light of the pixel @dx, @dy pixels from where the middle mirror
   * is seen that comes from each mirror; the parts add up to 1. */
  std::vector<Share> shares_of (
      const Neighbourhood &mirrors, double dx, double dy) const
  {
    const double at_x = view_.slope[0] * dx + view_.slope[1] * dy;
    const double at_y = view_.slope[2] * dx + view_.slope[3] * dy;
    const int reach = mirrors.reach;
    std::vector<Share> shares;
    double sum = 0.0;
    for (int j = -reach; j <= reach; j++) {
      const double down = down_.at (at_y - j);
      for (int i = -reach; down > 0.0 && i <= reach; i++) {
        const double part = down * across_.at (at_x - i);
        if (part <= kMinShare)
          continue;
        shares.push_back (
            {std::size_t ((j + reach) * (2 * reach + 1) + i + reach), part});
        sum += part;
      }
    }
    for (Share &share : shares)
      share.part /= sum;
    return shares;
  }

  /* Without noise. */
  KrigingSystem equations (
      const Neighbourhood &mirrors, double fx, double fy) const
  {
    const std::size_t taps = std::size_t (view_.taps), pixels = taps * taps;
    const std::size_t count = mirrors.count ();
    const double half = 0.5 * (view_.taps - 1);
    std::vector<std::vector<Share>> shares;
    for (std::size_t p = 0; p < pixels; p++)
      shares.push_back (shares_of (mirrors, double (p % taps) - half - fx,
          double (p / taps) - half - fy));

    KrigingSystem system;
    system.covariance.resize (pixels * pixels);
    system.flat_targets = {mirrors.light[count / 2]};
    std::vector<double> with;
    for (std::size_t p = 0; p < pixels; p++) {
      with.assign (count, 0.0);
      double flat = 0.0;
      for (const Share &share : shares[p]) {
        const double *covariances = mirrors.covariances (share.mirror);
        for (std::size_t m = 0; m < count; m++)
          with[m] += share.part * covariances[m];
        flat += share.part * mirrors.light[share.mirror];
      }
      system.targets.push_back (with[count / 2]);
      system.flat.push_back (flat);
      for (std::size_t q = p; q < pixels; q++)
        for (const Share &share : shares[q])
          system.covariance[p * pixels + q] += share.part * with[share.mirror];
    }
    return system;
  }

  double roughness (const std::vector<double> &covariances) const
  {
    constexpr int kSteps = 4;
    const int taps = view_.taps, first = taps / 2 - kSteps / 2;
    const auto covariance = [&] (int p, int q) {
      return covariances[std::size_t (p * taps * taps + q)];
    };
    double sum = 0.0;
    for (int y = first; y < first + kSteps; y++)
      for (int x = first; x < first + kSteps; x++) {
        const int p = y * taps + x;
        for (const int q : {p + 1, p + taps})
          sum +=
              covariance (p, p) + covariance (q, q) - 2.0 * covariance (p, q);
      }
    return sum / (4.0 * kSteps * kSteps);
  }

  /* Without noise. @variance: of the target. */
  static double squared_error (const KrigingSystem &system,
      std::span<const double> weights, double variance)
  {
    const std::size_t taps = weights.size ();
    double error = variance;
    for (std::size_t p = 0; p < taps; p++) {
      error += weights[p] * (weights[p] * system.covariance[p * taps + p] -
                                2.0 * system.targets[p]);
      for (std::size_t q = p + 1; q < taps; q++)
        error +=
            2.0 * weights[p] * weights[q] * system.covariance[p * taps + q];
    }
    return error;
  }

  PixelView view_;
  ShareProfile across_, down_;
};

} // namespace codedexposure
