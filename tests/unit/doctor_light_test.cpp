/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The checks of trigger and light, and what they compute. */
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "bench/simulated_rig.h"
#include "doctor/checks.h"
#include "doctor/light_fit.h"
#include "doctor/statistics.h"

using namespace codedexposure;

namespace
{

/** How much is tried: 1 in the suite, more in the long tests. */
int
effort ()
{
  const char *text = std::getenv ("DOCTOR_BENCHES");
  return text ? std::max (1, std::atoi (text)) : 1;
}

/** A bench and what the two checks say of it. */
struct Visit {
  SickBenchOptions options;
  BenchTruth truth;
  Finding trigger, light;
  double trigger_seconds = 0.0, light_seconds = 0.0;
  Examination::Lit inside;
  BenchProfile profile;
  int lag = 0;

  /** "trigger:exposure-late" of the first check that is not passed. */
  std::string first () const
  {
    for (const Verdict verdict : {Verdict::fail, Verdict::warn})
      for (const Finding *finding : {&trigger, &light})
        if (finding->verdict () == verdict)
          return finding->diagnoses.front ().id;
    return "";
  }
  Measured number (const Finding &finding, const char *name) const
  {
    const Reading *reading = finding.reading (name);
    EXPECT_NE (reading, nullptr) << name;
    return reading ? reading->number : Measured{NAN, NAN};
  }
};

Visit
visit (SickBenchOptions options, const std::string &words = "")
{
  Visit visit;
  EXPECT_TRUE (inflict (options, words)) << words;
  auto rig = SimulatedRig::make (options);
  EXPECT_TRUE (rig);
  Examination examination{**rig};
  examination.exhibits = false;
  auto trigger = check_trigger (examination);
  visit.trigger_seconds = 1e-9 * double ((*rig)->now ());
  EXPECT_TRUE (trigger) << words << trigger.error ().message;
  visit.trigger = *std::move (trigger);
  if (visit.trigger.verdict () != Verdict::fail) {
    auto light = check_light (examination);
    EXPECT_TRUE (light) << words << light.error ().message;
    visit.light = *std::move (light);
  }
  visit.light_seconds = 1e-9 * double ((*rig)->now ()) - visit.trigger_seconds;
  visit.options = options;
  visit.truth = (*rig)->truth ();
  visit.inside = examination.inside;
  visit.profile = examination.profile;
  visit.lag = examination.lag;
  return visit;
}

SickBenchOptions
bench (std::uint64_t seed)
{
  SickBenchOptions like;
  like.camera = {128, 96};
  like.mirrors = {160, 128};
  like.bits = seed % 3 == 0 ? 12 : 8;
  return random_healthy_bench (seed, like);
}

/** Counts @p error that is within @p sigmas, of all. */
struct Coverage {
  int inside = 0, all = 0;
  void add (double error, double sigma)
  {
    all++;
    inside += std::abs (error) <= 2.0 * sigma;
  }
};

TEST (Checks, FindNothingInHealthyBenches)
{
  Coverage delays, exposures, depths;
  for (std::uint64_t seed = 1; seed <= std::uint64_t (16 * effort ()); seed++) {
    const Visit seen = visit (bench (seed));
    SCOPED_TRACE ("seed " + std::to_string (seed));
    EXPECT_EQ (seen.first (), "");
    EXPECT_LT (seen.trigger_seconds, 42.0);
    EXPECT_LT (seen.light_seconds, 20.0);

    const auto delay = *seen.profile.trigger_delay;
    const auto exposure = *seen.profile.exposure;
    const double late = delay.value - seen.truth.profile.trigger_delay->value;
    const double longer = exposure.value - seen.truth.profile.exposure->value;
    EXPECT_LT (std::abs (late), 20e3);
    EXPECT_LT (std::abs (longer), 20e3);
    delays.add (late, delay.sigma);
    exposures.add (longer, exposure.sigma);

    // What later checks take as wholly exposed is.
    const double slot =
        1e9 * seen.options.rate.den / seen.options.rate.num / seen.inside.of;
    EXPECT_GE (slot * seen.inside.first,
        seen.truth.profile.trigger_delay->value - 1e3);
    EXPECT_LE (slot * (seen.inside.first + seen.inside.slots),
        seen.truth.profile.trigger_delay->value +
            seen.truth.profile.exposure->value);
    EXPECT_GT (seen.inside.slots, 0.95 * seen.inside.of);

    const Measured depth = seen.number (seen.light, "flicker");
    depths.add (depth.value - 100.0 * seen.options.flicker_depth, depth.sigma);
    const Measured drift = seen.number (seen.light, "drift");
    EXPECT_NEAR (drift.value, 100.0 * seen.options.drift, 0.3);
    const Measured corner = seen.number (seen.light, "light lost in a corner");
    EXPECT_NEAR (corner.value, 100.0 * seen.options.vignetting, 3.0);
  }
  EXPECT_GE (delays.inside, 0.9 * delays.all);
  EXPECT_GE (exposures.inside, 0.9 * exposures.all);
  EXPECT_GE (depths.inside, 0.9 * depths.all);
}

TEST (Checks, MeasureFlicker)
{
  constexpr double kRates[] = {0.7, 3.1, 25.0, 50.0, 75.0, 100.0, 119.9, 120.0,
      199.7, 240.0, 333.3, 400.0, 487.0, 500.0};
  std::uint64_t seed = 100;
  const bool all = effort () > 1;
  for (const double rate : kRates)
    for (const double depth : {0.03, 0.1}) {
      if (!all && !(rate == 100.0 || (rate == 333.3 && depth == 0.03)))
        continue;
      SickBenchOptions options = bench (seed++);
      options.flicker_rate = rate;
      options.flicker_depth = depth;
      const Visit seen = visit (options);
      SCOPED_TRACE (std::to_string (rate) + " Hz " + std::to_string (depth));
      EXPECT_EQ (seen.first (), "flicker");
      EXPECT_NEAR (seen.number (seen.light, "frequency of the flicker").value,
          rate, 0.2);
      EXPECT_NEAR (seen.number (seen.light, "flicker").value, 100.0 * depth,
          10.0 * depth);
      EXPECT_NEAR (seen.number (seen.trigger, "delay").value,
          seen.truth.profile.trigger_delay->value / 1e3, 20.0);
      EXPECT_NEAR (seen.number (seen.trigger, "exposure").value,
          seen.truth.profile.exposure->value / 1e3, 20.0);
    }
}

/** Faults and the diagnoses that are right. */
struct Case {
  const char *words;
  const char *ids;
};

class Faults : public testing::TestWithParam<Case>
{
};

TEST_P (Faults, AreNamedFirst)
{
  const auto &[words, ids] = GetParam ();
  for (std::uint64_t seed = 1; seed <= std::uint64_t (effort ()); seed++) {
    const Visit seen = visit (bench (seed), words);
    const std::string first = seen.first ();
    EXPECT_NE (std::string (ids).find (" " + first + " "), std::string::npos)
        << words << " seed " << seed << ": " << first;
  }
}

INSTANTIATE_TEST_SUITE_P (Single, Faults,
    testing::Values (Case{"no-trigger", " no-trigger "},
        Case{"free-running", " free-running "},
        Case{"free-running=25", " free-running "},
        Case{"free-running=50", " free-running "},
        Case{"half-rate", " half-rate "}, Case{"double-rate", " double-rate "},
        Case{"trigger-edge", " trigger-edge "},
        Case{"exposure-late", " exposure-late "},
        Case{"exposure-late=1ms", " exposure-late "},
        Case{"exposure-late=8ms", " exposure-late "},
        Case{"exposure-late=15ms", " exposure-late "},
        Case{"exposure-late=39ms", " exposure-late "},
        Case{"trigger-edge=5ms", " trigger-edge "},
        Case{"exposure-short", " exposure-short "},
        Case{"exposure-short=12ms", " exposure-short "},
        Case{"exposure-short=1500us", " exposure-short "},
        Case{"exposure-long", " exposure-long "},
        Case{"exposure-long=5ms", " exposure-long "},
        Case{"frame-late", " frame-late "},
        Case{"frame-late=3", " frame-late "},
        Case{"frame-late-varies", " frame-late-varies "},
        Case{"jitter", " jitter "}, Case{"jitter=500us", " jitter "},
        Case{"jitter=3ms", " jitter "}, Case{"jitter=8ms", " jitter "},
        Case{"dark", " dark "}, Case{"dark=0.1", " dark "},
        Case{"bright", " bright "}, Case{"bright=5", " bright "},
        Case{"vignetting", " vignetting "},
        Case{"vignetting=0.45", " vignetting "}, Case{"drift", " drift "},
        Case{"drift=-0.2", " drift "}, Case{"drift=0.3", " drift "},
        Case{"flicker", " flicker "}, Case{"flicker=120:0.03", " flicker "},
        Case{"flicker=0.2:0.1", " flicker "},
        Case{"flicker=100:0.95", " flicker "},
        Case{"flicker=1000:0.05", " flicker "}));

INSTANTIATE_TEST_SUITE_P (Pairs, Faults,
    testing::Values (Case{"flicker exposure-late", " exposure-late "},
        Case{"flicker exposure-short", " exposure-short "},
        Case{"flicker=50:0.1 jitter", " jitter "},
        Case{"flicker frame-late", " frame-late "},
        Case{"drift trigger-edge", " trigger-edge "},
        Case{"vignetting flicker", " vignetting flicker "},
        Case{"drift flicker", " drift flicker "},
        Case{"frame-late exposure-long", " frame-late exposure-long "},
        Case{"exposure-late jitter", " exposure-late jitter "},
        Case{"bright exposure-short", " exposure-short "},
        Case{"lose=0.02 frame-late", " frame-late "},
        Case{"jitter frame-late-varies", " jitter frame-late-varies "}));

/* Noise is many DN there, so that few means are the largest one. */
TEST (LightCheck, SeesThatPixelsOf16BitsAreSaturated)
{
  SickBenchOptions options = bench (7);
  options.bits = 16;
  options.black_level = 1024;
  const Visit seen = visit (options, "bright=1.6");
  EXPECT_EQ (seen.light.verdict (), Verdict::fail);
  ASSERT_FALSE (seen.light.diagnoses.empty ());
  EXPECT_EQ (seen.light.diagnoses[0].id, "bright");
}

/** Faults that other checks find do not look like one of these. */
class OtherFaults : public Faults
{
};

TEST_P (OtherFaults, AreLeftToTheirChecks)
{
  if (effort () == 1)
    GTEST_SKIP () << "DOCTOR_BENCHES=1";
  const char *words = GetParam ().words;
  for (std::uint64_t seed = 1; seed <= std::uint64_t (effort ()); seed++)
    EXPECT_EQ (visit (bench (seed), words).first (), "")
        << words << " seed " << seed;
}

INSTANTIATE_TEST_SUITE_P (OfOtherChecks, OtherFaults,
    testing::Values (Case{"nonlinear", ""}, Case{"noise", ""},
        Case{"black-clipped", ""}, Case{"hot-pixels", ""},
        Case{"dead-pixels", ""}, Case{"missing-bits", ""}, Case{"leak", ""},
        Case{"leak=0.3", ""}, Case{"slow-mirrors", ""}, Case{"stuck-on", ""},
        Case{"stuck-off", ""}, Case{"turned=180", ""}, Case{"blur", ""},
        Case{"focus-tilt", ""}, Case{"perspective", ""}, Case{"distortion", ""},
        Case{"rotation", ""}, Case{"scale", ""}, Case{"shift", ""},
        Case{"dust", ""}, Case{"lose", ""}, Case{"slip", ""},
        Case{"frame-jitter", ""}));

/* Steps that are as large a part of the range as those of 8 bits without the
 * lowest ones hide the exposure. */
TEST (StepFaults, AreNamedFirst)
{
  constexpr int kMost = 8; // that a simulated camera can lack
  for (const int missing : {3, 4, 6})
    for (std::uint64_t seed = 1; seed <= std::uint64_t (effort ()); seed++) {
      const SickBenchOptions options = bench (seed);
      const std::string words =
          "missing-bits=" +
          std::to_string (std::min (kMost, missing + options.bits - 8));
      EXPECT_EQ (visit (options, words).first (), "missing-bits")
          << words << " seed " << seed;
    }
}

/* 12 bits without a few have steps that are finer than those of 8 bits, or
 * little coarser. */
TEST (StepFaults, AreLeftToTheSensorWhereTheyAreFine)
{
  for (const char *words :
      {"missing-bits=3", "missing-bits=4", "missing-bits=6"})
    for (std::uint64_t seed = 3; seed <= std::uint64_t (3 * effort ());
         seed += 3) {
      SickBenchOptions options = bench (seed);
      ASSERT_EQ (options.bits, 12);
      EXPECT_EQ (visit (options, words).first (), "") << words;
      ASSERT_TRUE (inflict (options, words));
      auto rig = SimulatedRig::make (options);
      ASSERT_TRUE (rig);
      Examination examination{**rig};
      examination.exhibits = false;
      ASSERT_TRUE (check_trigger (examination));
      const auto sensor = check_sensor (examination);
      ASSERT_TRUE (sensor);
      ASSERT_FALSE (sensor->diagnoses.empty ());
      EXPECT_EQ (sensor->diagnoses.front ().id, "missing-bits") << words;
    }
}

TEST (Jitter, IsNamedWhereAllFramesScatter)
{
  for (std::uint64_t seed = 1; seed <= 8; seed++)
    EXPECT_EQ (visit (bench (seed), "jitter=8ms").first (), "jitter") << seed;
}

/** They make the exposure look as if it began before the trigger. */
TEST (SlowMirrors, AreNotAWrongEdge)
{
  for (const char *words :
      {"delay=50us slow-mirrors=1ms", "delay=20us slow-mirrors=2ms"})
    EXPECT_EQ (visit (bench (1), words).first (), "") << words;
}

TEST (RoundingDoubt, VanishesWithNoise)
{
  EXPECT_NEAR (rounding_doubt (0.0, 1), 0.225, 0.001);
  EXPECT_LT (rounding_doubt (0.6, 1), 0.005);
  EXPECT_GT (rounding_doubt (0.6, 8), 1.5);
}

TEST (LevelOf, CountsAllButOddPixels)
{
  Image<std::uint16_t> picture (100, 50);
  for (int y = 0; y < 50; y++)
    for (int x = 0; x < 100; x++)
      picture.at (x, y) = std::uint16_t (100 + 2 * ((x + y) % 2));
  picture.at (50, 20) = 255;
  const Level level = level_of (picture.view (), 255);
  EXPECT_NEAR (level.mean, 101.03, 0.01);
  EXPECT_NEAR (level.noise, std::numbers::sqrt2, 0.01);
  EXPECT_EQ (level.saturated, 1.0 / 5000);
}

TEST (CornerLoss, LooksPastDustAndMissingMirrors)
{
  Image<float> picture (200, 150);
  for (int y = 0; y < 150; y++)
    for (int x = 0; x < 200; x++) {
      const double u = (x - 99.5) / 100.0, v = (y - 74.5) / 75.0;
      const double light = 1.0 - 0.15 * (u * u + v * v);
      const bool spot = std::hypot (x - 60, y - 40) < 6;
      picture.at (x, y) = float (x > 180 ? 0.01 : spot ? 0.3 : light);
    }
  const Measured loss = corner_loss (picture.view ());
  EXPECT_NEAR (loss.value, 0.3, 0.01);
}

TEST (LightFit, FindsWindowAndTwoLines)
{
  LightModel truth{.period = 0.04,
      .gain = 5000.0,
      .drift = 2e-3,
      .start = 3.2e-3,
      .lengths = {0.02},
      .offsets = {4.0},
      .lines = {{100.0, 0.05, 0.06}, {237.3, 0.0, 0.02}}};
  std::vector<LightSample> samples;
  for (int i = 0; i < 400; i++) {
    const int run = i / 8;
    // Every other run begins near the exposure's start.
    const double from = run % 2 == 0 ? 0.04 * ((run * 37) % 57) / 64.0
                                     : 3.2e-3 + 1.5e-4 * (run % 9 - 4.3);
    LightSample sample{.time = 0.04 * (i + 4 * run),
        .from = from,
        .until = from + 0.04 * (3 + run % 5) / 64.0};
    sample.light = truth.light (sample);
    samples.push_back (sample);
  }
  const LightModel guess{.period = 0.04, .start = 3.4e-3, .lengths = {0.0197}};
  const LightFit fit = fit_light (samples, guess);
  EXPECT_NEAR (fit.start.value, 3.2e-3, 1e-7);
  EXPECT_NEAR (fit.lengths[0].value, 0.02, 1e-7);
  ASSERT_EQ (fit.lines.size (), 2u);
  const double mean = 1.0 + truth.drift * fit.epoch;
  EXPECT_NEAR (fit.lines[0].frequency.value, 100.0, 1e-3);
  EXPECT_NEAR (fit.lines[0].depth.value, std::hypot (0.05, 0.06) / mean, 1e-4);
  EXPECT_NEAR (fit.lines[1].frequency.value, 237.3, 1e-3);
  EXPECT_NEAR (fit.lines[1].depth.value, 0.02 / mean, 1e-4);
}

} // namespace
