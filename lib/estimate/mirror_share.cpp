/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "estimate/mirror_share.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace codedexposure
{

namespace
{

/* Tables that are made of edges cannot resolve less blur. */
constexpr double kMinSigma = 0.03;

} // namespace

EdgeLight
edge_light (double x, double side, double sigma)
{
  sigma = std::max (sigma, kMinSigma);
  /* The second integral of the Gaussian, and its derivatives; by the heat
   * equation, that by the variance is half the second one. */
  struct Integrals {
    double ramp, below, density;
  };
  const auto at = [sigma] (double place) -> Integrals {
    const double z = place / sigma;
    const double below = 0.5 * std::erfc (-place / sigma / std::numbers::sqrt2);
    const double density = std::exp (-0.5 * z * z) * std::numbers::inv_sqrtpi /
                           std::numbers::sqrt2 / sigma;
    return {place * below + sigma * sigma * density, below, density};
  };
  const Integrals right = at (x + 0.5 * side), left = at (x - 0.5 * side);
  return {(right.ramp - left.ramp) / side, (right.below - left.below) / side,
      0.5 * (right.density - left.density) / side};
}

double
mirror_share (double distance, double side, double sigma)
{
  return edge_light (0.5 - distance, side, sigma).light -
         edge_light (-0.5 - distance, side, sigma).light;
}

} // namespace codedexposure
