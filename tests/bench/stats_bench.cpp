/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Cost of subframestats for a subframe of 384x288: the computation alone, and
 * with all outputs. */
#include <benchmark/benchmark.h>

#include "common/elements.h"
#include "common/meta.h"
#include "common/stats_report.h"
#include "harness.h"
#include "stats/picture_stats.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

/* A gradient with noise, as from a camera. */
template <typename Pixel>
Image<Pixel>
subframe ()
{
  return draw<Pixel> (384, 288, [] (int x, int y) {
    return ((x + y) / 3 + (x * 83 + y * 57) % 13) & 255;
  });
}

template <typename Pixel>
void
arithmetic (benchmark::State &state)
{
  const auto picture = subframe<Pixel> ();
  auto meter = StatsMeter::make ({384, 288}, 8 * int (sizeof (Pixel)),
      {.line = *ProfileLine::parse ("row:50%")});
  for (auto _ : state) {
    auto entropy = meter->measure (picture.view ()).entropy;
    benchmark::DoNotOptimize (entropy);
  }
}
BENCHMARK (arithmetic<std::uint8_t>)->Unit (benchmark::kMicrosecond);
BENCHMARK (arithmetic<std::uint16_t>)->Unit (benchmark::kMicrosecond);

void
element (benchmark::State &state, const char *properties)
{
  ElementHarness h{properties};
  gst_harness_set_drop_buffers (h.get (), TRUE);
  h.set_caps (gray_caps (384, 288, "100/1"));
  const BufferPtr picture = frame_of (subframe<guint8> (), 0);
  for (auto _ : state) {
    h.push (BufferPtr (gst_buffer_copy (picture.get ())));
    while (h.message (GST_MESSAGE_ANY))
      ;
  }
}
BENCHMARK_CAPTURE (
    element, meta_only, "subframestats post-messages=false histogram-bins=0")
    ->Unit (benchmark::kMicrosecond);
BENCHMARK_CAPTURE (element, messages, "subframestats line=row:50%")
    ->Unit (benchmark::kMicrosecond);
BENCHMARK_CAPTURE (element, json,
    "subframestats line=row:50% post-messages=false location=/dev/null")
    ->Unit (benchmark::kMicrosecond);
BENCHMARK_CAPTURE (element, csv,
    "subframestats line=row:50% post-messages=false format=csv "
    "location=/dev/null")
    ->Unit (benchmark::kMicrosecond);
BENCHMARK_CAPTURE (element, nothing, "identity")
    ->Unit (benchmark::kMicrosecond);

} // namespace

int
main (int argc, char **argv)
{
  gst_init (&argc, &argv);
  register_meta (kFrameMetaName);
  register_meta (kStatsMetaName);
  GST_ELEMENT_REGISTER (subframestats, nullptr);
  benchmark::Initialize (&argc, argv);
  benchmark::RunSpecifiedBenchmarks ();
  return 0;
}
