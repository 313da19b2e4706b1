/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The check of the sensor, on simulated benches whose numbers are known. */
#include "checked_bench.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

TEST (SensorCheck, NumbersOfHealthyBenchesAreThoseInjected)
{
  int covered = 0, all = 0;
  for (int seed = 0; seed < bench_count (6); seed++) {
    const CheckedBench e = check_bench (healthy_bench (seed), check_sensor);
    SCOPED_TRACE ("bench " + std::to_string (seed));
    EXPECT_EQ (e.finding.verdict (), Verdict::pass) << e.first_diagnosis ();
    EXPECT_LT (e.seconds, 35.0);
    const BenchProfile &truth = e.truth (), &found = e.found ();
    ASSERT_TRUE (found.full_well && found.read_noise && found.black_level &&
                 found.linearity_error);
    expect_near (*found.full_well, truth.full_well->value,
        0.05 * truth.full_well->value, "full well");
    EXPECT_NEAR (found.read_noise->value, truth.read_noise->value,
        0.05 * truth.read_noise->value);
    EXPECT_NEAR (found.black_level->value, truth.black_level->value, 0.2);
    EXPECT_LT (found.linearity_error->value, 0.003);
    /* A pixel may be drawn as both. */
    EXPECT_NEAR (e.finding.reading ("hot pixels")->number.value,
        double (e.rig->truth ().hot.size ()), 1.0);
    EXPECT_NEAR (e.finding.reading ("dead pixels")->number.value,
        double (e.rig->truth ().dead.size ()), 1.0);
    BenchProfile profile = found;
    profile.camera.size = e.rig->truth ().options.camera;
    profile.bits = e.rig->truth ().options.bits;
    const auto valid = profile.check ();
    EXPECT_TRUE (valid) << valid.error ().message;
    for (const auto &[measured, exact] :
        {std::pair{found.full_well, truth.full_well},
            std::pair{found.read_noise, truth.read_noise},
            std::pair{found.black_level, truth.black_level}}) {
      covered +=
          std::abs (measured->value - exact->value) <= 2 * measured->sigma;
      all++;
    }
  }
  EXPECT_GT (covered, 0.85 * all);
}

TEST (SensorCheck, NamesWhatIsWrong)
{
  for (const char *words :
      {"nonlinear=0.05", "nonlinear=-0.03", "noise=100", "black-clipped=2",
          "hot-pixels=200", "dead-pixels=200", "missing-bits=2", "prnu=0.05"})
    expect_named (words, check_sensor);
}

TEST (SensorCheck, MeasuresHowTheSensitivityOfPixelsDiffers)
{
  for (const double prnu : {0.005, 0.01, 0.03, 0.05, 0.08}) {
    const CheckedBench e = check_bench (
        sick_bench (5, "prnu=" + std::to_string (prnu)), check_sensor);
    const Reading *found = e.finding.reading ("PRNU");
    ASSERT_TRUE (found);
    EXPECT_NEAR (found->number.value, 100.0 * prnu, 6.0 * prnu + 0.05) << prnu;
    EXPECT_EQ (
        e.finding.verdict (), prnu > 0.02 ? Verdict::warn : Verdict::pass)
        << prnu;
  }
}

TEST (SensorCheck, TakesLightOfAnyKind)
{
  for (const char *words : {"vignetting=0.6", "bright=1.6", "drift=0.1",
           "leak=0.03", "leak=0.15", "stuck-on=20", "dust=6", "shift=100/0"}) {
    const CheckedBench e = check_bench (sick_bench (3, words), check_sensor);
    EXPECT_EQ (e.finding.verdict (), Verdict::pass) << words;
    expect_near (*e.found ().full_well, e.truth ().full_well->value,
        0.05 * e.truth ().full_well->value, words);
  }
}

/** A camera without the feature that would tell of it. */
TEST (SensorCheck, NamesAPowerOfTheLight)
{
  for (const int seed : {2, 3}) {
    SickBenchOptions options = healthy_bench (seed);
    options.gamma = 0.45;
    const CheckedBench e = check_bench (options, check_sensor);
    EXPECT_EQ (e.first_diagnosis (), "nonlinear") << seed;
    EXPECT_EQ (e.finding.verdict (), Verdict::fail) << seed;
    BenchProfile profile = e.found ();
    profile.camera.size = options.camera;
    profile.bits = options.bits;
    const auto valid = profile.check ();
    EXPECT_TRUE (valid) << valid.error ().message;
  }
}

TEST (SensorCheck, MeasuresTheBowOfTheResponse)
{
  for (const char *bow : {"0.01", "0.03", "-0.02"}) {
    const CheckedBench e = check_bench (
        sick_bench (5, std::string ("nonlinear=") + bow), check_sensor);
    ASSERT_TRUE (e.found ().linearity_error);
    EXPECT_NEAR (
        e.found ().linearity_error->value, std::abs (std::atof (bow)), 0.003);
    expect_near (*e.found ().full_well, e.truth ().full_well->value,
        0.05 * e.truth ().full_well->value, bow);
  }
}

} // namespace
