/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Cost of moirecalib for a frame of 768x576: the streaming thread with and
 * without the overlay, the reading of the fringes and the drawing of the panel;
 * and the cost of its mapping, once and for each frame. */
#include <benchmark/benchmark.h>

#include "../quality/must.h"
#include "bench/lens.h"
#include "calibrate/gratings.h"
#include "calibrate/live_moire.h"
#include "common/elements.h"
#include "common/meta.h"
#include "harness.h"
#include "moirecalib/panel.h"
#include "rectify/rectifier.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

constexpr Extent kSize{768, 576};

template <typename Pixel>
Image<Pixel>
grating ()
{
  const Pattern pattern = live_grating ();
  return draw<Pixel> (kSize.width, kSize.height, [&] (int x, int y) {
    return (pattern.on (x, y) ? 150 : 10) * (sizeof (Pixel) == 1 ? 1 : 257);
  });
}

/* Wall time of the streaming thread, which never waits for the worker. */
template <typename Pixel>
void
push_frames (benchmark::State &state, const char *overlay)
{
  ElementHarness h (
      "moirecalib pattern=grating-both:4/0 overlay=" + std::string (overlay));
  gst_harness_set_drop_buffers (h.get (), TRUE);
  h.set_caps (gray_caps (kSize.width, kSize.height, "25/1",
      sizeof (Pixel) == 1 ? "GRAY8" : "GRAY16_LE"));
  const BufferPtr picture = frame_of (grating<Pixel> (), 0);
  for (auto _ : state) {
    state.PauseTiming ();
    BufferPtr copy (gst_buffer_copy_deep (picture.get ()));
    while (h.message (GST_MESSAGE_ANY))
      ;
    state.ResumeTiming ();
    h.push (std::move (copy));
  }
}
void
overlay_8_bits (benchmark::State &state)
{
  push_frames<guint8> (state, "true");
}
BENCHMARK (overlay_8_bits)->Unit (benchmark::kMicrosecond);

void
overlay_16_bits (benchmark::State &state)
{
  push_frames<guint16> (state, "true");
}
BENCHMARK (overlay_16_bits)->Unit (benchmark::kMicrosecond);

void
no_overlay (benchmark::State &state)
{
  push_frames<guint8> (state, "false");
}
BENCHMARK (no_overlay)->Unit (benchmark::kMicrosecond);

void
read_fringes (benchmark::State &state)
{
  const auto picture = grating<std::uint8_t> ();
  auto live = LiveMoire::make (Mapping (kSize));
  for (auto _ : state)
    benchmark::DoNotOptimize (live->solve (picture.view ()).ok ());
}
BENCHMARK (read_fringes)->Unit (benchmark::kMicrosecond);

void
draw_all (benchmark::State &state)
{
  Fringes fringes{Image<float> (192, 144), Image<float> (192, 144)};
  PanelContent content{.title = "coarse",
      .lines = {"one line of numbers", "another", "a third", "a fourth"},
      .correction = correct_stage (Mapping (kSize), {})};
  content.correction->state = CalibrationStage::coarse;
  content.correction->stage_x = 10.0;
  content.fringes_x = content.fringes_y = &fringes;
  for (auto _ : state)
    benchmark::DoNotOptimize (draw_panel (kSize, content).opaque.size ());
}
BENCHMARK (draw_all)->Unit (benchmark::kMicrosecond);

constexpr Alignment kAskew{0.4, 0.4, 0.5, 1.01}, kAligned;

Mapping
mapping_of (const Alignment &alignment)
{
  Mapping::Parts parts = {
      kSize, kSize, camera_to_mirrors (alignment, kSize.width, kSize.height)};
  parts.psf_sigma = 0.5;
  return *Mapping::make (parts);
}

void
follow_mapping (benchmark::State &state)
{
  const Mapping mapping = mapping_of (kAskew);
  for (auto _ : state)
    benchmark::DoNotOptimize (Rectifier::make (mapping, Schedule ()).ok ());
}
BENCHMARK (follow_mapping)->Unit (benchmark::kMillisecond);

template <typename Pixel, const Alignment &alignment>
void
rectify (benchmark::State &state)
{
  const auto rectifier = Rectifier::make (mapping_of (alignment), Schedule ());
  const auto picture = grating<Pixel> ();
  auto mirrors = picture;
  for (auto _ : state)
    quality::must (rectifier->run (picture.view (), mirrors.view ()));
}
BENCHMARK (rectify<std::uint8_t, kAskew>)->Unit (benchmark::kMillisecond);
BENCHMARK (rectify<std::uint16_t, kAskew>)->Unit (benchmark::kMillisecond);
BENCHMARK (rectify<std::uint8_t, kAligned>)->Unit (benchmark::kMillisecond);
BENCHMARK (rectify<std::uint16_t, kAligned>)->Unit (benchmark::kMillisecond);

} // namespace

int
main (int argc, char **argv)
{
  gst_init (&argc, &argv);
  gst::register_meta (gst::kFrameMetaName);
  GST_ELEMENT_REGISTER (moirecalib, nullptr);
  benchmark::Initialize (&argc, argv);
  benchmark::RunSpecifiedBenchmarks ();
  return 0;
}
