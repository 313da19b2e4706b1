/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Predictions for schedules, compared with the simulated bench. */
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "advise/advice.h"
#include "advise/linear_estimate.h"
#include "bench/bench.h"
#include "extract/extractor.h"

namespace
{

using namespace codedexposure;
using Picture = Image<std::uint16_t>;

Schedule
schedule_of (const char *preset)
{
  const auto schedule = Schedule::from_preset (preset);
  EXPECT_TRUE (schedule) << schedule.error ().message;
  return *schedule;
}

ExposureModel
model_of (const Schedule &schedule, const Conditions &conditions)
{
  const auto model =
      ExposureModel::make (schedule, conditions.camera, conditions.light);
  EXPECT_TRUE (model) << model.error ().message;
  return *model;
}

/** The bench of the conditions. */
OpticalBench
bench_of (const ExposureModel &model, const Conditions &conditions, int side)
{
  BenchOptions options;
  options.full_well = model.slot_electrons () * model.slots ();
  options.read_noise = conditions.camera.noise.read_noise;
  options.bits = conditions.camera.bits;
  auto bench = OpticalBench::make (side, side, options);
  EXPECT_TRUE (bench) << bench.error ().message;
  return *std::move (bench);
}

/* A flat scene: differences between pixels of a subframe are noise. */
double
measured_snr (
    const Schedule &schedule, const Conditions &conditions, double level)
{
  constexpr int kSide = 280;
  const ExposureModel model = model_of (schedule, conditions);
  OpticalBench bench = bench_of (model, conditions, kSide);
  Picture scene (kSide, kSide), coded (kSide, kSide);
  std::fill_n (scene.view ().data, kSide * kSide,
      std::uint16_t (std::lround (level * 65535)));
  bench.begin (schedule);
  for (int s = 0; s < schedule.slots (); s++)
    bench.expose (std::as_const (scene).view (), s, 1.0);
  bench.read_out (0, coded.view ());

  const auto extractor = Extractor<std::uint16_t>::make (schedule, kSide, kSide,
      {.method = Method::kDecode,
          .bits = conditions.camera.bits,
          .interpolate = false});
  const Extent size = extractor->subframe_size ();
  std::vector<Picture> subframes (
      std::size_t (schedule.slots ()), Picture (size.width, size.height));
  std::vector<ImageView<std::uint16_t>> views;
  for (Picture &subframe : subframes)
    views.push_back (subframe.view ());
  EXPECT_TRUE (extractor->run (std::as_const (coded).view (), views));
  double power = 0.0;
  const double most = (1 << conditions.camera.bits) - 1;
  for (const Picture &subframe : subframes)
    for (int i = 0; i < size.width * size.height; i++) {
      const double off = subframe.view ().data[i] / most - level;
      power += off * off;
    }
  power /= double (size.width * size.height) * schedule.slots ();
  return 10.0 * std::log10 (level * level / power);
}

/* 0.15 dB: 78,400 noisy pixels vary by 0.02 dB, decoding rounds a pixel once
 * more, and the full well clips the noise of white. */
TEST (Advise, SignalToNoiseIsThatOfTheBench)
{
  Conditions bright, dark;
  bright.camera.bits = dark.camera.bits = 12;
  dark.light = 0.5;
  dark.camera.noise.read_noise = 20.0;
  for (const Conditions &conditions : {bright, dark})
    for (const char *preset : {"sequential:2x2", "staircase:2x2",
             "s-matrix:7x1", "sequential:lattice:8/3", "sequential:4x4",
             "staircase:2x2,leak=0.02", "sequential:2x2,readout=8ms"}) {
      const Schedule schedule = schedule_of (preset);
      const auto snr = model_of (schedule, conditions).snr (0.5);
      ASSERT_TRUE (snr);
      EXPECT_NEAR (*snr, measured_snr (schedule, conditions, 0.5), 0.15)
          << preset << " in light " << conditions.light;
    }
}

constexpr int kSide = 72;
constexpr int kMoments = 4; // of a slot at which the scene is looked at

/**
 * The texture that SceneStatistics describe, as a sum of waves, moving in one
 * direction. Of Matern's spectrum in the plane, a part u has more than
 * sqrt 3 / detail sqrt (u^(-2/3) - 1) radians a pixel. The waves stand for
 * equal steps of the root of u, and so fall densely on the few percent of fine
 * texture on which samples go wrong.
 */
class Texture
{
public:
  Texture (const SceneStatistics &scene, double direction, unsigned seed)
      : scene_ (scene), direction_ (direction)
  {
    std::mt19937 random (seed);
    std::uniform_real_distribution<double> turn (0, 2 * std::numbers::pi);
    for (int i = 0; i < kWaves; i++) {
      const double root = (i + 0.5) / kWaves;
      const double radians = std::numbers::sqrt3 / scene.detail *
                             std::sqrt (std::pow (root, -4.0 / 3.0) - 1.0);
      const double towards = turn (random);
      waves_.push_back (
          {radians * std::cos (towards), radians * std::sin (towards),
              turn (random), scene.contrast * std::sqrt (4.0 * root / kWaves)});
    }
  }
  /** The light at a time, part of white. */
  Image<float> at (double seconds) const
  {
    Image<float> light (kSide, kSide);
    const double path = scene_.speed * seconds;
    std::fill_n (light.view ().data, kSide * kSide, float (scene_.level));
    for (const Wave &wave : waves_)
      add (wave,
          wave.phase - path * (wave.x * std::cos (direction_) +
                                  wave.y * std::sin (direction_)),
          light.view ());
    return light;
  }

private:
  static constexpr int kWaves = 96;
  struct Wave {
    double x, y, phase, height;
  };
  /* Rotates from row to row, without a cosine for each pixel. */
  static void add (const Wave &wave, double phase, ImageView<float> light)
  {
    std::array<float, kSide> real, imaginary;
    for (int x = 0; x < kSide; x++) {
      const double at = phase + wave.x * x;
      real[std::size_t (x)] = float (wave.height * std::cos (at));
      imaginary[std::size_t (x)] = float (wave.height * std::sin (at));
    }
    const float c = float (std::cos (wave.y)), s = float (std::sin (wave.y));
    for (int y = 0; y < kSide; y++) {
      float *row = light.row (y);
      for (std::size_t x = 0; x < kSide; x++) {
        row[x] += real[x];
        const float turned = real[x] * c - imaginary[x] * s;
        imaginary[x] = real[x] * s + imaginary[x] * c;
        real[x] = turned;
      }
    }
  }

