/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "moire/homography_fit.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace cexp
{

CentredFrame::CentredFrame (Extent camera)
    : cx (0.5 * (camera.width - 1)), cy (0.5 * (camera.height - 1)),
      r (std::max (0.5, std::max (cx, cy)))
{
}

CentredMirror
centred_mirror (const Homography &h, double xi, double eta)
{
  const double z = h[6] * xi + h[7] * eta + h[8];
  return {(h[0] * xi + h[1] * eta + h[2]) / z,
      (h[3] * xi + h[4] * eta + h[5]) / z, z};
}

void
HomographyFit::add (std::size_t first, double mirror, double xi, double eta,
    double z, const Observation &seen)
{
  const std::size_t extra = kExtra + first / 3;
  const std::size_t at[] = {first, first + 1, first + 2, 6, 7};
  const double gradient[] = {
      xi / z, eta / z, 1.0 / z, -mirror * xi / z, -mirror * eta / z};
  for (std::size_t i = 0; i < 5; i++) {
    const double weighted = seen.information * gradient[i];
    for (std::size_t j = 0; j <= i; j++)
      normal_[at[i] * kNumbers + at[j]] += weighted * gradient[j];
    normal_[extra * kNumbers + at[i]] += seen.cross * gradient[i];
    right_[at[i]] += seen.score * gradient[i];
  }
  normal_[extra * kNumbers + extra] += seen.extra_information;
  right_[extra] += seen.extra_score;
}

void
HomographyFit::add_x (
    double xi, double eta, const CentredMirror &at, const Observation &seen)
{
  add (0, at.x, xi, eta, at.z, seen);
}

void
HomographyFit::add_y (
    double xi, double eta, const CentredMirror &at, const Observation &seen)
{
  add (3, at.y, xi, eta, at.z, seen);
}

std::optional<HomographyFit::Step>
HomographyFit::solve (std::size_t numbers, bool extra) const
{
  std::vector<std::size_t> used;
  for (std::size_t i = 0; i < kNumbers; i++)
    if (i < numbers || (i >= kExtra && extra))
      used.push_back (i);
  /* To unit diagonal, so that pivots can be told from nothing. */
  std::vector<double> scale;
  for (const std::size_t i : used) {
    const double diagonal = normal_[i * kNumbers + i];
    if (!(diagonal > 0.0))
      return std::nullopt;
    scale.push_back (1.0 / std::sqrt (diagonal));
  }
  const std::size_t n = used.size ();
  Matrix matrix (n * n);
  for (std::size_t i = 0; i < n; i++)
    for (std::size_t j = 0; j < n; j++)
      matrix[i * n + j] = scale[i] * scale[j] *
                          normal_[std::max (used[i], used[j]) * kNumbers +
                                  std::min (used[i], used[j])];
  const auto inverse = inverted (std::move (matrix), n);
  if (!inverse)
    return std::nullopt;

  Step step;
  for (std::size_t i = 0; i < n; i++)
    for (std::size_t j = 0; j < n; j++) {
      const double entry = 0.5 * scale[i] * scale[j] *
                           ((*inverse)[i * n + j] + (*inverse)[j * n + i]);
      step.covariance[used[i] * kNumbers + used[j]] = entry;
      step.change[used[i]] += entry * right_[used[j]];
    }
  return step;
}

} // namespace cexp
