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
  const auto below = [sigma] (double at) {
    return 0.5 * std::erfc (-at / sigma / std::numbers::sqrt2);
  };
  const auto density = [sigma] (double at) {
    const double z = at / sigma;
    return std::exp (-0.5 * z * z) * std::numbers::inv_sqrtpi /
           std::numbers::sqrt2 / sigma;
  };
  const double right = x + 0.5 * side, left = x - 0.5 * side;
  /* The second integral of the Gaussian, and its derivatives; by the heat
   * equation, that by the variance is half the second one. */
  const auto ramp = [&] (double at) {
    return at * below (at) + sigma * sigma * density (at);
  };
  return {(ramp (right) - ramp (left)) / side,
      (below (right) - below (left)) / side,
      0.5 * (density (right) - density (left)) / side};
}

double
mirror_share (double distance, double side, double sigma)
{
  return edge_light (0.5 - distance, side, sigma).light -
         edge_light (-0.5 - distance, side, sigma).light;
}

} // namespace codedexposure
