/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "moire/response.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace cexp
{

namespace
{

/* Below, a blur is one of this many mirrors: a table has no room for less. */
constexpr double kLeastSigma = 0.03;

struct Edge {
  double light, slope, blur;
};

/* An edge from dark to light at 0, seen at @x by a pixel of @side. */
Edge
edge_at (double x, double side, double sigma)
{
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

} // namespace

GratingResponse::GratingResponse (int period, double side, double sigma)
    : period_ (period)
{
  sigma = std::max (sigma, kLeastSigma);
  const int steps = period * kSteps;
  table_.resize (std::size_t (2 * steps + 2));
  for (int i = 0; i < steps; i++) {
    Edge sum = {};
    /* Mirrors 0..period / 2 - 1 are on, and edges between mirrors. */
    const int reach = 1 + int ((side + 6.0 * sigma) / period);
    for (int turn = -reach; turn <= reach; turn++) {
      const double from = double (i) / kSteps + 0.5 - turn * period;
      const Edge up = edge_at (from, side, sigma);
      const Edge down = edge_at (from - period / 2, side, sigma);
      sum.light += up.light - down.light;
      sum.slope += up.slope - down.slope;
      sum.blur += up.blur - down.blur;
    }
    table_[std::size_t (i)] = {
        float (sum.light), float (sum.slope), float (sum.blur), 0.0f};
  }
  for (int i = steps; i < int (table_.size ()); i++)
    table_[std::size_t (i)] = table_[std::size_t (i - steps)];
}

GratingResponse::Value
GratingResponse::at (double place) const
{
  const double turns = place / period_;
  const double step = (turns - std::floor (turns)) * period_ * kSteps;
  const std::size_t low = std::size_t (step);
  const float part = float (step - double (low));
  const Value &a = table_[low], &b = table_[low + 1];
  return {a.light + part * (b.light - a.light),
      a.slope + part * (b.slope - a.slope), a.blur + part * (b.blur - a.blur),
      0.0f};
}

double
mirror_share (double distance, double side, double sigma)
{
  sigma = std::max (sigma, kLeastSigma);
  return edge_at (0.5 - distance, side, sigma).light -
         edge_at (-0.5 - distance, side, sigma).light;
}

} // namespace cexp
