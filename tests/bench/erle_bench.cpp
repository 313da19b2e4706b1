/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The run-length code of a DLPC900's images: bytes of source a second, three to
 * a mirror, for 24 planes of 1920x1080. */
#include "dmd/erle.h"

#include <random>

#include <benchmark/benchmark.h>

#include "mirrors.h"

namespace
{

using namespace codedexposure;

constexpr Extent kSize{1920, 1080};

MirrorRows<PlanePixel>
planes_of (const char *preset)
{
  const Schedule schedule = Schedule::parse (preset).value ();
  return test::rendered_planes (schedule, plan_planes (schedule), 0, kSize);
}

MirrorRows<PlanePixel>
random_planes ()
{
  PlaneImage image (kSize.width, kSize.height);
  std::mt19937 random (1);
  for (int y = 0; y < kSize.height; y++)
    for (int x = 0; x < kSize.width; x++)
      image.at (x, y) = random () & 0xFFFFFF;
  return test::rows_of (image);
}

void
encode (benchmark::State &state, const MirrorRows<PlanePixel> &image)
{
  std::size_t size = 0;
  for (auto _ : state) {
    const Bytes bytes = encode_erle (image, 0, kSize.width).joined ();
    size = bytes.size ();
    benchmark::DoNotOptimize (bytes.data ());
  }
  state.SetBytesProcessed (
      state.iterations () * 3 * std::int64_t (kSize.width) * kSize.height);
  state.counters["encoded_bytes"] = double (size);
}

} // namespace

BENCHMARK_CAPTURE (encode, random, random_planes ());
BENCHMARK_CAPTURE (encode, sequential_2x2, planes_of ("sequential:2x2"));
BENCHMARK_CAPTURE (encode, sequential_4x6, planes_of ("sequential:4x6"));
BENCHMARK_CAPTURE (encode, sequential_24x1, planes_of ("sequential:24x1"));
BENCHMARK_CAPTURE (encode, sequential_1x24, planes_of ("sequential:1x24"));

BENCHMARK_MAIN ();
