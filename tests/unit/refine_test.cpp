/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The learned refinement of fusion. */
#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>

#include "bench/bench.h"
#include "fuse/fuser.h"
#include "fuse/refine_network.h"
#include "fuse_reference.h"
#include "random_numbers.h"

#ifdef HAVE_OPENCV_DNN
#include <opencv2/dnn.hpp>

#include "onnx.h"
#endif

namespace
{

using namespace codedexposure;
using Net = fuse::RefineNetwork;
using Frames = std::vector<Image<std::uint8_t>>;

constexpr int kWidth = 13, kHeight = 11;

/* Results of the trained network for rows of @planes, 4 values a pixel. */
std::vector<float>
result_of (const fuse::Kernels &kernels, const std::vector<float> &planes)
{
  std::vector<float> result;
  const std::size_t values = kWidth * Net::kInputs;
  Net::trained ().run (
      kernels, kWidth, kHeight,
      [&] (int y, float *row) {
        std::copy_n (planes.data () + std::size_t (y) * values, values, row);
      },
      [&] (int, const float *row) {
        for (int x = 0; x < kWidth; x++)
          for (int k = 0; k < Net::kOutputs; k++)
            result.push_back (row[x * Net::padded (Net::kOutputs) + k]);
      });
  return result;
}

std::vector<float>
some_planes ()
{
  return test::random_numbers (kWidth * kHeight * Net::kInputs, 9);
}

TEST (Refine, TheNetworkIsTheSameOnEveryTarget)
{
  const auto planes = some_planes ();
  const auto expected = result_of (test::kReference, planes);
  EXPECT_NE (expected, std::vector<float> (expected.size ()));
  for (const fuse::Kernels &kernels : fuse::supported_kernels ())
    EXPECT_EQ (result_of (kernels, planes), expected) << kernels.name;
}

TEST (Refine, OpenCvComputesTheSameFromTheSameWeights)
{
#ifdef HAVE_OPENCV_DNN
  const std::string file = test::onnx_of (Net::trained (), kWidth, kHeight);
  cv::dnn::Net net = cv::dnn::readNetFromONNX (file.data (), file.size ());
  net.setPreferableBackend (cv::dnn::DNN_BACKEND_OPENCV);
  const auto planes = some_planes ();
  const int sides[] = {1, Net::kInputs, kHeight, kWidth};
  cv::Mat blob (4, sides, CV_32F);
  for (int i = 0; i < Net::kInputs; i++)
    for (int at = 0; at < kWidth * kHeight; at++)
      blob.ptr<float> ()[i * kWidth * kHeight + at] =
          planes[std::size_t (at * Net::kInputs + i)];
  net.setInput (blob);
  const cv::Mat theirs = net.forward ();
  ASSERT_EQ (theirs.total (), std::size_t (kWidth * kHeight * Net::kOutputs));
  const auto ours = result_of (fuse::supported_kernels ().front (), planes);
  float largest = 0.0f;
  for (const float value : ours)
    largest = std::max (largest, std::abs (value));
  for (int k = 0; k < Net::kOutputs; k++)
    for (int at = 0; at < kWidth * kHeight; at++)
      ASSERT_NEAR (theirs.ptr<float> ()[k * kWidth * kHeight + at],
          ours[std::size_t (at * Net::kOutputs + k)], 1e-5f * largest);
#else
  GTEST_SKIP () << "OpenCV's dnn is not installed (libopencv-dnn-dev)";
#endif
}

TEST (Refine, WeightsOfAnotherNetworkAreRefused)
{
  const std::vector<std::byte> file (1000);
  const auto parsed = Net::parse (file);
  ASSERT_FALSE (parsed);
  EXPECT_NE (parsed.error ().message.find ("1000 bytes"), std::string::npos);
}

TEST (Refine, AHashNamesTheWeights)
{
  EXPECT_EQ (refinement_hash ().size (), 16u);
  EXPECT_EQ (refinement_hash ().find_first_not_of ("0123456789abcdef"),
      std::string::npos);
}

/* A coded frame of stripes that move by a pixel per slot. */
Frames
take_stripes (
    const std::string &preset, Extent size, const BenchOptions &options = {})
{
  const Schedule schedule = Schedule::parse (preset).value ();
  auto bench = OpticalBench::make (size.width, size.height, options);
  bench->begin (schedule);
  for (int s = 0; s < schedule.slots (); s++) {
    Image<std::uint8_t> scene (size.width, size.height);
    for (int y = 0; y < size.height; y++)
      for (int x = 0; x < size.width; x++)
        scene.at (x, y) = (x - s + y / 2) / 5 % 2 ? 200 : 40;
    bench->expose (scene.view (), s, 1.0);
  }
  Frames coded{{size.width, size.height}};
  bench->read_out (0, coded[0].view ());
  return coded;
}

FuseOptions
options_for (FuseQuality quality, bool refine)
{
  FuseOptions options;
  options.quality = quality;
  options.refine = refine;
  return options;
}

/* @coded, fused. */
Frames
fused (const std::string &preset, const Frames &coded,
    const FuseOptions &options, std::string *unrefined = nullptr)
{
  const Schedule schedule = Schedule::parse (preset).value ();
  const int width = coded[0].width (), height = coded[0].height ();
  auto fuser =
      Fuser<std::uint8_t>::make (schedule, width, height, options).value ();
  if (unrefined)
    *unrefined = fuser.unrefined ();
  Frames all;
  for (const auto &frame : coded) {
    Frames slots (
        std::size_t (schedule.slots ()), Image<std::uint8_t> (width, height));
    std::vector<ImageView<std::uint8_t>> views;
    for (auto &slot : slots)
      views.push_back (slot.view ());
    EXPECT_TRUE (fuser.take (frame.view ()));
    EXPECT_TRUE (fuser.fuse (views));
    all.insert (all.end (), slots.begin (), slots.end ());
  }
  return all;
}

/* Odd sizes, and parts of the frame for each thread. */
TEST (Refine, NeitherThreadsNorTargetsChangePixels)
{
  for (const char *preset : {"sequential:lattice:4/2", "sequential:3x1"}) {
    const Frames coded = take_stripes (preset, {43, 37});
    FuseOptions options = options_for (FuseQuality::kFast, true);
    options.threads = 1;
    const Frames expected = fused (preset, coded, options);
    EXPECT_NE (expected,
        fused (preset, coded, options_for (FuseQuality::kFast, false)));
    for (const std::string_view target : fuse_targets ()) {
      for (const int threads : {1, 2, 5}) {
        options.threads = threads;
        options.target = target;
        EXPECT_EQ (fused (preset, coded, options), expected)
            << preset << ' ' << target << ' ' << threads;
      }
    }
  }
}

TEST (Refine, LearnedIsBestRefined)
{
  const char *preset = "sequential:2x2";
  const Frames coded = take_stripes (preset, {32, 24});
  EXPECT_EQ (fused (preset, coded, options_for (FuseQuality::kLearned, false)),
      fused (preset, coded, options_for (FuseQuality::kBest, true)));
}

TEST (Refine, EverySlotCountOfTheTrainingIsRefined)
{
  for (int n = 2; n <= 16; n++) {
    const std::string preset =
        "sequential:lattice:" + std::to_string (n) + "/1";
    std::string unrefined = "?";
    fused (preset, take_stripes (preset, {32, 24}),
        options_for (FuseQuality::kFast, true), &unrefined);
    EXPECT_EQ (unrefined, "") << preset;
  }
}

double
rms_of (const Frames &a, const Frames &b)
{
  double squares = 0.0;
  int count = 0;
  for (std::size_t k = 0; k < a.size (); k++)
    for (int y = 0; y < a[k].height (); y++)
      for (int x = 0; x < a[k].width (); x++, count++)
        squares += std::pow (a[k].at (x, y) - b[k].at (x, y), 2);
  return std::sqrt (squares / count);
}

/* What leaked is undone before: the pictures differ from those without leakage
 * by no more than those that are refined do. */
TEST (Refine, LeakageIsUndoneBefore)
{
  for (const std::string preset :
      {"sequential:2x2", "sequential:lattice:8/3"}) {
    const std::string leaky = preset + ",leak=0.05";
    const auto change = [&] (FuseQuality quality, std::string &unrefined) {
      const FuseOptions options = options_for (quality, false);
      return rms_of (fused (preset, take_stripes (preset, {48, 32}), options),
          fused (leaky, take_stripes (leaky, {48, 32}), options, &unrefined));
    };
    std::string unrefined = "?";
    const double refined = change (FuseQuality::kLearned, unrefined);
    EXPECT_EQ (unrefined, "") << leaky;
    EXPECT_LT (refined, 1.1 * change (FuseQuality::kBest, unrefined)) << leaky;
  }
}

TEST (Refine, WhatWasNotTrainedStaysAsItWas)
{
  struct Case {
    const char *preset;
    const char *reason;
  };
  for (const auto &[preset, reason] : {Case{"staircase:2x2", "one-hot"},
           {"sequential:lattice:4/2,leak=0.06", "6 % of the light"},
           {"sequential:5x4", "20 slots"}}) {
    const Frames coded = take_stripes (preset, {40, 40});
    std::string unrefined;
    const FuseOptions options = options_for (FuseQuality::kFast, true);
    EXPECT_EQ (fused (preset, coded, options, &unrefined),
        fused (preset, coded, options_for (FuseQuality::kFast, false)))
        << preset;
    EXPECT_NE (unrefined.find (reason), std::string::npos) << unrefined;
  }
  FuseOptions dark = options_for (FuseQuality::kFast, true);
  dark.noise = {200.0, 10.0};
  std::string unrefined;
  fused ("sequential:2x1", take_stripes ("sequential:2x1", {32, 24}), dark,
      &unrefined);
  EXPECT_NE (unrefined.find ("two slots"), std::string::npos) << unrefined;
  const char *preset = "sequential:2x2";
  fused (preset, take_stripes (preset, {32, 24}), dark, &unrefined);
  EXPECT_NE (unrefined.find ("% of white"), std::string::npos) << unrefined;
}

} // namespace
