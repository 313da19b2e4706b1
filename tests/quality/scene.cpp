/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The light in front of the bench, one picture for each slot. */
#include "scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

namespace codedexposure::quality
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

struct Leaf {
  double x, y, radius, vx, vy, grey;
  double wave, wave_x, wave_y, phase;
};

/** Draws numbers that are the same with every standard library. */
class Dice
{
public:
  explicit Dice (unsigned seed) : engine_ (seed) {}

  double between (double low, double high)
  {
    return low + (high - low) * double (engine_ ()) / 4294967296.0;
  }
  /* Evenly on a logarithmic scale. */
  double scaled (double low, double high)
  {
    return low * std::pow (high / low, between (0.0, 1.0));
  }

private:
  std::mt19937 engine_;
};

Leaf
draw_leaf (Dice &dice, double size)
{
  constexpr double kSmall = 2.0, kLarge = 80.0;
  const double part = dice.between (0.0, 1.0);
  Leaf leaf{};
  leaf.radius =
      kSmall /
      std::sqrt (1.0 - part * (1.0 - kSmall * kSmall / (kLarge * kLarge)));
  leaf.x = dice.between (-0.25 * size, 1.25 * size);
  leaf.y = dice.between (-0.25 * size, 1.25 * size);
  leaf.grey = dice.between (20.0, 235.0);
  leaf.wave = dice.between (0.0, 15.0);
  leaf.wave_x = dice.between (-1.0, 1.0);
  leaf.wave_y = dice.between (-1.0, 1.0);
  leaf.phase = dice.between (0.0, kTurn);
  if (dice.between (0.0, 1.0) < 0.5) {
    const double speed = dice.scaled (0.03, 1.5);
    const double way = dice.between (0.0, kTurn);
    leaf.vx = speed * std::cos (way);
    leaf.vy = speed * std::sin (way);
  }
  return leaf;
}

void
put_leaf (const Leaf &leaf, double left, double top, int size,
    std::vector<double> &light)
{
  const double reach = leaf.radius + 1.0;
  const auto from = [] (double at) { return std::max (0, int (at)); };
  const auto to = [size] (double at) { return std::min (size, int (at) + 2); };
  for (int y = from (top - reach); y < to (top + reach); y++) {
    for (int x = from (left - reach); x < to (left + reach); x++) {
      const double dx = x - left, dy = y - top;
      const double inside = coverage (leaf.radius - std::hypot (dx, dy));
      double &at = light[std::size_t (y * size + x)];
      const double grey =
          leaf.grey + leaf.wave * std::cos (leaf.wave_x * dx +
                                            leaf.wave_y * dy + leaf.phase);
      at = blend (at, grey, inside);
    }
  }
}

} // namespace

Scene
leaves_scene (unsigned seed, int size, int frames)
{
  constexpr int kLeaves = 1200;
  Dice dice (seed);
  const double speed = dice.scaled (0.03, 2.5);
  const double way = dice.between (0.0, kTurn);
  std::vector<Leaf> leaves;
  for (int i = 0; i < kLeaves; i++)
    leaves.push_back (draw_leaf (dice, size));

  Scene scene{"leaves", {}};
  for (int t = 0; t < frames; t++) {
    std::vector<double> light (std::size_t (size * size), 110.0);
    for (const Leaf &leaf : leaves)
      put_leaf (leaf, leaf.x + (leaf.vx + speed * std::cos (way)) * t,
          leaf.y + (leaf.vy + speed * std::sin (way)) * t, size, light);
    Picture picture (size, size);
    for (int y = 0; y < size; y++)
      for (int x = 0; x < size; x++)
        picture.at (x, y) = std::uint8_t (std::lround (
            std::clamp (light[std::size_t (y * size + x)], 0.0, 255.0)));
    scene.frames.push_back (std::move (picture));
  }
  return scene;
}

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

} // namespace codedexposure::quality
