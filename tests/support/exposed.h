/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Simulated benches, scenes, and their coded frames. */
#pragma once

#include <functional>
#include <utility>

#include <gtest/gtest.h>

#include "bench/bench.h"

namespace codedexposure::test
{

inline Schedule
schedule (const char *preset)
{
  Result<Schedule> parsed = Schedule::from_preset (preset);
  EXPECT_TRUE (parsed) << parsed.error ().message;
  return *parsed;
}

inline OpticalBench
bench (int width, int height, const BenchOptions &options = {})
{
  Result<OpticalBench> made = OpticalBench::make (width, height, options);
  EXPECT_TRUE (made) << made.error ().message;
  return std::move (*made);
}

/* Scenes that differ in every pixel and slot. */
template <typename Pixel>
Image<Pixel>
scene (int width, int height, int slot)
{
  Image<Pixel> image (width, height);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      image.at (x, y) =
          Pixel (x * 7919 + y * 104729 + slot * 15485863 + x * y * slot);
  return image;
}

template <typename Pixel>
Image<Pixel>
flat (int width, int height, Pixel value)
{
  Image<Pixel> image (width, height);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      image.at (x, y) = value;
  return image;
}

/* One coded frame of a scene that changes with every slot. */
template <typename Pixel>
Image<Pixel>
coded_frame (OpticalBench &bench, const Schedule &schedule, int width,
    int height, const std::function<Image<Pixel> (int slot)> &scene_of)
{
  Image<Pixel> coded (width, height);
  bench.begin (schedule);
  for (int slot = 0; slot < schedule.slots (); slot++)
    bench.expose (scene_of (slot).view (), slot, 1.0);
  bench.read_out (0, coded.view ());
  return coded;
}

inline Image<std::uint8_t>
still (OpticalBench &bench, const Schedule &schedule,
    const Image<std::uint8_t> &picture)
{
  return coded_frame<std::uint8_t> (bench, schedule, picture.width (),
      picture.height (), [&] (int) { return picture; });
}

} // namespace codedexposure::test
