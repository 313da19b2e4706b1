/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The checks of the parts and of a recording, and the order of all checks. */
#include "checked_bench.h"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "base/pixels.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

std::vector<std::string>
names_of (const std::vector<Check> &checks)
{
  std::vector<std::string> names;
  for (const Check &check : checks)
    names.push_back (check.name);
  return names;
}

TEST (PartsCheck, AHealthyBenchPassesAndIsNamedInTheProfile)
{
  const CheckedBench e = check_bench (healthy_bench (1), check_parts);
  EXPECT_EQ (e.first_diagnosis (), "");
  EXPECT_EQ (e.found ().camera.serial, e.rig->parts ().camera.serial);
  EXPECT_EQ (e.found ().dmd->serial, e.rig->parts ().dmd_device.serial);
  EXPECT_EQ (e.found ().bits, 12);
}

TEST (PartsCheck, NamesWhatIsWrong)
{
  for (const char *words :
      {"rolling-shutter", "colour", "test-image", "gamma", "auto-exposure",
          "auto-gain", "black-clamp", "lut", "binning", "roi", "pixel-format",
          "firmware", "packet-size", "packet-loss=0.05", "lose=0.3"})
    expect_named (words, check_parts);
}

TEST (PartsCheck, FramesOfEightBitsAreNamedOnEveryBench)
{
  for (const int seed : {2, 3}) { // of 8 and of 12 bits
    const CheckedBench e =
        check_bench (sick_bench (seed, "pixel-format"), check_parts);
    EXPECT_EQ (e.first_diagnosis (), "pixel-format") << seed;
    EXPECT_EQ (e.found ().bits, 8) << seed;
    const SickBenchOptions well = healthy_bench (seed);
    EXPECT_NEAR (e.truth ().black_level->value / 255.0,
        well.black_level / largest_pixel (well.bits), 1e-12)
        << seed;
  }
}

TEST (PartsCheck, LeavesOtherFaultsToOtherChecks)
{
  for (const char *words : {"half-rate", "double-rate", "free-running=24.7",
           "exposure-late=2ms", "dark", "flicker=100:0.1", "lose=0.02"})
    EXPECT_EQ (
        check_bench (sick_bench (4, words), check_parts).first_diagnosis (), "")
        << words;
}

TEST (PartsCheck, FramesThatDoNotComeAreNotGood)
{
  for (const char *words : {"no-trigger", "lose=1"}) {
    auto rig = SimulatedRig::make (sick_bench (4, words));
    ASSERT_TRUE (rig);
    Examination examination{**rig};
    const auto found = check_parts (examination);
    ASSERT_TRUE (found);
    EXPECT_EQ (found->verdict (), Verdict::unknown) << words;
    EXPECT_EQ (found->diagnoses.at (0).id, "no-trigger") << words;
  }
}

TEST (PartsCheck, AMissingPartIsNamedByItsError)
{
  const auto id = [] (ErrorCode code, bool camera) {
    return part_missing ({"why", code}, camera).diagnoses.at (0).id;
  };
  EXPECT_EQ (id (ErrorCode::not_found, true), "camera-missing");
  EXPECT_EQ (id (ErrorCode::not_found, false), "dmd-missing");
  EXPECT_EQ (id (ErrorCode::denied, false), "dmd-permission");
  EXPECT_EQ (id (ErrorCode::busy, false), "dmd-busy");
}

TEST (PartsCheck, ASlowDiskFailsBelowWhatRecordingNeeds)
{
  auto rig = SimulatedRig::make (healthy_bench (2));
  ASSERT_TRUE (rig);
  const Extent size = (*rig)->parts ().camera.size;
  const double needed = 25.0 * size.width * size.height;
  Examination examination{**rig};
  for (const auto &[rate, verdict] : {std::pair{0.9, Verdict::fail},
           std::pair{1.5, Verdict::warn}, std::pair{2.1, Verdict::pass}}) {
    examination.host.disk_rate = Measured{rate * needed, 0.0};
    EXPECT_EQ (check_parts (examination)->verdict (), verdict) << rate;
  }
}

