/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The light in front of the bench: one picture a slot. */
#include "scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace cexp::quality
{

namespace
{

constexpr double kTurn = 2.0 * std::numbers::pi;

/* Part of a pixel that lies inside an edge at this signed distance. */
double
coverage (double inside)
{
  return std::clamp (inside + 0.5, 0.0, 1.0);
}

double
blend (double under, double over, double alpha)
{
  return under + (over - under) * alpha;
}

double
background (double x, double y)
{
  return 110.0 + 45.0 * std::sin (kTurn * (x + 0.3 * y) / 37.0) +
         30.0 * std::sin (kTurn * (0.4 * x - y) / 9.0);
}

/* Distance of x within (-period / 2, period / 2] of a point that comes back
 * after a period: things that leave on one side enter on the other. */
double
around (double x, double period)
{
  return x - period * std::round (x / period);
}

double
light (double x, double y, double t, double width, double height)
{
  double v = background (x, y);

  const double stripes = 128.0 + 90.0 * std::sin (kTurn * (x / 5.0 - t / 4.0));
  const bool in_patch = x > 0.6 * width && x < 0.9 * width &&
                        y > 0.1 * height && y < 0.35 * height;
  if (in_patch)
    v = stripes;

  const double bar = around (x - 0.2 * width - 3.0 * t, width);
  v = blend (v, 235.0, coverage (6.0 - std::abs (bar)));

  const double dx = around (x - 0.3 * width - 2.0 * t, width);
  const double dy = around (y - 0.5 * height - t, height);
  const double radius = height / 8.0;
  return blend (v, 20.0, coverage (radius - std::hypot (dx, dy)));
}

} // namespace

Scene
synthetic_scene (int width, int height, int frames)
{
  Scene scene{"synthetic", {}};
  for (int t = 0; t < frames; t++) {
    Picture picture (width, height);
    for (int y = 0; y < height; y++) {
      for (int x = 0; x < width; x++)
        picture.at (x, y) =
            std::uint8_t (std::lround (light (x, y, t, width, height)));
    }
    scene.frames.push_back (std::move (picture));
  }
  return scene;
}

Scene
still_scene (std::string name, const Picture &picture, int frames)
{
  return {
      std::move (name), std::vector<Picture> (std::size_t (frames), picture)};
}

Scene
flat_scene (int width, int height, int frames, std::uint8_t level)
{
  Picture picture (width, height);
  for (int y = 0; y < height; y++) {
    for (int x = 0; x < width; x++)
      picture.at (x, y) = level;
  }
  return still_scene ("flat", picture, frames);
}

} // namespace cexp::quality
