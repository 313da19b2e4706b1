/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/level.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <vector>

namespace codedexposure
{

namespace
{

/** Part of the differences of neighbours that are hot or dead pixels, dust and
 * borders of the mirrors at most. */
constexpr double kOdd = 0.02;

/** Index below which @p part of the counts are. */
int
quantile (const std::vector<int> &counts, double part)
{
  double all = 0.0, sum = 0.0;
  for (const int count : counts)
    all += count;
  for (std::size_t i = 0; i < counts.size (); i++) {
    sum += counts[i];
    if (sum >= part * all)
      return int (i);
  }
  return int (counts.size ()) - 1;
}

} // namespace

Level
level_of (ImageView<const std::uint16_t> picture, int largest)
{
  Level level;
  if (picture.width < 1 || picture.height < 1)
    return level;
  std::vector<int> counts (std::size_t (largest) + 1);
  std::vector<int> differences (std::size_t (largest) + 1);
  for (int y = 0; y < picture.height; y++) {
    const std::uint16_t *row = picture.row (y);
    int before = std::min (int (row[0]), largest);
    for (int x = 0; x < picture.width; x++) {
      const int value = std::min (int (row[x]), largest);
      level.bits_seen = std::uint16_t (level.bits_seen | value);
      counts[std::size_t (value)]++;
      differences[std::size_t (std::abs (value - before))] += x > 0;
      before = value;
    }
  }
  const double pixels = double (picture.width) * picture.height;
  for (std::size_t i = 0; i < counts.size (); i++)
    level.mean += double (i) * counts[i] / pixels;
  level.saturated = counts.back () / pixels;
  const int usual = quantile (differences, 1.0 - kOdd);
  double squares = 0.0, number = 0.0;
  for (int d = 0; d <= usual; d++) {
    squares += double (d) * d * differences[std::size_t (d)];
    number += differences[std::size_t (d)];
  }
  level.noise = number > 0.0 ? std::sqrt (squares / number / 2.0) : 0.0;
  return level;
}

double
rounding_doubt (double noise, int step)
{
  using std::numbers::pi;
  // The first harmonic of the error of rounding, which Gaussian noise damps.
  // Between coarse steps, two values alone vary by as much as a quarter of
  // their square, and may hide that there is no noise.
  const double hidden = step > 1 ? 0.25 : 1.0 / 12.0;
  const double of_rounding = hidden * step * step;
  const double before =
      std::max (noise * noise - of_rounding, 0.0) / (double (step) * step);
  return std::min (step / std::sqrt (12.0),
      step / (pi * std::numbers::sqrt2) * std::exp (-2.0 * pi * pi * before));
}

} // namespace codedexposure
