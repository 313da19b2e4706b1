/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Dark liquid that is poured into a glass of clear liquid. */
#include <vector>

#include "bench/scene_parts.h"

namespace codedexposure
{

namespace
{

constexpr double kGravity = 39.0;   // heights/s^2: the picture is 25 cm high
constexpr double kSpeed = 0.9;      // of the jet at the top, heights/s
constexpr double kJetWidth = 0.022; // half of it, at the top
constexpr double kStart = 0.04;     // seconds until it comes into view
constexpr double kGlass = 0.30;     // half of the glass's width
constexpr double kFloor = 0.95;
constexpr double kSurface = 0.46;
constexpr int kPuffs = 160;
constexpr double kPuffsEvery = 0.0125; // seconds
constexpr int kDrops = 36;

/* A number in [0, 1) that belongs to a pair of whole numbers. */
double
chance (int index, int purpose)
{
  auto h = std::uint32_t (index) * 0x9E3779B9u ^
           std::uint32_t (purpose) * 0x85EBCA6Bu;
  h = (h ^ (h >> 16)) * 0x7FEB352Du;
  h = (h ^ (h >> 15)) * 0x846CA68Bu;
  return double (h ^ (h >> 16)) * 0x1p-32;
}

/* When the front of the jet is at that place. */
double
arrival (double y)
{
  return kStart +
         (std::sqrt (kSpeed * kSpeed + 2.0 * kGravity * y) - kSpeed) / kGravity;
}

class Pour : public SyntheticScene
{
public:
  explicit Pour (Extent size)
      : frame_{size}, lamp_ (size.width, size.height),
        dye_ (size.width, size.height), across_ (std::size_t (size.width)),
        glass_ (std::size_t (size.width)), top_ (std::size_t (size.width))
  {
    for (int y = 0; y < size.height; y++)
      for (int x = 0; x < size.width; x++)
        lamp_.at (x, y) = lamp (frame_.at (x, y));
    for (int x = 0; x < size.width; x++)
      glass_[std::size_t (x)] =
          0.90 - 0.25 * std::exp (-(kGlass - beside (x)) / 0.012);
  }

  void draw (double t, ImageView<float> light) override
  {
    const ImageView<float> dye = dye_.view ();
    std::fill_n (
        dye.data, std::size_t (dye.width) * std::size_t (dye.height), 0.0f);
    add_jet (t, dye);
    for (int i = 0; i < kPuffs; i++)
      add_puff (i, t, dye);
    for (int i = 0; i < kDrops; i++)
      add_drop (i, t, dye);
    for (int x = 0; x < light.width; x++)
      top_[std::size_t (x)] = surface (frame_.at (x, 0).x, t);
    for (int y = 0; y < light.height; y++) {
      const double *lamp = lamp_.view ().row (y);
      for (int x = 0; x < light.width; x++) {
        const float seen = float (lamp[x] * through (x, y));
        const float dark = dye.at (x, y);
        light.at (x, y) = dark > 0.0f ? seen * std::exp (-dark) : seen;
      }
    }
  }

private:
  /* Waves run from the jet to the walls once it has hit the liquid. */
  static double surface (double x, double t)
  {
    const double since = t - arrival (kSurface);
    if (since <= 0.0)
      return kSurface;
    const double there = smooth_step (0.0, 0.1, since - std::abs (x) / 2.0);
    return kSurface - 0.015 * std::min (since, 2.0) +
           0.012 * there * std::exp (-std::abs (x) / 0.2) *
               swing (since, 9.0, -std::abs (x) / 0.11);
  }

  double beside (int x) const { return std::abs (frame_.at (x, 0).x); }

  /* A bright screen behind. */
  static double lamp (Position at)
  {
    const double off = at.y - 0.5;
    return 0.8 / (1.0 + 0.32 * (at.x * at.x + off * off)) +
           0.02 * std::sin (at.x * 60.0);
  }

  /* The part of its light that glass and liquid pass. */
  double through (int x, int y) const
  {
    constexpr double kEdge = 0.006;
    constexpr double kNoEdge = 40.0 * kEdge; // exp (-40) changes no light
    const double down = frame_.at (0, y).y;
    const double out = beside (x);
    const double top = top_[std::size_t (x)];
    double light = 1.0;
    if (out < kGlass && down > top && down < kFloor) {
      light = glass_[std::size_t (x)];
      if (down - top < kNoEdge)
        light -= 0.45 * std::exp (-(down - top) / kEdge);
    }
    const bool wall = std::abs (out - kGlass) < 0.007 && down > 0.3;
    const bool bottom = out < kGlass && down > kFloor && down < 0.97;
    return wall || bottom ? 0.45 * light : light;
  }

