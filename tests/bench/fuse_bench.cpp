/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Fusion of frames of 768x576 in which everything moves: the table of speed in
 * docs/fusion-method.md. */
#include "../quality/must.h"
#include "fuse/fuser.h"
#include "fuse/partner_correction.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "base/image.h"
#include "fuse/refine_network.h"

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

/** The filters of each instruction set, which are counted in between. */
std::vector<fuse::Kernels> uncounted;
std::int64_t counted_products;

void
count (const fuse::FilterRow &row)
{
  std::int64_t pixels = 0;
  for (int i = 0; i < row.runs_count; i++)
    pixels += row.runs[i].count;
  counted_products += 2 * pixels * row.pairs_count * row.outputs;
}

/** Products of 16 bits that @p fuse_frame computes in filters, on one thread of
 * the widest instruction set. */
template <typename FuseFrame>
std::int64_t
products_of (const FuseFrame &fuse_frame)
{
  const auto all = fuse::supported_kernels ();
  uncounted.assign (all.begin (), all.end ());
  /* The elements of this vector are not constants, only what shows them is. */
  auto &widest = const_cast<fuse::Kernels &> (all.front ());
  widest.filter_add = [] (const fuse::FilterRow &row, const float *share,
                          float *const *to) {
    count (row);
    uncounted.front ().filter_add (row, share, to);
  };
  widest.filter_squared = [] (const fuse::FilterRow &row, float *const *to) {
    count (row);
    uncounted.front ().filter_squared (row, to);
  };
  counted_products = 0;
  fuse_frame ();
  widest = uncounted.front ();
  return counted_products;
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
  if (quality == FuseQuality::kFast && !refine && options.threads == 1) {
    std::int64_t products = 0;
    for (int i = 0; i < kFrames; i++)
      products += products_of (fuse_next);
    state.SetItemsProcessed (products / kFrames * state.max_iterations);
    state.counters["products_per_pixel"] =
        double (products) / kFrames / (kWidth * kHeight);
  }
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

/** Of the frames of a second camera between the mirrors. */
void
correct (benchmark::State &state, const char *preset)
{
  const Schedule schedule = Schedule::from_preset (preset).value ();
  Mapping::Parts parts{{kWidth, kHeight}, {kWidth, kHeight}};
  parts.psf_sigma = 0.3;
  parts.homography = {1.0, 0.008, 0.3, -0.008, 1.0, 0.4, 0.0, 0.0, 1.0};
  const Schedule complement = schedule.complement ().value ();
  const Rectifier rectifier = Rectifier::make (
      Mapping::make (parts).value (), complement, {.correct = true})
                                  .value ();
  FuseOptions options;
  options.threads = int (state.range (0));
  auto correction =
      PartnerCorrection<std::uint8_t>::make (schedule, rectifier, options)
          .value ();
  const auto frames = coded_frames (schedule);
  auto partners = coded_frames (complement);
  std::size_t next = 0;
  for (auto _ : state) {
    const std::size_t i = next++ % frames.size ();
    quality::must (correction.run (
        std::as_const (frames[i]).view (), partners[i].view ()));
  }
}

#define CORRECT_BENCHMARK(name, preset)                                        \
  BENCHMARK_CAPTURE (correct, name, preset)                                    \
      ->ArgName ("threads")                                                    \
      ->Arg (1)                                                                \
      ->Arg (2)                                                                \
      ->UseRealTime ()                                                         \
      ->Unit (benchmark::kMillisecond)
CORRECT_BENCHMARK (4, kFour);
CORRECT_BENCHMARK (8, kEight);

#ifdef __x86_64__

/** As many products of 16 bits as the processor can sum: what `fast` and the
 * network could reach at most. */
void
most_products (benchmark::State &state)
{
  constexpr int kSteps = 10000, kSums = 12, kProducts = 32;
  for (auto _ : state)
    for (int step = 0; step < kSteps; step++)
      asm volatile("vpdpwssd %%zmm0, %%zmm0, %%zmm1\n\t"
                   "vpdpwssd %%zmm0, %%zmm0, %%zmm2\n\t"
                   "vpdpwssd %%zmm0, %%zmm0, %%zmm3\n\t"
                   "vpdpwssd %%zmm0, %%zmm0, %%zmm4\n\t"
                   "vpdpwssd %%zmm0, %%zmm0, %%zmm5\n\t"
                   "vpdpwssd %%zmm0, %%zmm0, %%zmm6\n\t"
                   "vpdpwssd %%zmm0, %%zmm0, %%zmm7\n\t"
                   "vpdpwssd %%zmm0, %%zmm0, %%zmm8\n\t"
                   "vpdpwssd %%zmm0, %%zmm0, %%zmm9\n\t"
                   "vpdpwssd %%zmm0, %%zmm0, %%zmm10\n\t"
                   "vpdpwssd %%zmm0, %%zmm0, %%zmm11\n\t"
                   "vpdpwssd %%zmm0, %%zmm0, %%zmm12\n\t"
                   :
                   :
                   : "xmm1", "xmm2", "xmm3", "xmm4", "xmm5", "xmm6", "xmm7",
                   "xmm8", "xmm9", "xmm10", "xmm11", "xmm12");
  state.SetItemsProcessed (state.iterations () * kSteps * kSums * kProducts);
}

[[maybe_unused]] const bool has_most =
    __builtin_cpu_supports ("avx512vnni") &&
    benchmark::RegisterBenchmark ("most_products/avx512", most_products);

#endif

/** Products for each pixel of the network. */
constexpr std::int64_t
products ()
{
  using Net = fuse::RefineNetwork;
  return 9 * (Net::kInputs * Net::kChannels +
                 Net::kHidden * Net::kChannels * Net::kChannels +
                 Net::kChannels * Net::kOutputs);
}

/** The network of the refinement alone, for one slot; items are products. */
void
refine_network (benchmark::State &state, const fuse::Kernels &kernels)
{
  using Net = fuse::RefineNetwork;
  const int width = kWidth / Net::kFold, height = kHeight / Net::kFold;
  std::vector<std::int16_t> inputs;
  for (int i = 0; i < width * Net::kInputs; i++)
    inputs.push_back (std::int16_t (i * 7919 % 2000 - 1000));
  const auto source = [&] (int, std::int16_t *row) {
    std::copy (inputs.begin (), inputs.end (), row);
  };
  for (auto _ : state)
    Net::trained ().run (kernels, width, height, source,
        [] (int, const float *row) { benchmark::DoNotOptimize (*row); });
  state.SetItemsProcessed (state.iterations () * width * height * products ());
}

[[maybe_unused]] const bool registered = [] {
  for (const fuse::Kernels &kernels : fuse::supported_kernels ())
    benchmark::RegisterBenchmark (
        ("refine_network/" + std::string (kernels.name)).c_str (),
        refine_network, kernels)
        ->MeasureProcessCPUTime ()
        ->Unit (benchmark::kMillisecond);
  return true;
}();

} // namespace

BENCHMARK_MAIN ();
