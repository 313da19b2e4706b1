/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/processing.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "base/pixels.h"
#include "base/statistics.h"
#include "bench/random.h"

namespace codedexposure
{

namespace
{

using std::numbers::pi;

/** In -1..1, of a point of a grid. */
double
drawn_at (std::uint64_t seed, std::int64_t x, std::int64_t y)
{
  const Philox::Words words = Philox::draw (
      {std::uint32_t (x), std::uint32_t (y), std::uint32_t (x >> 32), 0x7E27},
      {std::uint32_t (seed), std::uint32_t (seed >> 32)});
  return (words[0] + 0.5) * 0x1p-31 - 1.0;
}

} // namespace

std::vector<std::uint16_t>
response_table (int largest, double gamma, bool contrast)
{
  std::vector<std::uint16_t> table;
  for (int value = 0; value <= largest; value++) {
    double part = std::pow (double (value) / largest, gamma);
    if (contrast)
      part -= 0.08 * std::sin (2.0 * pi * part);
    table.push_back (std::uint16_t (std::lround (largest * part)));
  }
  return table;
}

void
look_at_target (
    const SickBenchOptions &options, double seconds, ImageView<float> light)
{
  constexpr int kBlob = 8; // pixels between points of the grid
  /* Of numbers in -1..1, between which is interpolated. */
  const double rms = 2.0 / 3.0 / std::sqrt (3.0);
  const double shift = options.moving * seconds;
  const auto first = std::int64_t (std::floor (-shift / kBlob));
  const auto points = [&] (std::int64_t row) {
    std::vector<double> drawn;
    for (int i = 0; i < light.width / kBlob + 3; i++)
      drawn.push_back (drawn_at (options.seed, first + i, row));
    return drawn;
  };
  std::vector<double> above, below = points (0);
  for (int y = 0; y < light.height; y++) {
    if (y % kBlob == 0)
      above = std::exchange (below, points (y / kBlob + 1));
    const double down = double (y % kBlob) / kBlob;
    for (int x = 0; x < light.width; x++) {
      const double u = (x - shift) / kBlob;
      const double column = std::floor (u), right = u - column;
      const auto i = std::size_t (std::int64_t (column) - first);
      const double blob =
          (1 - down) * ((1 - right) * above[i] + right * above[i + 1]) +
          down * ((1 - right) * below[i] + right * below[i + 1]);
      light.at (x, y) *=
          float (std::max (0.0, 1.0 + options.texture * blob / rms));
    }
  }
}

void
filter_colours (ImageView<float> light)
{
  constexpr float kColours[2][2] = {{0.55f, 1.0f}, {1.0f, 0.4f}};
  each_pixel (
      light, [&] (int x, int y) { light.at (x, y) *= kColours[y % 2][x % 2]; });
}

Processing::Processing (const SickBenchOptions &options)
    : options_ (options), largest_ (largest_pixel (options.bits))
{
  if (options.gamma != 1.0 || options.lut)
    table_ = response_table (largest_, options.gamma, options.lut);
}

/* The next frames get nearer to the mean that is to be kept. */
void
Processing::follow (ImageView<std::uint16_t> picture)
{
  const double mean = (mean_of (ImageView<const std::uint16_t> (picture)) -
                          options_.black_level) /
                      largest_;
  const auto factor = [mean] (double wanted) {
    return std::sqrt (std::clamp (wanted / std::max (mean, 1e-3), 0.5, 2.0));
  };
  if (options_.auto_gain > 0.0)
    gain_ = std::clamp (gain_ * factor (options_.auto_gain), 0.25, 16.0);
  if (options_.auto_exposure > 0.0)
    exposure_ =
        std::clamp (exposure_ * factor (options_.auto_exposure), 0.01, 1.0);
}

/* A dark frame without noise; what would be negative becomes 0. */
void
Processing::subtract_dark (ImageView<std::uint16_t> picture) const
{
  const int black = int (std::lround (options_.black_level));
  each_pixel (picture, [&] (int x, int y) {
    picture.at (x, y) =
        std::uint16_t (std::max (int (picture.at (x, y)) - black, 0));
  });
}

/* @part of the mean of 3x3 pixels, and the rest of the pixel itself. */
void
Processing::mix (ImageView<std::uint16_t> picture, double part) const
{
  Image<std::uint16_t> old (picture.width, picture.height);
  each_pixel (old, [&] (int x, int y) { old.at (x, y) = picture.at (x, y); });
  each_pixel (old, [&] (int x, int y) {
    int sum = 0;
    for (int dy = -1; dy <= 1; dy++)
      for (int dx = -1; dx <= 1; dx++)
        sum += old.at (std::clamp (x + dx, 0, picture.width - 1),
            std::clamp (y + dy, 0, picture.height - 1));
    const double mixed = part * sum / 9.0 + (1.0 - part) * old.at (x, y);
    picture.at (x, y) =
        std::uint16_t (std::clamp<long> (std::lround (mixed), 0, largest_));
  });
}

void
Processing::apply (ImageView<std::uint16_t> picture)
{
  const SickBenchOptions &o = options_;
  if (o.has ("test-image"))
    each_pixel (picture, [&] (int x, int y) {
      picture.at (x, y) = std::uint16_t (x * largest_ / picture.width);
    });
  if (o.dark_subtraction)
    subtract_dark (picture);
  if (o.noise_reduction > 0.0)
    mix (picture, o.noise_reduction);
  if (o.sharpening > 0.0)
    mix (picture, -o.sharpening);
  if (o.auto_gain > 0.0 || o.auto_exposure > 0.0)
    follow (picture);
  const int shift = o.low_bits > 0 ? o.bits - o.low_bits : 0;
  const auto kept = std::uint16_t (~0u << o.missing_bits);
  if (table_.empty () && o.missing_bits == 0 && shift == 0)
    return;
  each_pixel (picture, [&] (int x, int y) {
    std::uint16_t &pixel = picture.at (x, y);
    pixel = std::uint16_t (
        (kept & (table_.empty () ? pixel : table_[pixel])) >> shift);
  });
}

} // namespace codedexposure
