/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Interpolation between the samples of a subframe. */
#include "upsample.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "schedule/sample_grid.h"

namespace codedexposure::quality
{

namespace
{

int
dot (Offset a, Offset b)
{
  return a.x * b.x + a.y * b.y;
}

int
cross (Offset a, Offset b)
{
  return a.x * b.y - a.y * b.x;
}

/* The shortest vector from a pixel to another of its label that does not point
 * along @p other. */
Offset
shortest_vector (const Tile &tile, Offset other)
{
  const int reach = tile.elements ();
  Offset best = {};
  for (int y = 0; y <= reach; y++) {
    for (int x = -reach; x <= reach; x++) {
      const Offset v = {x, y};
      const bool apart =
          other == Offset{} ? dot (v, v) > 0 : cross (v, other) != 0;
      if (apart && tile.label (x, y) == tile.label (0, 0) &&
          (best == Offset{} || dot (v, v) < dot (best, best)))
        best = v;
    }
  }
  return best;
}

} // namespace

Upsampler::Upsampler (const Schedule &schedule, int element, bool centred)
    : cell_ (schedule.cell ()), a_ (shortest_vector (schedule.tile (), {})),
      b_ (shortest_vector (schedule.tile (), a_))
{
  if (dot (a_, b_) < 0)
    b_ = {-b_.x, -b_.y};
  if (centred) {
    origin_x_ = 0.5 * (cell_.width - 1);
    origin_y_ = 0.5 * (cell_.height - 1);
  } else {
    const Offset offset = SampleGrid (schedule).offset (element, 0, 0);
    origin_x_ = offset.x;
    origin_y_ = offset.y;
  }
  margin_ =
      std::abs (a_.x) + std::abs (a_.y) + std::abs (b_.x) + std::abs (b_.y);
}

double
Upsampler::at (ImageView<const float> subframe, int x, int y) const
{
  const double dx = x - origin_x_, dy = y - origin_y_;
  const double area = cross (a_, b_);
  const double u = (dx * b_.y - dy * b_.x) / area;
  const double v = (a_.x * dy - a_.y * dx) / area;
  const double i = std::floor (u), j = std::floor (v);
  const double fu = u - i, fv = v - j;

  auto sample = [&] (double m, double n) -> double {
    const double sx = origin_x_ + m * a_.x + n * b_.x;
    const double sy = origin_y_ + m * a_.y + n * b_.y;
    return subframe.at (int (sx) / cell_.width, int (sy) / cell_.height);
  };
  // The parallelogram's short diagonal joins (1, 0) and (0, 1).
  const double corner = fu + fv <= 1.0
                            ? (1.0 - fu - fv) * sample (i, j)
                            : (fu + fv - 1.0) * sample (i + 1.0, j + 1.0);
  const double wa = std::min (fu, 1.0 - fv), wb = std::min (fv, 1.0 - fu);
  return corner + wa * sample (i + 1.0, j) + wb * sample (i, j + 1.0);
}

} // namespace codedexposure::quality