  SceneStatistics scene_;
  double direction_;
  std::vector<Wave> waves_;
};

Picture
quantised (const Image<float> &light)
{
  Picture picture (light.width (), light.height ());
  for (int i = 0; i < light.width () * light.height (); i++)
    picture.view ().data[i] = std::uint16_t (std::lround (
        std::clamp (light.view ().data[i], 0.0f, 1.0f) * 65535.0f));
  return picture;
}

/* Sum of squared errors and number of values of one coded frame. */
struct Sum {
  double squares = 0.0, count = 0.0;
};

/* Coded pixels less their means, white in a slot being 1. */
Image<float>
centred (const Schedule &schedule, const ExposureModel &model,
    const Conditions &conditions, const Picture &coded)
{
  const double white =
      schedule.white_slots () / ((1 << conditions.camera.bits) - 1);
  Image<float> result (kSide, kSide);
  for (int y = 0; y < kSide; y++)
    for (int x = 0; x < kSide; x++) {
      double value = coded.at (x, y) * white;
      for (int s = 0; s < model.slots (); s++)
        value -= schedule.light (schedule.element_at (x, y), s) *
                 conditions.scene.level;
      result.at (x, y) = float (value);
    }
  return result;
}

/* Every estimated pixel of a slot against the texture at all times of the slot.
 */
void
compare (const Schedule &schedule, const LinearEstimate &estimate, int slot,
    double level, ImageView<const float> coded, const Image<float> *truth,
    Sum &sum)
{
  constexpr int kBorder = 8;
  for (int y = kBorder; y < kSide - kBorder; y++)
    for (int x = kBorder; x < kSide - kBorder; x++) {
      double value = level;
      const double *weight =
          estimate.weights.data () +
          std::size_t (schedule.element_at (x, y) * schedule.slots () + slot) *
              estimate.places.size ();
      for (const auto &[dx, dy] : estimate.places)
        value += *weight++ * coded.at (x + dx, y + dy);
      for (int m = 0; m < kMoments; m++) {
        const double off = value - truth[m].at (x, y);
        sum.squares += off * off;
        sum.count++;
      }
    }
}

/* PSNR of the estimate for textures that move in six directions. */
double
measured_psnr (const Schedule &schedule, const Conditions &conditions)
{
  constexpr unsigned kRuns = 6;
  const ExposureModel model = model_of (schedule, conditions);
  const LinearEstimate estimate (model, conditions.scene);
  OpticalBench bench = bench_of (model, conditions, kSide);
  Sum sum;
  for (unsigned run = 0; run < kRuns; run++) {
    const Texture texture (conditions.scene,
        2 * std::numbers::pi * (run + 0.3) / kRuns, 100 + run);
    std::vector<Image<float>> truth;
    bench.begin (schedule);
    for (int s = 0; s < model.slots (); s++)
      for (int m = 0; m < kMoments; m++) {
        truth.push_back (
            texture.at ((s + (m + 0.5) / kMoments) * model.pitch ()));
        const Picture scene = quantised (truth.back ());
        bench.expose (scene.view (), s, 1.0 / kMoments);
      }
    Picture coded (kSide, kSide);
    bench.read_out (run, coded.view ());
    const Image<float> values = centred (schedule, model, conditions, coded);
    for (int s = 0; s < model.slots (); s++)
      compare (schedule, estimate, s, conditions.scene.level, values.view (),
          &truth[std::size_t (s * kMoments)], sum);
  }
  return -10.0 * std::log10 (sum.squares / sum.count);
}

/* 0.4 dB: the bench integrates a slot at four times and the model at six or
 * more, which changes the result by up to 0.3 dB where motion dominates; and
 * six textures of 56x56 pixels have about 400 patches, so the mean square
 * varies by a few percent, 0.2 dB. */
TEST (Advise, PsnrIsThatOfMovingTexturesAndTheBestIsRecommended)
{
  Conditions still, slow, fast, dark;
  still.scene.speed = 0.0;
  slow.scene.speed = 60.0;
  fast.scene.speed = 600.0;
  dark.light = 0.05;
  for (const Conditions &conditions : {still, slow, fast, dark}) {
    SCOPED_TRACE (testing::Message () << conditions.scene.speed
                                      << " px/s in light " << conditions.light);
    std::vector<Prediction> predictions;
    std::vector<double> measured;
    for (const char *preset : {"sequential:2x1", "sequential:lattice:4/2",
             "staircase:2x2", "sequential:lattice:8/3,order=bit-reversal"}) {
      predictions.push_back (*predict (schedule_of (preset), conditions));
      measured.push_back (
          measured_psnr (*predictions.back ().schedule, conditions));
      EXPECT_NEAR (predictions.back ().psnr, measured.back (), 0.4) << preset;
    }
    const Prediction *best = recommend (predictions, 0.0);
    ASSERT_NE (best, nullptr);
    EXPECT_GT (measured[std::size_t (best - predictions.data ())],
        *std::ranges::max_element (measured) - 0.1)
        << best->text ();
  }
}

TEST (Advise, FiguresOfTheReferenceBench)
{
  Conditions conditions;
  const auto fig8 = predict (
      schedule_of ("staircase:2x2,active=9.8ms,switching=0.2ms"), conditions);
  ASSERT_TRUE (fig8);
  EXPECT_DOUBLE_EQ (fig8->frame_rate, 100.0);
  EXPECT_EQ (fig8->subframe, (Extent{384, 288}));
  EXPECT_NEAR (fig8->efficiency, 0.625 * 39.2 / 40, 1e-12);
  EXPECT_NEAR (fig8->slot_electrons, 2450.0, 1e-9);
  EXPECT_FALSE (fig8->overexposed);

  /* 10,000 electrons, read noise 5, a rounding of 39 electrons. */
  const auto none = predict (std::nullopt, conditions);
  ASSERT_TRUE (none);
  EXPECT_EQ (none->text (), "none");
  EXPECT_DOUBLE_EQ (none->frame_rate, 25.0);
  EXPECT_NEAR (none->snr_white,
      10 * std::log10 (1e8 / (1e4 + 25 + std::pow (1e4 / 255, 2) / 12)), 1e-9);
  conditions.camera.rate = {30000, 1001};
  EXPECT_NEAR (predict (schedule_of ("sequential:2x2"), conditions)->frame_rate,
      120000.0 / 1001, 1e-9);
}

TEST (Advise, TooMuchLightIsNotRecommended)
{
  Conditions conditions;
  conditions.light = 2.0;
  const std::vector<Prediction> predictions{*predict (std::nullopt, conditions),
      *predict (schedule_of ("staircase:2x2"), conditions),
      *predict (schedule_of ("sequential:2x2"), conditions)};
  EXPECT_TRUE (predictions[0].overexposed);
  EXPECT_TRUE (predictions[1].overexposed);
  EXPECT_FALSE (predictions[2].overexposed);
  EXPECT_EQ (recommend (predictions, 0.0), &predictions[2]);
  EXPECT_EQ (recommend (predictions, 101.0), nullptr);
}

TEST (Advise, TheRateThatIsAskedForIsEnough)
{
  const Conditions conditions;
  const std::vector<Prediction> predictions{*predict (std::nullopt, conditions),
      *predict (schedule_of ("sequential:2x2"), conditions)};
  ASSERT_EQ (predictions[1].frame_rate, 100.0);
  EXPECT_EQ (recommend (predictions, 100.0), &predictions[1]);
  EXPECT_EQ (recommend (predictions, 100.001), nullptr);
}

TEST (Advise, SaysWhatIsOutOfRange)
{
  const auto complaint = [] (const Conditions &conditions,
                             const char *preset = "sequential:2x2") {
    const auto prediction = predict (schedule_of (preset), conditions);
    return prediction ? "" : prediction.error ().message;
  };
  Conditions conditions;
  EXPECT_EQ (complaint (conditions), "");
  EXPECT_NE (complaint (conditions, "sequential:2x2,active=11ms"), "");
  EXPECT_EQ (complaint (conditions, "sequential:16x16"),
      "it has 256 elements; predictions go up to 64");
  conditions.scene.speed = -1.0;
  EXPECT_EQ (
      complaint (conditions), "speed (pixels/s) = -1 is outside 0..1e+06");
  conditions = {};
  conditions.camera.bits = 17;
  EXPECT_EQ (complaint (conditions), "bits = 17 is outside 1..16");
  conditions = {};
  conditions.light = 0.0;
  EXPECT_NE (complaint (conditions), "");
  conditions.light = std::nan ("");
  EXPECT_NE (complaint (conditions), "");
}

TEST (Advise, UsualSchedulesTakeTheTimesOfTheBench)
{
  const auto schedules = usual_schedules (200'000, 500'000);
  EXPECT_GE (schedules.size (), 16u) << "all of the list can be read";
  for (const Schedule &schedule : schedules) {
    EXPECT_EQ (schedule.timing ().switching, 200'000) << schedule.text ();
    EXPECT_EQ (schedule.timing ().readout, 500'000) << schedule.text ();
  }
  EXPECT_TRUE (std::ranges::is_sorted (schedules, {}, &Schedule::slots));
}

/* Parts with the same code, so that only the division differs. */
TEST (Advise, PredictsRegionsPartByPart)
{
  const Conditions conditions;
  const auto plain = predict (schedule_of ("sequential:2x2"), conditions);
  const auto divided = predict (
      schedule_of ("sequential:2x2,region=192x144+64+32:sequential:2x2"),
      conditions);
  ASSERT_TRUE (divided) << divided.error ().message;
  ASSERT_EQ (divided->parts.size (), 2u);
  for (const Prediction &part : divided->parts) {
    EXPECT_DOUBLE_EQ (part.psnr, plain->psnr);
    EXPECT_DOUBLE_EQ (part.snr_grey, plain->snr_grey);
  }
  EXPECT_EQ (divided->parts[1].subframe, (Extent{96, 72}));
  EXPECT_NEAR (divided->psnr, plain->psnr, 1e-9);
  EXPECT_NEAR (divided->efficiency, plain->efficiency, 1e-12);

  /* A part with n = 8 receives half the light of one with n = 4, and half the
   * range. */
  const auto mixed =
      predict (schedule_of ("sequential:2x2,active=1ms,switching=100us,"
                            "region=384x288+64+32:sequential:4x2"),
          conditions);
  ASSERT_TRUE (mixed) << mixed.error ().message;
  const Prediction &background = mixed->parts[0], &region = mixed->parts[1];
  EXPECT_DOUBLE_EQ (mixed->frame_rate, background.frame_rate);
  EXPECT_DOUBLE_EQ (region.frame_rate, 2 * background.frame_rate);
  EXPECT_DOUBLE_EQ (region.slot_electrons, mixed->slot_electrons);
  EXPECT_NEAR (background.slot_electrons / region.slot_electrons, 2.1, 1e-9);
  EXPECT_LT (
      region.snr_white, predict (schedule_of ("sequential:4x2,active=1ms,"
                                              "switching=100us"),
                            conditions)
                            ->snr_white);
  EXPECT_NEAR (mixed->efficiency,
      0.75 * background.efficiency + 0.25 * region.efficiency, 1e-12);

  const auto outside =
      predict (schedule_of ("sequential:2x2,region=8x8+764+0:sequential:2x2"),
          conditions);
  ASSERT_FALSE (outside);
  EXPECT_NE (
      outside.error ().message.find ("region 0, 8x8+764+0"), std::string::npos);
}

} // namespace
