/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The learned refinement of fusion. */
#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>

#include "bench/bench.h"
#include "fuse/fuser.h"
#include "fuse/refine.h"
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

/* Results of a network for rows of @planes, kOutputs values a pixel. */
std::vector<float>
result_of (const fuse::Kernels &kernels, const std::vector<float> &planes,
    const Net &network = Net::trained ())
{
  std::vector<float> result;
  const std::size_t values = kWidth * Net::kInputs;
  network.run (
      kernels, kWidth, kHeight,
      [&] (int y, std::int16_t *row) {
        std::transform (planes.data () + std::size_t (y) * values,
            planes.data () + std::size_t (y + 1) * values, row, Net::steps);
      },
      [&] (int, const float *row) {
        for (int x = 0; x < kWidth; x++)
          for (int k = 0; k < Net::kOutputs; k++)
            result.push_back (row[x * Net::padded (Net::kOutputs) + k]);
      });
  return result;
}

/* Inputs from -0.5 to 0.5, like those of pictures. */
std::vector<float>
some_planes ()
{
  auto planes = test::random_numbers (kWidth * kHeight * Net::kInputs, 9);
  for (float &value : planes)
    value *= 0.005f;
  return planes;
}

TEST (Refine, TheNetworkIsTheSameOnEveryTarget)
{
  const auto planes = some_planes ();
  const auto expected = result_of (test::kReference, planes);
  EXPECT_NE (expected, std::vector<float> (expected.size ()));
  for (const fuse::Kernels &kernels : fuse::supported_kernels ())
    EXPECT_EQ (result_of (kernels, planes), expected) << kernels.name;
}

/* In floating point; integers of 16 bits miss less than half of the rounding of
 * a pixel. */
TEST (Refine, OpenCvComputesTheSameFromTheSameWeights)
{
#ifdef HAVE_OPENCV_DNN
  constexpr float kGreyLevels = 0.25f * 255.0f; // of a correction of 1
  constexpr int kCorrections = Net::kFold * Net::kFold;
  const std::string file = test::onnx_of (
      Net::read (fuse::refine_weights ()).value (), kWidth, kHeight);
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
  float largest = 0.0f, correction = 0.0f, deviation = 0.0f;
  for (int k = 0; k < Net::kOutputs; k++)
    for (int at = 0; at < kWidth * kHeight; at++) {
      const float value = ours[std::size_t (at * Net::kOutputs + k)];
      const float missed =
          std::abs (theirs.ptr<float> ()[k * kWidth * kHeight + at] - value);
      if (k < kCorrections) {
        largest = std::max (largest, kGreyLevels * std::abs (value));
        correction = std::max (correction, kGreyLevels * missed);
      } else {
        deviation = std::max (deviation, missed);
      }
    }
  EXPECT_GT (largest, 5.0f);
  EXPECT_LT (correction, 0.25f);
  EXPECT_LT (deviation, 0.02f); // 1.4 % of a deviation
#else
  GTEST_SKIP () << "OpenCV's dnn is not installed (libopencv-dnn-dev)";
#endif
}

/* The reference has sums of 64 bits. Inputs and hidden values are the largest
 * there are, and all products have the same sign. */
TEST (Refine, NoSumOverflowsWhateverTheWeights)
{
  constexpr std::size_t kHead = 16;
  const std::size_t first = 9 * Net::kInputs * Net::kChannels;
  const std::vector<float> planes (kWidth * kHeight * Net::kInputs, -100.0f);
  for (const float weight : {1e-20f, 0.37f, 3000.0f}) {
    const auto bytes = fuse::refine_weights ();
    std::vector<std::byte> file (bytes.begin (), bytes.end ());
    for (std::size_t i = 0; i < (file.size () - kHead) / 4; i++) {
      const float value = i < first ? -weight : weight;
      std::memcpy (file.data () + kHead + 4 * i, &value, sizeof value);
    }
    const Net network = Net::parse (file).value ();
    const auto expected = result_of (test::kReference, planes, network);
    EXPECT_GT (expected[0], 0.0f);
    for (const fuse::Kernels &kernels : fuse::supported_kernels ())
      EXPECT_EQ (result_of (kernels, planes, network), expected)
          << kernels.name << ' ' << weight;
  }
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

/* Light that differs from frame to frame and from slot to slot. */
Field
some_light (int number)
{
  const auto numbers =
      test::random_numbers (kWidth * kHeight, unsigned (number));
  Field light (kWidth, kHeight);
  for (int y = 0; y < kHeight; y++)
    for (int x = 0; x < kWidth; x++)
      light.row (y)[x] = 128.0f + numbers[std::size_t (y * kWidth + x)];
  return light;
}

TEST (Refine, TheFramesBeforeAndAfterAndASecondCameraAreSeen)
{
  const Schedule schedule = Schedule::parse ("sequential:2x2").value ();
  fuse::Refiner refiner (fuse::supported_kernels ().front (), schedule,
      Observation (schedule, {}, 0.0, 255.0), kWidth, kHeight, 0.0);
  fuse::CodedFrame before, now, after;
  before.light = some_light (1);
  now.light = some_light (2);
  after.light = some_light (3);
  std::vector<Field> slots;
  for (int s = 0; s < 4; s++)
    slots.push_back (some_light (10 + s));
  const Field moving (kWidth, kHeight);
  Workers workers (1);
  std::vector<std::vector<float>> results, deviations;
  const auto refine = [&] (const fuse::CodedFrames &frames) {
    auto light = slots;
    std::vector<Field> deviation;
    refiner.run (frames, moving, light, &deviation, {workers, {}});
    for (auto *to : {&results, &deviations}) {
      to->emplace_back ();
      for (const Field &slot : to == &results ? light : deviation)
        for (int y = 0; y < kHeight; y++)
          to->back ().insert (
              to->back ().end (), slot.row (y), slot.row (y) + kWidth);
    }
    for (int s = 0; s < 4; s++)
      for (int y = 0; y < kHeight; y++)
        for (int x = 0; x < kWidth; x++)
          if (schedule.light (schedule.element_at (x, y), s) == 1.0) {
            ASSERT_EQ (light[std::size_t (s)].row (y)[x],
                slots[std::size_t (s)].row (y)[x]);
          }
  };
  refine ({nullptr, &now, nullptr});
  refine ({&before, &now, nullptr});
  refine ({nullptr, &now, &after});
  refine ({&before, &now, &after});
  now.has_partner = true;
  refine ({&before, &now, &after});
  for (const auto &all : {results, deviations})
    for (std::size_t i = 0; i < all.size (); i++)
      for (std::size_t j = 0; j < i; j++)
        EXPECT_NE (all[i], all[j]) << i << ' ' << j;
  now.has_partner = false;
  refine ({nullptr, &now, nullptr});
  EXPECT_EQ (results.back (), results.front ());
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