TEST (WholeCheck, NamesWhatIsWrong)
{
  for (const char *words : {"lose=0.05", "slip=7s", "frame-jitter=60ms"})
    expect_named (words, check_whole);
}

TEST (WholeCheck, SaysTheJitterInWholeNanoseconds)
{
  const CheckedBench e = check_bench (sick_bench (4, ""), check_whole);
  const Reading *jitter = e.finding.reading ("jitter of arrival");
  ASSERT_TRUE (jitter);
  EXPECT_EQ (jitter->number.value, 0.0);
}

TEST (WholeCheck, DoesNotKnowSlotsWithoutAMapping)
{
  const CheckedBench e = check_bench (healthy_bench (3), check_whole);
  EXPECT_EQ (e.finding.verdict (), Verdict::unknown);
  EXPECT_EQ (e.first_diagnosis (), "");
}

/** The check of a recording, where all that others measure is known. */
Finding
recorded (const SickBenchOptions &options, const char *schedule)
{
  auto rig = SimulatedRig::make (options);
  EXPECT_TRUE (rig);
  Examination examination{**rig};
  examination.profile = (*rig)->truth ().profile;
  examination.inside = {1, 14, 16};
  examination.schedule = *Schedule::parse (schedule);
  examination.recording = 100.0 * options.rate.den / options.rate.num;
  auto finding = check_whole (examination);
  EXPECT_TRUE (finding) << finding.error ().message;
  return *std::move (finding);
}

TEST (WholeCheck, KnowsTheCodeOfTheSlots)
{
  int seed = 1;
  for (const char *schedule : {"staircase:2x2", "s-matrix:4x2",
           "sequential:2x2", "staircase:lattice:8/3"}) {
    const Finding finding = recorded (healthy_bench (seed++), schedule);
    EXPECT_EQ (finding.verdict (), Verdict::pass)
        << schedule << " "
        << finding.reading ("largest difference of a slot")->number.value;
  }
}

TEST (WholeCheck, FindsASlotWithOtherLight)
{
  for (const char *schedule : {"staircase:2x2", "sequential:2x2"}) {
    const Finding finding =
        recorded (sick_bench (2, "flicker=50:0.3"), schedule);
    ASSERT_FALSE (finding.diagnoses.empty ()) << schedule;
    EXPECT_EQ (finding.diagnoses[0].id, "slots-differ") << schedule;
    EXPECT_TRUE (finding.is_ill ()) << schedule;
  }
}

/* Of 8 bits, such a slot has less than 1 DN, and pixels are all rounded alike.
 */
TEST (WholeCheck, DoesNotKnowSlotsThatRoundingHides)
{
  SickBenchOptions options = healthy_bench (1);
  options.black_level *= 255.0 / largest_pixel (options.bits);
  options.bits = 8;
  options.full_well = 30'000;
  options.read_noise = 3;
  options.switching = 0;
  const Finding finding = recorded (options, "sequential:16x16");
  const auto slots =
      std::ranges::find (finding.diagnoses, "slots-differ", &Diagnosis::id);
  ASSERT_NE (slots, finding.diagnoses.end ());
  EXPECT_EQ (slots->severity, Verdict::unknown) << slots->cause;
}

TEST (WholeCheck, NamesASlotThatTheExposureCuts)
{
  SickBenchOptions options = healthy_bench (1);
  options.delay = 0;
  options.readout = 500'000;
  const Finding finding = recorded (options, "sequential:8x8");
  ASSERT_EQ (finding.diagnoses.size (), 1u);
  EXPECT_EQ (finding.diagnoses[0].id, "slot-cut");
  EXPECT_EQ (finding.verdict (), Verdict::warn);
  EXPECT_NEAR (
      finding.reading ("light that a slot loses")->number.value, 80.0, 0.5);
}

