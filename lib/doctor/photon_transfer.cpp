/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/photon_transfer.h"

#include <algorithm>
#include <cmath>

#include "estimate/least_squares.h"

namespace codedexposure
{

namespace
{

/* Relative error of light that the levels have in common. */
constexpr double kLightError = 0.0005;

} // namespace

void
PhotonTransfer::set_floor (const Measured &variance)
{
  const double gain = conversion_gain.value;
  /* The gain's own error changes electrons, and with them the noise. */
  const double sigma = std::hypot (
      variance.sigma, 2.0 * variance.value * conversion_gain.sigma / gain);
  read_variance = {gain * gain * variance.value, gain * gain * sigma};
  const double read = std::sqrt (std::max (0.0, read_variance.value));
  const double least = std::sqrt (read_variance.sigma);
  read_noise = {read,
      read > 0.0 ? std::min (0.5 * read_variance.sigma / read, least) : least};
}

double
PhotonTransfer::light_of (double number) const
{
  /* Newton's method; beyond its top, a parabola goes on as a line. */
  double light = (number - dark.value) / slope;
  for (int i = 0; i < 20; i++) {
    const double steep = std::max (0.2 * slope, slope + 2.0 * bow * light);
    light -= (number_of (light) - number) / steep;
  }
  return light;
}

Measured
PhotonTransfer::deviation (
    const std::vector<TransferPoint> &points, double largest) const
{
  const double full = light_of (largest);
  const double line = (number_of (full) - dark.value) / full;
  Measured worst = {
      std::abs (bow) * full * full / 4.0, bow_sigma * full * full / 4.0};
  for (const TransferPoint &point : points) {
    const double rest =
        std::abs (point.mean.value - dark.value - line * point.light);
    if (rest - point.mean.sigma > worst.value)
      worst = {rest, point.mean.sigma};
  }
  return worst;
}

std::optional<PhotonTransfer>
fit_photon_transfer (const std::vector<TransferPoint> &points)
{
  double most = 0.0;
  for (const TransferPoint &point : points)
    most = std::max (most, point.light);
  std::vector<Sample> means, variances;
  for (const TransferPoint &point : points)
    means.push_back ({point.light / most, point.mean.value, point.mean.sigma});
  if (means.size () < 4 || !(most > 0.0))
    return std::nullopt;
  const Polynomial response = fit_polynomial (means, 2);

  PhotonTransfer found;
  found.dark = {response.factors[0], std::sqrt (response.covariance (0, 0))};
  found.slope = response.factors[1] / most;
  found.bow = response.factors[2] / (most * most);
  found.bow_sigma = std::sqrt (response.covariance (2, 2)) / (most * most);

  if (!(found.slope + 2.0 * std::min (0.0, found.bow) * most > 0.0))
    return std::nullopt; // no response decreases

  /* An electron counts more or less where the response is steep or flat. */
  for (const TransferPoint &point : points) {
    if (!point.variance)
      continue;
    const double steep = 1.0 + 2.0 * found.bow * point.light / found.slope;
    const double unit = steep * steep;
    variances.push_back ({found.slope * point.light,
        point.variance->value / unit, point.variance->sigma / unit});
  }
  if (variances.size () < 4)
    return std::nullopt;
  const Polynomial noise = fit_polynomial (variances, 1);
  const double per_number = noise.factors[1];
  if (!(per_number > 0.0))
    return std::nullopt;
  const double gain = 1.0 / per_number;
  found.conversion_gain = {
      gain, gain * gain * std::sqrt (noise.covariance (1, 1))};
  /* Light that flickers at a multiple of the frame rate looks like a bow. */
  found.conversion_gain.sigma =
      std::hypot (found.conversion_gain.sigma, kLightError * gain);
  found.set_floor ({noise.factors[0], std::sqrt (noise.covariance (0, 0))});
  return found;
}

} // namespace codedexposure
