/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The check of the mirrors, on simulated benches whose numbers are known. */
#include "checked_bench.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

TEST (MirrorsCheck, NumbersOfHealthyBenchesAreThoseInjected)
{
  for (int seed = 0; seed < bench_count (6); seed++) {
    const CheckedBench e = check_bench (healthy_bench (seed), check_mirrors);
    SCOPED_TRACE ("bench " + std::to_string (seed));
    EXPECT_EQ (e.finding.verdict (), Verdict::pass) << e.first_diagnosis ();
    // A lamp that is in step with the frames is looked at three times.
    const SickBenchOptions &options = e.rig->truth ().options;
    const bool in_step = std::remainder (options.flicker_rate, 25.0) == 0.0 &&
                         options.flicker_depth > 0.002;
    EXPECT_LT (e.seconds, in_step ? 35.0 : 20.0);
    ASSERT_TRUE (e.found ().leak);
    EXPECT_NEAR (e.found ().leak->value, e.truth ().leak->value, 0.0005);
    EXPECT_NEAR (e.found ().leak->value, e.truth ().leak->value,
        3.5 * e.found ().leak->sigma);
    const Measured time = e.finding.reading ("switching time")->number;
    expect_near (time, 1e-3 * double (e.rig->truth ().options.switching), 20.0,
        "switching");
  }
}

TEST (MirrorsCheck, NamesWhatIsWrong)
{
  for (const char *words : {"leak=0.03", "slow-mirrors=500us",
           "slow-mirrors=300us", "slow-mirrors=150us", "slow-mirrors=3ms",
           "stuck-on=20", "stuck-on=2", "stuck-off=20", "stuck-off=100",
           "flipped-x", "flipped-y", "turned=90", "turned=180", "turned=270"})
    expect_named (words, check_mirrors);
}

TEST (MirrorsCheck, CountsStuckMirrors)
{
  for (const char *words : {"stuck-on=20", "stuck-off=20 hot-pixels=100",
           "stuck-on=12 stuck-off=9 dust=4 dead-pixels=50"}) {
    const CheckedBench e = check_bench (sick_bench (8, words), check_mirrors);
    const BenchTruth &truth = e.rig->truth ();
    EXPECT_NEAR (e.finding.reading ("mirrors that are stuck on")->number.value,
        double (truth.stuck_on.size ()), 1.0)
        << words;
    EXPECT_NEAR (e.finding.reading ("mirrors that are stuck off")->number.value,
        double (truth.stuck_off.size ()), 2.0)
        << words;
  }
}

/* The light of all mirrors is that of a part of the exposure then. */
TEST (MirrorsCheck, KnowsThePlaceOfMirrorsWhereLightSaturates)
{
  const CheckedBench e =
      check_bench (sick_bench (8, "stuck-off=20 bright=1.2"), check_mirrors);
  EXPECT_NEAR (e.finding.reading ("mirrors that are stuck off")->number.value,
      double (e.rig->truth ().stuck_off.size ()), 2.0);
}

TEST (MirrorsCheck, LeavesOtherFaultsToOtherChecks)
{
  for (const char *words : {"blur=3", "dust=6", "hot-pixels=200",
           "dead-pixels=200", "vignetting=0.6", "bright=1.6", "rotation=4",
           "scale=1.1", "prnu=0.03", "prnu=0.05", "shift=100/0", "noise=100",
           "nonlinear=0.05", "jitter=40us"})
    EXPECT_EQ (
        check_bench (sick_bench (4, words), check_mirrors).first_diagnosis (),
        "")
        << words;
}

/* The check of the light has named it before. */
TEST (MirrorsCheck, DoesNotKnowTheSwitchingTimeInLightThatFlickers)
{
  const CheckedBench e =
      check_bench (sick_bench (4, "flicker=100:0.1"), check_mirrors);
  EXPECT_EQ (e.finding.verdict (), Verdict::unknown);
  ASSERT_EQ (e.finding.diagnoses.size (), 2u);
  EXPECT_EQ (e.finding.diagnoses[0].id, "leak");
  EXPECT_EQ (e.finding.diagnoses[1].id, "slow-mirrors");
}

TEST (MirrorsCheck, WorksAtHighFrameRates)
{
  for (const int rate : {100, 200, 400}) {
    SickBenchOptions options = healthy_bench (4);
    options.rate = {rate, 1};
    const CheckedBench e = check_bench (options, check_mirrors);
    EXPECT_EQ (e.first_diagnosis (), "") << rate;
    EXPECT_NEAR (e.found ().leak->value, e.truth ().leak->value, 0.0005);
  }
}

/** An exposure that begins almost a period late looks early. */
TEST (MirrorsCheck, NamesAPulseThatEndsWithThePeriod)
{
  SickBenchOptions options = sick_bench (4, "trigger-edge=38ms");
  auto rig = SimulatedRig::make (options);
  ASSERT_TRUE (rig);
  Examination examination{**rig};
  const auto trigger = check_trigger (examination);
  ASSERT_TRUE (trigger);
  EXPECT_EQ (trigger->verdict (), Verdict::unknown);
  const auto mirrors = check_mirrors (examination);
  ASSERT_TRUE (mirrors);
  EXPECT_EQ (mirrors->verdict (), Verdict::fail);
  EXPECT_EQ (mirrors->diagnoses.at (0).id, "trigger-edge");
}

TEST (MirrorsCheck, SaysThatFramesDoNotCome)
{
  EXPECT_EQ (check_bench (sick_bench (4, "no-trigger"), check_mirrors)
                 .first_diagnosis (),
      "no-frames");
}

TEST (MirrorsCheck, SaysHowTheCameraIsTurned)
{
  for (const int turned : {90, 180, 270}) {
    const CheckedBench e = check_bench (
        sick_bench (6, "turned=" + std::to_string (turned)), check_mirrors);
    EXPECT_NE (e.finding.diagnoses.at (0).cause.find (std::to_string (turned)),
        std::string::npos)
        << e.finding.diagnoses.at (0).cause;
  }
}

} // namespace