TEST (WholeCheck, DoesNotJudgeAFewFrames)
{
  auto rig = SimulatedRig::make (healthy_bench (3));
  ASSERT_TRUE (rig);
  Examination examination{**rig};
  examination.profile = (*rig)->truth ().profile;
  examination.recording = 0.05;
  EXPECT_EQ (check_whole (examination)->verdict (), Verdict::unknown);
}

/** A healthy bench at @p rate and with @p schedule, from the first check to the
 * last. */
void
expect_healthy (int seed, FrameRate rate, const char *schedule)
{
  SCOPED_TRACE (
      testing::Message () << seed << " " << rate.num << " " << schedule);
  SickBenchOptions options = healthy_bench (seed);
  options.rate = rate;
  auto rig = SimulatedRig::make (options);
  ASSERT_TRUE (rig);
  Examination examination{**rig};
  examination.exhibits = false;
  examination.schedule = *Schedule::parse (schedule);
  examination.recording = 100.0 * rate.den / rate.num;
  std::vector<Finding> findings;
  for (const Check &check : all_checks ()) {
    auto finding = run_check (check, examination, findings);
    ASSERT_TRUE (finding) << finding.error ().message;
    EXPECT_LT (finding->verdict (), Verdict::warn)
        << check.name << " " << verdict_text (finding->verdict ()) << " "
        << (finding->diagnoses.empty () ? "" : finding->diagnoses[0].cause);
    findings.push_back (*std::move (finding));
  }
}

TEST (Doctor, GivesNoAlarmForHealthyBenches)
{
  expect_healthy (1, {25, 1}, "staircase:2x2");
  expect_healthy (3, {5, 1}, "sequential:2x2");
}

TEST (Checks, WhatANamedCheckNeedsIsDoneBefore)
{
  using Names = std::vector<std::string>;
  EXPECT_EQ (names_of (*choose_checks ("", true)), names_of (all_checks ()));
  EXPECT_EQ (names_of (*choose_checks ("trigger", false)),
      (Names{"parts", "trigger"}));
  EXPECT_EQ (names_of (*choose_checks ("whole,light", true)),
      (Names{"parts", "trigger", "light", "whole"}));
  EXPECT_FALSE (choose_checks ("trigger,soul", true));
}

TEST (Checks, OneIsSkippedAfterAFailureThatItNeeds)
{
  auto rig = SimulatedRig::make (healthy_bench (4));
  ASSERT_TRUE (rig);
  Examination examination{**rig};
  const Check check{"b", "B", {"a"}, [] (Examination &) {
                      return Result<Finding> (Finding{"b", "something"});
                    }};
  Finding before{"a", "something"};
  EXPECT_FALSE (run_check (check, examination, {before})->skipped);
  before.diagnoses = {{"x", Verdict::warn, "", ""}};
  EXPECT_FALSE (run_check (check, examination, {before})->skipped);
  before.diagnoses[0].severity = Verdict::fail;
  EXPECT_TRUE (run_check (check, examination, {before})->skipped);
  EXPECT_TRUE (run_check (
      check, examination, {{.check = "a", .shown = {}, .skipped = true}})
                   ->skipped);
}

TEST (Findings, AreJudgedByRules)
{
  Finding finding{"light", "light"};
  EXPECT_EQ (finding.measure ("flicker", {0.7, 0.1}, "why"), Verdict::pass);
  EXPECT_EQ (finding.measure ("flicker", {0.9, 0.04}, "why"), Verdict::pass);
  EXPECT_EQ (finding.measure ("flicker", {1.3, 0.1}, "why"), Verdict::warn);
  EXPECT_EQ (finding.measure ("flicker", {2.3, 0.1}, "why"), Verdict::fail);
  EXPECT_EQ (finding.measure ("drift", {-2.5, 0.1}), Verdict::warn);
  EXPECT_EQ (finding.measure ("level", {14.0, 0.0}), Verdict::fail);
  EXPECT_EQ (finding.readings[0].rule, "at most 1");
  EXPECT_EQ (finding.readings[4].rule, "-2 to 2");
  EXPECT_EQ (finding.readings[5].rule, "at least 40");
  finding.sort ();
  ASSERT_EQ (finding.diagnoses.size (), 4u);
  EXPECT_EQ (finding.diagnoses[0].id, "flicker");
  EXPECT_EQ (finding.diagnoses[1].id, "dark");
  EXPECT_EQ (
      finding.diagnoses[3].cause, "the light changes by -2.50 % a minute");
  EXPECT_FALSE (finding.diagnoses[3].remedy.empty ());
}

