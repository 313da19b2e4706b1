/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Speed of codedexposure-sim compared with real time: 768x576, 100 to 25
 * frames/s. */
#include <benchmark/benchmark.h>

#include "common/elements.h"
#include "sim_harness.h"

namespace
{

using namespace codedexposure::test;

void
coded_frames (benchmark::State &state, const char *properties)
{
  SimHarness sim (properties);
  sim.start (768, 576);
  const auto scene = draw<std::uint8_t> (
      768, 576, [] (int x, int y) { return (x * 83 + y * 57) & 255; });
  const BufferPtr input = frame_of (scene, 0);
  int k = 0;
  for (auto _ : state) {
    for (int slot = 0; slot < 4; slot++) {
      BufferPtr frame (gst_buffer_copy (input.get ()));
      GST_BUFFER_PTS (frame.get ()) = sim.time (k++);
      sim.push (std::move (frame));
    }
    if (!sim.pull ())
      state.SkipWithError ("no coded frame");
  }
  state.counters["x_real_time"] = benchmark::Counter (
      double (state.iterations ()) / 25, benchmark::Counter::kIsRate);
}

BENCHMARK_CAPTURE (coded_frames, ideal, "");
BENCHMARK_CAPTURE (
    coded_frames, blur_and_noise, "psf-sigma=0.5 full-well=10000 read-noise=5");
BENCHMARK_CAPTURE (coded_frames, misaligned,
    "psf-sigma=0.5 full-well=10000 read-noise=5 shift-x=0.3 rotation=0.5 "
    "scale=1.01");

} // namespace

int
main (int argc, char **argv)
{
  gst_init (&argc, &argv);
  GST_ELEMENT_REGISTER (codedexposure_sim, nullptr);
  benchmark::Initialize (&argc, argv);
  benchmark::RunSpecifiedBenchmarks ();
  return 0;
}
