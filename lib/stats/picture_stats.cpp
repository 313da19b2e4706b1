/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "stats/picture_stats.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "base/pixels.h"
#include "base/try.h"

namespace codedexposure
{

namespace
{

/* Equal neighbours, as in flat parts of a picture, would wait for each other at
 * one counter, so that bytes have several. Several counts of 16-bit levels
 * would not fit into the cache. */
template <typename Pixel>
void
count_levels (
    ImageView<const Pixel> picture, std::vector<std::uint32_t> &counts)
{
  constexpr std::size_t kLevels =
      std::size_t (std::numeric_limits<Pixel>::max ()) + 1;
  constexpr std::size_t kSide = sizeof (Pixel) == 1 ? 4 : 1;
  const auto width = std::size_t (picture.width);
  counts.assign (kSide * kLevels, 0u);
  for (int y = 0; y < picture.height; y++) {
    const Pixel *row = picture.row (y);
    std::size_t x = 0;
    for (; x + kSide <= width; x += kSide)
      for (std::size_t i = 0; i < kSide; i++)
        counts[i * kLevels + row[x + i]]++;
    for (; x < width; x++)
      counts[row[x]]++;
  }
  for (std::size_t i = 1; i < kSide; i++)
    for (std::size_t v = 0; v < kLevels; v++)
      counts[v] += counts[i * kLevels + v];
  counts.resize (kLevels);
}

} // namespace

Result<StatsMeter>
StatsMeter::make (Extent size, int depth, const StatsOptions &options)
{
  if (size.width < 1 || size.height < 1)
    return Error{"a picture of " + size_text (size) + " has no statistics"};
  if (options.bits < 0 || options.bits > depth)
    return Error{"bits = " + std::to_string (options.bits) +
                 " is out of range; a pixel has 1 to " +
                 std::to_string (depth) + ", 0 means all"};
  if (options.bins < 0)
    return Error{"a histogram cannot have " + std::to_string (options.bins) +
                 " bins; 0 leaves it out"};
  StatsMeter meter;
  meter.bits_ = options.bits > 0 ? options.bits : depth;
  if (options.line) {
    ASSIGN_OR_RETURN (meter.points_, options.line->points (size));
  }
  meter.stats_.pixels =
      std::uint64_t (size.width) * std::uint64_t (size.height);
  meter.stats_.histogram.resize (
      std::size_t (std::min (options.bins, 1 << meter.bits_)));
  meter.stats_.profile.resize (meter.points_.size ());
  return meter;
}

/* Entropy: -sum p log p with p = c / N is log N - (sum c log c) / N. */
void
StatsMeter::summarise ()
{
  const auto largest = std::size_t (largest_pixel (bits_));
  const auto occurs = [] (std::uint32_t count) { return count > 0; };
  const auto first = std::ranges::find_if (levels_, occurs);
  stats_.minimum = unsigned (first - levels_.begin ());
  stats_.saturated = 0;
  double sum = 0.0, weighed = 0.0;
  for (std::size_t v = stats_.minimum; v < levels_.size (); v++) {
    if (!occurs (levels_[v]))
      continue;
    const double count = levels_[v];
    stats_.maximum = unsigned (v);
    sum += count * double (v);
    weighed += count * std::log2 (count);
    if (v >= largest)
      stats_.saturated += levels_[v];
  }
  const auto pixels = double (stats_.pixels);
  stats_.mean = sum / pixels;
  stats_.entropy = std::max (0.0, std::log2 (pixels) - weighed / pixels);
}

void
StatsMeter::fill_histogram ()
{
  std::vector<std::uint64_t> &histogram = stats_.histogram;
  if (histogram.empty ())
    return;
  std::ranges::fill (histogram, 0u);
  const auto largest = std::size_t (largest_pixel (bits_));
  for (std::size_t v = stats_.minimum; v <= stats_.maximum; v++) {
    const std::size_t bin =
        (std::min (v, largest) * histogram.size ()) >> bits_;
    histogram[bin] += levels_[v];
  }
}

template <typename Pixel>
const PictureStats &
StatsMeter::measure (ImageView<const Pixel> picture)
{
  count_levels (picture, levels_);
  summarise ();
  fill_histogram ();
  std::ranges::transform (points_, stats_.profile.begin (),
      [&] (Position at) { return value_at (picture, at); });
  return stats_;
}

template const PictureStats &StatsMeter::measure (
    ImageView<const std::uint8_t>);
template const PictureStats &StatsMeter::measure (
    ImageView<const std::uint16_t>);

} // namespace codedexposure
