/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Errors and statistics of pictures. */
#include "metrics.h"

#include <array>
#include <cmath>
#include <limits>

namespace codedexposure::quality
{

namespace
{

using Histogram = std::array<std::uint64_t, 256>;

Histogram
histogram_of (ImageView<const std::uint8_t> image)
{
  Histogram counts{};
  for (int y = 0; y < image.height; y++) {
    for (int x = 0; x < image.width; x++)
      counts[image.at (x, y)]++;
  }
  return counts;
}

double
pixels_of (ImageView<const std::uint8_t> image)
{
  return double (image.width) * image.height;
}

} // namespace

double
PooledError::psnr () const
{
  if (sum_ == 0.0)
    return std::numeric_limits<double>::infinity ();
  return 10.0 * std::log10 (255.0 * 255.0 * double (count_) / sum_);
}

double
mean_of (ImageView<const std::uint8_t> image)
{
  const Histogram counts = histogram_of (image);
  double sum = 0.0;
  for (std::size_t v = 0; v < counts.size (); v++)
    sum += double (v) * double (counts[v]);
  return sum / pixels_of (image);
}

double
deviation_of (ImageView<const std::uint8_t> image)
{
  const Histogram counts = histogram_of (image);
  const double mean = mean_of (image);
  double sum = 0.0;
  for (std::size_t v = 0; v < counts.size (); v++)
    sum += (double (v) - mean) * (double (v) - mean) * double (counts[v]);
  return std::sqrt (sum / pixels_of (image));
}

double
entropy_of (ImageView<const std::uint8_t> image)
{
  double bits = 0.0;
  for (const std::uint64_t count : histogram_of (image)) {
    const double p = double (count) / pixels_of (image);
    if (count > 0)
      bits -= p * std::log2 (p);
  }
  return bits;
}

} // namespace codedexposure::quality
