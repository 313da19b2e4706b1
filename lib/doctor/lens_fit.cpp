/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/lens_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "estimate/least_squares.h"

namespace codedexposure
{

namespace
{

/* A 2 x 2 matrix row by row, the shift, the tilts and the distortion. */
constexpr Eigen::Index kNumbers = 9;
using Numbers = Eigen::VectorXd;

struct Frame {
  double cx, cy, mx, my; // centres of the camera and of the mirrors

  Eigen::Vector2d mirror_at (const Numbers &n, Position pixel) const
  {
    const double dx = pixel.x - cx, dy = pixel.y - cy;
    const double out =
        1.0 + n[8] * (dx * dx + dy * dy) / std::max (1.0, cx * cx + cy * cy);
    const double qx = out * dx, qy = out * dy;
    const double z = 1.0 + n[6] * qx / cx + n[7] * qy / cy;
    return {mx + n[4] + (n[0] * qx + n[1] * qy) / z,
        my + n[5] + (n[2] * qx + n[3] * qy) / z};
  }
};

/* Sizes of numbers that move a corner by about a mirror. */
Numbers
steps_of (const Frame &frame)
{
  const double r = 1.0 / std::max (1.0, std::max (frame.cx, frame.cy));
  Numbers steps (kNumbers);
  steps << r, r, r, r, 1.0, 1.0, r, r, r;
  return steps;
}

} // namespace

std::optional<LensFit>
fit_lens (const std::vector<PlacePair> &pairs, Extent camera, Extent mirrors,
    double noise)
{
  if (Eigen::Index (pairs.size ()) < kNumbers)
    return std::nullopt;
  const Frame frame = {0.5 * (camera.width - 1), 0.5 * (camera.height - 1),
      0.5 * (mirrors.width - 1), 0.5 * (mirrors.height - 1)};
  const Numbers steps = steps_of (frame);
  Numbers start = Numbers::Zero (kNumbers);
  start[4] = pairs[0].mirror.x - frame.mx;
  start[5] = pairs[0].mirror.y - frame.my;
  const Minimum best = minimise (
      [&] (const Numbers &numbers) {
        Eigen::Matrix2Xd rest (2, Eigen::Index (pairs.size ()));
        for (Eigen::Index i = 0; i < rest.cols (); i++) {
          const PlacePair &pair = pairs[std::size_t (i)];
          rest.col (i) = Eigen::Vector2d (pair.mirror.x, pair.mirror.y) -
                         frame.mirror_at (numbers, pair.pixel);
        }
        return Eigen::VectorXd (rest.reshaped ());
      },
      start, 1e-3 * steps);
  const Numbers &n = best.numbers;
  if (!n.allFinite () || !best.determined)
    return std::nullopt;

  LensFit found;
  const double freedom =
      std::max (1.0, 2.0 * double (pairs.size ()) - kNumbers);
  found.rms = std::sqrt (best.squares () / freedom);
  const double sigma = std::max (noise, found.rms);
  const Numbers doubt =
      sigma * best.covariance.diagonal ().cwiseMax (0.0).cwiseSqrt ();
  const double area = std::abs (n[0] * n[3] - n[1] * n[2]);
  if (!(area > 1e-9))
    return std::nullopt;
  const double mirrored = n[0] * n[3] - n[1] * n[2] < 0.0 ? -1.0 : 1.0;
  const double scale = 1.0 / std::sqrt (area);
  const double turn =
      std::atan2 (n[2] - mirrored * n[1], n[0] + mirrored * n[3]);
  found.rotation = {turn * 180.0 / std::numbers::pi,
      std::hypot (doubt[1], doubt[2]) / 2.0 * scale * 180.0 / std::numbers::pi};
  found.magnification = {
      scale, scale * scale * std::hypot (doubt[0], doubt[3]) / 2.0};
  found.shift_x = {n[4], doubt[4]};
  found.shift_y = {n[5], doubt[5]};
  found.tilt_x = {n[6], doubt[6]};
  found.tilt_y = {n[7], doubt[7]};
  found.distortion = {n[8], doubt[8]};
  return found;
}

} // namespace codedexposure