TEST (Findings, WhatIsNotKnownIsNotGood)
{
  for (const Measured number : {Measured{NAN, 0.1}, Measured{0.1, INFINITY}}) {
    Finding finding{"light", "light"};
    EXPECT_EQ (finding.measure ("flicker", number), Verdict::unknown);
    EXPECT_EQ (finding.diagnoses.at (0).cause,
        "flicker could not be measured: it should be at most 1 %");
    EXPECT_FALSE (finding.is_ill ());
    EXPECT_EQ (finding.verdict (), Verdict::unknown);
    const auto json = nlohmann::json::parse (findings_json ({finding}));
    EXPECT_EQ (json["verdict"], "UNKNOWN");
    finding.blame ("dark", "why", Verdict::warn);
    EXPECT_EQ (finding.verdict (), Verdict::warn);
    EXPECT_FALSE (finding.is_known ());
  }
}

TEST (Findings, WhatMayBeBeyondTheLimitIsNotGood)
{
  EXPECT_EQ (verdict_of ("flicker", {0.0, 23.0}), Verdict::unknown);
  EXPECT_EQ (verdict_of ("flicker", {0.9, 0.6}), Verdict::unknown);
  EXPECT_EQ (verdict_of ("flicker", {1.1, 0.1}), Verdict::unknown);
  EXPECT_EQ (verdict_of ("drift", {-2.1, 0.1}), Verdict::unknown);
  EXPECT_EQ (verdict_of ("level", {39.0, 1.0}), Verdict::unknown);
  EXPECT_EQ (verdict_of ("noise", {19.0, 1.0}), Verdict::unknown);
  Finding finding{"light", "light"};
  finding.judge ("flicker", {1.1, 0.1});
  ASSERT_EQ (finding.diagnoses.size (), 1u);
  EXPECT_EQ (finding.verdict (), Verdict::unknown);
  EXPECT_EQ (finding.diagnoses[0].cause,
      "flicker is 1.10 +- 0.100 %, too uncertain to tell whether it is at "
      "most 1");
}

TEST (Findings, AReadingWithoutAUnitHasNoGap)
{
  Finding finding{"whole", "your schedule"};
  finding.judge ("slots-differ", {0.01, 0.0057});
  finding.judge ("slots-differ", {NAN, NAN});
  EXPECT_EQ (finding.diagnoses.at (0).cause,
      "largest difference of a slot is 0.0100 +- 0.00570, too uncertain to "
      "tell whether it is -0.02 to 0.02");
  EXPECT_EQ (finding.diagnoses.at (1).cause,
      "largest difference of a slot could not be measured: it should be -0.02 "
      "to 0.02");
}

TEST (Findings, TheirJsonHasTheWorstVerdict)
{
  Finding good{"a", "light"}, bad{"b", "more \"light\""};
  good.readings = {{"level", {0.5, 0.1}, "%", "at most 1"}};
  bad.diagnoses = {{"dark", Verdict::fail, "why", "try"}};
  const auto json = nlohmann::json::parse (findings_json ({good, bad}));
  EXPECT_EQ (json["format"], "coded-exposure-findings");
  EXPECT_EQ (json["verdict"], "FAIL");
  EXPECT_EQ (json["checks"][0]["verdict"], "PASS");
  EXPECT_EQ (json["checks"][0]["readings"][0]["sigma"], 0.1);
  EXPECT_EQ (json["checks"][1]["shown"], "more \"light\"");
  EXPECT_EQ (json["checks"][1]["diagnoses"][0]["id"], "dark");
}

} // namespace
