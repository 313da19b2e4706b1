/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/bench_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/statistics.h"
#include "base/try.h"

namespace codedexposure
{

namespace
{

/** A vector from the camera's centre as the orientation has it. */
Position
oriented (const Orientation &orientation, Position d)
{
  if (orientation.flipped_x)
    d.x = -d.x;
  if (orientation.flipped_y)
    d.y = -d.y;
  switch (orientation.turned) {
  case 90:
    return {-d.y, d.x};
  case 180:
    return {-d.x, -d.y};
  case 270:
    return {d.y, -d.x};
  default:
    return d;
  }
}

Position
mirror_of (const SickBenchOptions &options, Position pixel)
{
  const Extent camera = options.camera;
  const Position c = centre_of (camera), m = centre_of (options.mirrors);
  const Position d =
      oriented (options.orientation, {pixel.x - c.x, pixel.y - c.y});
  const Position seen = mirror_seen (
      options.alignment, camera.width, camera.height, {c.x + d.x, c.y + d.y});
  return {seen.x - c.x + m.x, seen.y - c.y + m.y};
}

/** mirror_of () without distortion. */
Homography
homography_of (const SickBenchOptions &options)
{
  const Alignment &a = options.alignment;
  const Position c = centre_of (options.camera);
  const Position m = centre_of (options.mirrors);
  const double turn = a.rotation * std::numbers::pi / 180.0;
  const double cosine = std::cos (turn) / a.scale;
  const double sine = std::sin (turn) / a.scale;
  const double mx = m.x + a.shift_x, my = m.y + a.shift_y;
  const double tx = a.tilt_x / std::max (1.0, c.x);
  const double ty = a.tilt_y / std::max (1.0, c.y);
  Homography h;
  const Position along[] = {oriented (options.orientation, {1.0, 0.0}),
      oriented (options.orientation, {0.0, 1.0})};
  for (std::size_t i = 0; i < 2; i++) {
    const auto [x, y] = along[i];
    const double z = tx * x + ty * y;
    h[i] = cosine * x - sine * y + mx * z;
    h[3 + i] = sine * x + cosine * y + my * z;
    h[6 + i] = z;
  }
  const double last[] = {mx, my, 1.0};
  for (std::size_t row = 0; row < 3; row++)
    h[3 * row + 2] = last[row] - h[3 * row] * c.x - h[3 * row + 1] * c.y;
  return h;
}

/** @p from blurred along one axis; the border goes on beyond the frame. */
Image<float>
blurred (const Image<float> &from, double sigma, bool upright)
{
  const int reach = int (std::ceil (4.0 * sigma));
  std::vector<float> weights;
  double sum = 0.0;
  for (int i = -reach; i <= reach; i++)
    sum += std::exp (-0.5 * i * i / (sigma * sigma));
  for (int i = -reach; i <= reach; i++)
    weights.push_back (float (std::exp (-0.5 * i * i / (sigma * sigma)) / sum));
  const Extent size{from.width (), from.height ()};
  Image<float> to (size.width, size.height);
  each_pixel (size, [&] (int x, int y) {
    float all = 0.0f;
    for (int i = -reach; i <= reach; i++) {
      const int px = upright ? x : std::clamp (x + i, 0, size.width - 1);
      const int py = upright ? std::clamp (y + i, 0, size.height - 1) : y;
      all += weights[std::size_t (i + reach)] * from.at (px, py);
    }
    to.at (x, y) = all;
  });
  return to;
}

} // namespace

Result<Mapping>
mapping_of (const SickBenchOptions &options)
{
  if (options.mapping)
    return *options.mapping;
  Mapping::Parts parts{.camera = options.camera,
      .mirrors = options.mirrors,
      .homography = homography_of (options),
      .psf_sigma = options.blur};
  if (options.alignment.distortion == 0.0)
    return Mapping::make (std::move (parts));
  ASSIGN_OR_RETURN (const Mapping straight, Mapping::make (parts));
  Displacement bent{65, 49, {}, {}};
  for (int j = 0; j < bent.rows; j++)
    for (int i = 0; i < bent.columns; i++) {
      const Position at{
          double (i) * (options.camera.width - 1) / (bent.columns - 1),
          double (j) * (options.camera.height - 1) / (bent.rows - 1)};
      const Position is = mirror_of (options, at);
      const Position was = straight.mirror_at (at.x, at.y);
      bent.x.push_back (is.x - was.x);
      bent.y.push_back (is.y - was.y);
    }
  parts.displacement = std::move (bent);
  return Mapping::make (std::move (parts));
}

/* The blur of each pixel lies between two of some pictures of the whole frame,
 * each with more blur; in between, variances are mixed. */
void
blur_with_tilt (const SickBenchOptions &options, Image<float> &seen)
{
  constexpr double kStep = 0.5;
  const Position c = centre_of (options.camera);
  const double turn = options.focus_direction * std::numbers::pi / 180.0;
  const double cosine = std::cos (turn), sine = std::sin (turn);
  const double far = std::abs (c.x * cosine) + std::abs (c.y * sine);
  const auto sigma_at = [&] (int x, int y) {
    const double along = ((x - c.x) * cosine + (y - c.y) * sine) / far;
    return options.focus_tilt * 0.5 * (1.0 + along);
  };
  const Image<float> sharp = seen;
  Image<float> less = seen;
  const int steps = int (std::ceil (options.focus_tilt / kStep));
  for (int step = 1; step <= steps; step++) {
    const double low = kStep * (step - 1), high = kStep * step;
    const Image<float> more =
        blurred (blurred (sharp, high, false), high, true);
    each_pixel (options.camera, [&] (int x, int y) {
      const double sigma = sigma_at (x, y);
      if (sigma < low || sigma > high)
        return;
      const double part =
          (sigma * sigma - low * low) / (high * high - low * low);
      seen.at (x, y) =
          float ((1.0 - part) * less.at (x, y) + part * more.at (x, y));
    });
    less = more;
  }
}

} // namespace codedexposure