  /* Falls freely, becomes thinner as it becomes faster, and swells in waves
   * that travel with it. */
  void add_jet (double t, ImageView<float> dye) const
  {
    for (int y = 0; y < frame_.row (kSurface + 0.02); y++) {
      const double down = frame_.at (0, y).y;
      const double since = t - arrival (down);
      if (since <= 0.0)
        continue;
      const double speed = std::sqrt (kSpeed * kSpeed + 2 * kGravity * down);
      const double wave = swing (since, 28.0) * std::min (1.0, 4.0 * down);
      const double width =
          kJetWidth * std::sqrt (kSpeed / speed) * (1.0 + 0.22 * wave);
      const double middle = 0.012 * down * swing (since, 3.0);
      for (int x = frame_.column (middle - width - 0.01);
           x < frame_.column (middle + width + 0.01); x++) {
        const double out = std::abs (frame_.at (x, y).x - middle);
        dye.at (x, y) += float (
            2.6 * (1.0 - smooth_step (width - 0.003, width + 0.003, out)));
      }
    }
  }

  /* A puff of dye sinks ever more slowly, drifts aside, grows and thins. */
  void add_puff (int i, double t, ImageView<float> dye)
  {
    const double age = t - arrival (kSurface) - i * kPuffsEvery;
    if (age <= 0.0)
      return;
    const double depth = 0.16 + 0.30 * chance (i, 1);
    const double aside = 0.50 * (chance (i, 2) - 0.5);
    const double gone = 1.0 - std::exp (-age / 0.22);
    const double y = kSurface + std::min (depth * gone, kFloor - kSurface) +
                     0.02 * swing (age, 2.0, chance (i, 3)) * gone;
    const double x =
        aside * gone * gone +
        0.03 * swing (age, 1.5 + chance (i, 4), chance (i, 5)) * gone;
    const double radius = 0.012 + 0.055 * (1.0 - std::exp (-age / 0.8));
    add_blot ({x, std::min (y, kFloor - 0.3 * radius)}, radius,
        1.1 * 0.012 * 0.012 / (radius * radius) * 6.0, dye);
  }

  /* Drops that the splash throws up fall back into the liquid. */
  void add_drop (int i, double t, ImageView<float> dye)
  {
    const double age =
        t - arrival (kSurface) - 0.02 * (i / 3) - 0.01 * chance (i, 6);
    if (age <= 0.0)
      return;
    const double x = (chance (i, 7) - 0.5) * 1.4 * age;
    const double y = kSurface - (1.6 + 2.2 * chance (i, 8)) * age +
                     0.5 * kGravity * age * age;
    if (y < kSurface && std::abs (x) < kGlass)
      add_blot ({x, y}, 0.005 + 0.004 * chance (i, 9), 2.2, dye);
  }

  /* A round blot: the product of one bell across and one down. Nothing of it
   * is outside the liquid or the glass. */
  void add_blot (
      Position centre, double radius, double density, ImageView<float> dye)
  {
    const double reach = 2.6 * radius;
    const bool sunk = centre.y > kSurface;
    const int first = frame_.column (std::max (centre.x - reach, -kGlass));
    const int last = frame_.column (std::min (centre.x + reach, kGlass));
    const int top = frame_.row (
        sunk ? std::max (centre.y - reach, kSurface) : centre.y - reach);
    const int end = frame_.row (std::min (centre.y + reach, kFloor));
    const auto bell = [radius] (double off) {
      return float (std::exp (-off * off / (radius * radius)));
    };
    for (int x = first; x < last; x++)
      across_[std::size_t (x)] = bell (frame_.at (x, 0).x - centre.x);
    for (int y = top; y < end; y++) {
      const float down = float (density) * bell (frame_.at (0, y).y - centre.y);
      float *row = dye.row (y);
      for (int x = first; x < last; x++)
        row[x] += down * across_[std::size_t (x)];
    }
  }

  SceneFrame frame_;
  Image<double> lamp_;
  Image<float> dye_;
  std::vector<float> across_; ///< of a blot
  std::vector<double> glass_; ///< passed by glass and liquid in a column
  std::vector<double> top_;   ///< of the liquid in a column, now
};

} // namespace

std::unique_ptr<SyntheticScene>
make_pour (Extent size)
{
  return std::make_unique<Pour> (size);
}

} // namespace codedexposure
