/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Scenes, their coded frames, and what fusion makes of these. */
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

#include "bench/bench.h"
#include "fuse/fuser.h"

namespace codedexposure::test
{

template <typename Pixel = std::uint8_t>
using Pictures = std::vector<Image<Pixel>>;

inline Schedule
schedule_of (const std::string &preset)
{
  auto schedule = Schedule::parse (preset);
  EXPECT_TRUE (schedule) << schedule.error ().message;
  return *schedule;
}

template <typename Pixel = std::uint8_t>
Image<Pixel>
draw (int width, int height, const std::function<double (int, int)> &value)
{
  constexpr double kLargest = sizeof (Pixel) == 1 ? 255.0 : 65535.0;
  Image<Pixel> image (width, height);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      image.at (x, y) = Pixel (std::lround (kLargest * value (x, y)));
  return image;
}

/* Gratings of several periods, with edges. */
inline double
texture (int x, int y)
{
  const double waves =
      std::sin (0.9 * x) * std::cos (0.7 * y) + std::sin (0.31 * (x + 2 * y));
  return 0.5 + 0.2 * waves + ((x / 9 + y / 7) % 2 ? 0.08 : -0.08);
}

/* Coded frames of a scene that shows picture (slot) in each slot. */
template <typename Pixel = std::uint8_t>
Pictures<Pixel>
take (const Schedule &schedule, int frames,
    const std::type_identity_t<std::function<Image<Pixel> (int)>> &picture,
    const BenchOptions &options = {})
{
  Pictures<Pixel> coded;
  for (int frame = 0; frame < frames; frame++) {
    const Image<Pixel> first = picture (0);
    auto bench = OpticalBench::make (first.width (), first.height (), options);
    bench->begin (schedule);
    for (int s = 0; s < schedule.slots (); s++)
      bench->expose (picture (frame * schedule.slots () + s).view (), s, 1.0);
    Image<Pixel> &image = coded.emplace_back (first.width (), first.height ());
    bench->read_out (std::uint64_t (frame), image.view ());
  }
  return coded;
}

/* The first frames are @passed: they only are before the others. */
template <typename Pixel = std::uint8_t>
Pictures<Pixel>
fuse (const Pictures<Pixel> &coded, const Schedule &schedule,
    const FuseOptions &options = {}, std::size_t passed = 0)
{
  auto fuser = Fuser<Pixel>::make (
      schedule, coded[0].width (), coded[0].height (), options);
  EXPECT_TRUE (fuser) << fuser.error ().message;
  Pictures<Pixel> frames;
  auto fuse_one = [&, number = std::size_t (0)] () mutable {
    if (number++ < passed) {
      EXPECT_TRUE (fuser->pass ());
      return;
    }
    Pictures<Pixel> slots (std::size_t (fuser->slots ()),
        Image<Pixel> (fuser->size ().width, fuser->size ().height));
    std::vector<ImageView<Pixel>> views;
    for (auto &slot : slots)
      views.push_back (slot.view ());
    EXPECT_TRUE (fuser->fuse (views));
    std::move (slots.begin (), slots.end (), std::back_inserter (frames));
  };
  for (const auto &frame : coded) {
    EXPECT_TRUE (fuser->take (frame.view ()));
    if (fuser->pending () > options.lookahead)
      fuse_one ();
  }
  while (fuser->pending () > 0)
    fuse_one ();
  return frames;
}

template <typename Pixel>
double
psnr (const Image<Pixel> &a, const Image<Pixel> &b)
{
  const double scale = sizeof (Pixel) == 1 ? 1.0 : 257.0;
  double sum = 0.0;
  for (int y = 0; y < a.height (); y++)
    for (int x = 0; x < a.width (); x++)
      sum += std::pow ((a.at (x, y) - double (b.at (x, y))) / scale, 2.0);
  return 10.0 * std::log10 (255.0 * 255.0 * a.width () * a.height () /
                            std::max (sum, 1e-9));
}

inline FuseOptions
with_quality (FuseQuality quality, bool noisy = false)
{
  FuseOptions options;
  options.quality = quality;
  if (noisy)
    options.noise = {10000.0, 5.0};
  return options;
}

inline BenchOptions
noisy_bench ()
{
  BenchOptions options;
  options.full_well = 10000.0;
  options.read_noise = 5.0;
  return options;
}

/* Those that keep flat light exactly. */
inline constexpr FuseQuality kUnlearned[] = {
    FuseQuality::kFast, FuseQuality::kBalanced, FuseQuality::kBest};
inline constexpr FuseQuality kQualities[] = {FuseQuality::kFast,
    FuseQuality::kBalanced, FuseQuality::kBest, FuseQuality::kLearned};

} // namespace codedexposure::test
