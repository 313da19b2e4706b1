/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Fusion of frames of 768x576 in which everything moves: the table of speed in
 * docs/fusion-method.md. */
#include "../quality/must.h"
#include "fuse/fuser.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include <benchmark/benchmark.h>

#include "base/image.h"

namespace
{

using namespace codedexposure;

constexpr int kWidth = 768;
constexpr int kHeight = 576;
constexpr double kFrameRate = 25.0;
constexpr int kFrames = 4;

/** Waves of several lengths that move by 1.3 px per slot. */
double
scene (double x, double y, int slot)
{
  const double at = x - 1.3 * slot;
  return 128.0 + 50.0 * std::sin (0.31 * at + 0.17 * y) +
         40.0 * std::sin (0.12 * at - 0.23 * y) +
         20.0 * std::cos (0.9 * at) * std::sin (0.7 * y);
}

std::vector<Image<std::uint8_t>>
coded_frames (const Schedule &schedule)
{
  std::vector<Image<std::uint8_t>> frames;
  for (int i = 0; i < kFrames; i++) {
    auto &frame = frames.emplace_back (kWidth, kHeight);
    for (int y = 0; y < kHeight; y++)
      for (int x = 0; x < kWidth; x++) {
        double light = 0.0, slots = 0.0;
        for (int s = 0; s < schedule.slots (); s++)
          if (schedule.on (x, y, s)) {
            light += scene (x, y, i * schedule.slots () + s);
            slots++;
          }
        frame.at (x, y) = std::uint8_t (light / slots);
      }
  }
  return frames;
}

void
fuse (benchmark::State &state, const char *preset, FuseQuality quality,
    bool refine = false, bool partner = false)
{
  const Schedule schedule = Schedule::from_preset (preset).value ();
  FuseOptions options;
  options.quality = quality;
  options.refine = refine;
  options.partner = partner;
  options.threads = int (state.range (0));
  auto fuser =
      Fuser<std::uint8_t>::make (schedule, kWidth, kHeight, options).value ();
  const auto frames = coded_frames (schedule);
  const auto partners = coded_frames (schedule.complement ().value ());
  std::vector<Image<std::uint8_t>> slots (
      std::size_t (schedule.slots ()), Image<std::uint8_t> (kWidth, kHeight));
  std::vector<ImageView<std::uint8_t>> views;
  for (auto &slot : slots)
    views.push_back (slot.view ());

  std::size_t next = 0;
  const auto fuse_next = [&] {
    const std::size_t i = next++ % frames.size ();
    std::optional<ImageView<const std::uint8_t>> other;
    if (partner)
      other = partners[i].view ();
    quality::must (fuser.take (frames[i].view (), other));
    quality::must (fuser.fuse (views));
  };
  for (int i = 0; i < 2; i++) // filters of neighbours are made once
    fuse_next ();
  for (auto _ : state)
    fuse_next ();
  state.counters["x_real_time"] = benchmark::Counter (
      double (state.iterations ()) / kFrameRate, benchmark::Counter::kIsRate);
}

constexpr const char *kFour = "sequential:lattice:4/2";
constexpr const char *kEight = "sequential:lattice:8/3,order=bit-reversal";

#define FUSE_BENCHMARK(name, preset, ...)                                      \
  BENCHMARK_CAPTURE (fuse, name, preset, __VA_ARGS__)                          \
      ->ArgName ("threads")                                                    \
      ->Arg (1)                                                                \
      ->Arg (2)                                                                \
      ->MeasureProcessCPUTime ()                                               \
      ->UseRealTime ()                                                         \
      ->Unit (benchmark::kMillisecond)
FUSE_BENCHMARK (fast_4, kFour, FuseQuality::kFast);
FUSE_BENCHMARK (fast_8, kEight, FuseQuality::kFast);
FUSE_BENCHMARK (fast_both_4, kFour, FuseQuality::kFast, false, true);
FUSE_BENCHMARK (fast_both_8, kEight, FuseQuality::kFast, false, true);
FUSE_BENCHMARK (fast_refined_4, kFour, FuseQuality::kFast, true);
FUSE_BENCHMARK (fast_refined_8, kEight, FuseQuality::kFast, true);
FUSE_BENCHMARK (balanced_4, kFour, FuseQuality::kBalanced);
FUSE_BENCHMARK (balanced_8, kEight, FuseQuality::kBalanced);
FUSE_BENCHMARK (best_4, kFour, FuseQuality::kBest);
FUSE_BENCHMARK (best_8, kEight, FuseQuality::kBest);

} // namespace

BENCHMARK_MAIN ();
