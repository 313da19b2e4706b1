/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames of a camera that stands askew, and their rectification. */
#pragma once

#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

#include "bench/bench.h"
#include "rectify/rectifier.h"

namespace codedexposure::test::misaligned
{

inline constexpr Extent kSize = {96, 64};

inline Schedule
schedule_of (const char *preset)
{
  return *Schedule::from_preset (preset);
}

inline Mapping
mapping_of (const Alignment &alignment, double psf_sigma = 0.0)
{
  Mapping::Parts parts = {
      kSize, kSize, camera_to_mirrors (alignment, kSize.width, kSize.height)};
  parts.psf_sigma = psf_sigma;
  return *Mapping::make (parts);
}

/** A coded frame of a scene whose brightness changes smoothly in space and
 * from slot to slot. */
inline Image<std::uint8_t>
coded (const Alignment &alignment, const Schedule &schedule,
    double psf_sigma = 0.0, int texture = 1, double full_well = 0.0)
{
  BenchOptions options;
  options.full_well = full_well;
  options.alignment = alignment;
  options.psf_sigma = psf_sigma;
  auto bench = OpticalBench::make (kSize.width, kSize.height, options);
  bench->begin (schedule);
  Image<std::uint8_t> scene (kSize.width, kSize.height);
  for (int slot = 0; slot < schedule.slots (); slot++) {
    for (int y = 0; y < kSize.height; y++)
      for (int x = 0; x < kSize.width; x++)
        scene.at (x, y) = std::uint8_t (std::lround (
            100 + texture * (40 * std::sin (0.15 * x + 0.1 * y + 0.8 * slot) +
                                15 * slot)));
    bench->expose (std::as_const (scene).view (), slot, 1.0);
  }
  Image<std::uint8_t> frame (kSize.width, kSize.height);
  bench->read_out (0, frame.view ());
  return frame;
}

inline Image<std::uint8_t>
rectified (const Rectifier &rectifier, const Image<std::uint8_t> &frame)
{
  Image<std::uint8_t> mirrors (
      rectifier.mirrors ().width, rectifier.mirrors ().height);
  EXPECT_TRUE (rectifier.run (frame.view (), mirrors.view ()));
  return mirrors;
}

inline double
rms (const Image<std::uint8_t> &a, const Image<std::uint8_t> &b, int border)
{
  double squares = 0.0, count = 0.0;
  for (int y = border; y < a.height () - border; y++)
    for (int x = border; x < a.width () - border; x++) {
      squares += std::pow (double (a.at (x, y)) - double (b.at (x, y)), 2);
      count += 1.0;
    }
  return std::sqrt (squares / count);
}

/** For frames without noise. */
inline Rectifier
made (const Mapping &mapping, const Schedule &schedule)
{
  auto rectifier = Rectifier::make (mapping, schedule, {.noise = 0.001});
  EXPECT_TRUE (rectifier.ok ()) << rectifier.error ().message;
  return std::move (*rectifier);
}

} // namespace codedexposure::test::misaligned
