/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A moving scene before two cameras, one in each beam of the mirrors. */
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "bench/bench.h"
#include "preset.h"

namespace codedexposure::test::two_beams
{

using Pictures = std::vector<Image<std::uint8_t>>;

inline constexpr int kWidth = 64, kHeight = 48;
inline constexpr const char *kPreset = "sequential:lattice:4/2";

/* Edges and gratings that move by @speed px a slot. */
inline Image<std::uint8_t>
scene (double slot, double speed)
{
  Image<std::uint8_t> image (kWidth, kHeight);
  for (int y = 0; y < kHeight; y++)
    for (int x = 0; x < kWidth; x++) {
      const double at = x - speed * slot;
      const double waves = std::sin (0.8 * at + 0.5 * y) + std::cos (1.1 * y);
      const bool bright =
          (int (std::floor (at / 9.0)) + int (y / 7.0)) % 2 != 0;
      image.at (x, y) = std::uint8_t (
          std::lround (127.0 + 30.0 * waves + (bright ? 40.0 : -40.0)));
    }
  return image;
}

/* Clouds, nowhere the same, that move by @speed px a slot. */
inline Image<std::uint8_t>
clouds (Extent size, double slot, double speed)
{
  constexpr double kSide = 6.0;
  const auto node = [] (int i, int j) {
    return double (
        (std::uint32_t (i) * 2654435761u ^ std::uint32_t (j) * 2246822519u) *
            3266489917u >>
        24);
  };
  Image<std::uint8_t> image (size.width, size.height);
  for (int y = 0; y < size.height; y++)
    for (int x = 0; x < size.width; x++) {
      const double u = (x - speed * slot) / kSide + 1000.0, v = y / kSide;
      const int i = int (u), j = int (v);
      const double above = std::lerp (node (i, j), node (i + 1, j), u - i);
      const double below =
          std::lerp (node (i, j + 1), node (i + 1, j + 1), u - i);
      image.at (x, y) = std::uint8_t (std::lerp (above, below, v - j));
    }
  return image;
}

inline Pictures
truth (int frames, int slots, double speed)
{
  Pictures all;
  for (int s = 0; s < frames * slots; s++)
    all.push_back (scene (s, speed));
  return all;
}

inline Pictures
moving_clouds (Extent size, int count, double speed)
{
  Pictures all;
  for (int s = 0; s < count; s++)
    all.push_back (clouds (size, s, speed));
  return all;
}

/* What a camera sees of @slots through the masks of @schedule. */
inline Pictures
coded (const Schedule &schedule, const Pictures &slots,
    const BenchOptions &options = {})
{
  const int width = slots.front ().width (), height = slots.front ().height ();
  auto bench = OpticalBench::make (width, height, options).value ();
  Pictures frames;
  const auto n = std::size_t (schedule.slots ());
  for (std::size_t at = 0; at < slots.size (); at += n) {
    bench.begin (schedule);
    for (std::size_t s = 0; s < n; s++)
      bench.expose (slots[at + s].view (), int (s), 1.0);
    auto &frame = frames.emplace_back (width, height);
    bench.read_out (frames.size () - 1, frame.view ());
  }
  return frames;
}

} // namespace codedexposure::test::two_beams
