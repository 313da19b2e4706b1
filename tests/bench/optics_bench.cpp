/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Speed of the simulated bench compared with real time: coded frames of 768x576
 * at 25 fps. */
#include "bench/bench.h"

#include <limits>

#include <benchmark/benchmark.h>

namespace
{

using namespace codedexposure;

constexpr int kWidth = 768;
constexpr int kHeight = 576;
constexpr double kFrameRate = 25.0;

template <typename Pixel>
Image<Pixel>
ramp ()
{
  Image<Pixel> scene (kWidth, kHeight);
  for (int y = 0; y < kHeight; y++)
    for (int x = 0; x < kWidth; x++)
      scene.at (x, y) = Pixel (
          (x * 83 + y * 57) % 256 * (std::numeric_limits<Pixel>::max () / 255));
  return scene;
}

template <typename Pixel>
void
coded_frames (benchmark::State &state, const BenchOptions &options)
{
  const Schedule schedule;
  const Image<Pixel> scene = ramp<Pixel> ();
  Image<Pixel> coded (kWidth, kHeight);
  OpticalBench bench = OpticalBench::make (kWidth, kHeight, options).value ();

  std::uint64_t frame = 0;
  for (auto _ : state) {
    bench.begin (schedule);
    for (int slot = 0; slot < schedule.slots (); slot++)
      bench.expose (scene.view (), slot, 1.0);
    bench.read_out (frame++, coded.view ());
    benchmark::DoNotOptimize (coded.view ().data);
  }
  state.counters["x_real_time"] = benchmark::Counter (
      double (state.iterations ()) / kFrameRate, benchmark::Counter::kIsRate);
}

constexpr auto gray8 = coded_frames<std::uint8_t>;
constexpr auto gray16 = coded_frames<std::uint16_t>;

BenchOptions
noisy ()
{
  BenchOptions options;
  options.psf_sigma = 0.5;
  options.full_well = 10000;
  options.read_noise = 5;
  return options;
}

BenchOptions
misaligned ()
{
  BenchOptions options = noisy ();
  options.alignment = {0.3, -0.2, 0.5, 1.01};
  return options;
}

BenchOptions
dark ()
{
  BenchOptions options = noisy ();
  options.full_well = 200;
  return options;
}

} // namespace

BENCHMARK_CAPTURE (gray8, ideal, BenchOptions ());
BENCHMARK_CAPTURE (gray8, blur_and_noise, noisy ());
BENCHMARK_CAPTURE (gray16, blur_and_noise, noisy ());
BENCHMARK_CAPTURE (gray8, misaligned, misaligned ());
BENCHMARK_CAPTURE (gray8, few_electrons, dark ());

BENCHMARK_MAIN ();
