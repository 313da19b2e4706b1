/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The check of a second camera, on simulated benches whose numbers are known.
 */
#include "checked_bench.h"

#include <algorithm>

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

/** healthy_bench () with a second camera, and the faults @p words. */
SickBenchOptions
bench_of_two (int seed, const std::string &words = {})
{
  SickBenchOptions options = healthy_bench (seed);
  options.second = {random_second_camera (options)};
  const auto done = inflict (options, words);
  EXPECT_TRUE (done) << (done ? "" : done.error ().message);
  return options;
}

const BenchTruth &
truth_of_second (const CheckedBench &e)
{
  return static_cast<SimulatedRig *> (e.rig->second ())->truth ();
}

/** The optics of the first camera have been checked before. */
Result<Finding>
check_second_alone (Examination &examination)
{
  examination.profile.mapping =
      static_cast<SimulatedRig &> (examination.rig).truth ().profile.mapping;
  return check_second (examination);
}

double
worst_corner (const Mapping &mapping, const Mapping &truth)
{
  const auto [width, height] = truth.camera ();
  double worst = 0.0;
  for (const double x : {0.0, width - 1.0})
    for (const double y : {0.0, height - 1.0}) {
      const Position found = mapping.mirror_at (x, y);
      const Position seen = truth.mirror_at (x, y);
      worst = std::max (worst, std::hypot (found.x - seen.x, found.y - seen.y));
    }
  return worst;
}

TEST (SecondCheck, NumbersOfHealthyBenchesAreThoseInjected)
{
  for (int seed = 0; seed < bench_count (2); seed++) {
    SCOPED_TRACE ("bench " + std::to_string (seed));
    const CheckedBench e = check_bench (
        bench_of_two (seed, "vignetting=0 leak=0 second:vignetting=0 "
                            "second:leak=0"),
        check_second_alone);
    EXPECT_EQ (e.finding.verdict (), Verdict::pass) << e.first_diagnosis ();
    EXPECT_LT (e.seconds, 40.0);
    ASSERT_EQ (e.found ().second.size (), 1u);
    const BenchProfile &found = e.found ().second.front ();
    const BenchProfile &second = truth_of_second (e).profile;
    const BenchProfile &first = e.truth ();
    EXPECT_EQ (found.camera.serial, "SIM2");
    EXPECT_EQ (found.bits, second.bits);
    const auto measured = [&e] (const char *name) {
      const Reading *reading = e.finding.reading (name);
      EXPECT_TRUE (reading) << name;
      return reading ? reading->number : Measured{-1e9, 0.0};
    };
    /* The DMD shows its mask some time after the trigger. */
    expect_near (measured ("start of the second camera's exposure"),
        1e-3 * (second.trigger_delay->value - first.trigger_delay->value), 80.0,
        "start");
    expect_near (measured ("exposure of the second camera is shorter by"),
        1e-3 * (first.exposure->value - second.exposure->value), 200.0,
        "length");
    const auto light = [] (const BenchProfile &of, double level) {
      return level * (of.largest () - of.black_level->value) *
             of.exposure->value;
    };
    const double ratio = light (second, truth_of_second (e).options.level) /
                         light (first, e.rig->truth ().options.level);
    ASSERT_TRUE (found.light_ratio && found.black_level && found.psf_sigma);
    expect_near (*found.light_ratio, ratio, 0.015 * ratio, "ratio of light");
    expect_near (*found.black_level, second.black_level->value,
        3e-4 * second.largest (), "black");
    expect_near (*found.psf_sigma, second.psf_sigma->value, 0.03, "blur");
    ASSERT_TRUE (found.mapping && second.mapping);
    EXPECT_LT (worst_corner (*found.mapping, *second.mapping), 0.02);
    BenchProfile both = e.found ();
    both.camera.size = first.camera.size;
    both.bits = first.bits;
    const auto again = BenchProfile::from_json (both.to_json ());
    ASSERT_TRUE (again) << again.error ().message;
    EXPECT_EQ (again->to_json (), both.to_json ());
  }
}

TEST (SecondCheck, NamesWhatIsWrong)
{
  const std::pair<const char *, const char *> faults[] = {
      {"no-trigger", "second-trigger"},
      {"half-rate", "second-trigger"},
      {"double-rate", "second-trigger"},
      {"free-running=24.7", "second-trigger"},
      {"exposure-late=2ms", "second-late"},
      {"exposure-short=4ms", "second-short"},
      {"frame-late=1", "second-frame-late"},
      {"bright=1.6", "second-bright"},
      {"dark=0.03", "second-dark"},
      {"dark=0", "second-dark"},
      {"blur=3", "blur"},
      {"focus-tilt=3:30", "focus-tilt"},
      {"shift=0/-60", "second-shift"},
      {"auto-gain", "auto-gain"},
      {"packet-loss=0.02", "packet-loss"},
      {"lose=0.3", "lose"},
  };
  int seed = 2000;
  for (const auto &[fault, name] : faults) {
    const CheckedBench e =
        check_bench (bench_of_two (seed++, std::string ("second:") + fault),
            check_second_alone);
    bool named = false;
    for (const Diagnosis &diagnosis : e.finding.diagnoses)
      named |= diagnosis.id == name && diagnosis.severity == Verdict::fail;
    EXPECT_TRUE (named) << fault << ": " << e.first_diagnosis ();
  }
}

TEST (SecondCheck, SeesWhatItsCameraDoesNotSay)
{
  const std::pair<const char *, const char *> faults[] = {{"colour", "colour"},
      {"noise-reduction=0.4", "noise-reduction"},
      {"missing-bits=4", "missing-bits"}};
  int seed = 31;
  for (const auto &[fault, name] : faults) {
    const CheckedBench e = check_bench (
        bench_of_two (seed += 2, std::string ("second:mute second:") + fault),
        check_second_alone);
    ASSERT_EQ (e.finding.diagnoses.size (), 1u) << fault;
    EXPECT_EQ (e.finding.verdict (), Verdict::fail) << fault;
    EXPECT_EQ (e.first_diagnosis (), name) << fault;
  }
}

/** Its exposure and its mapping are not known then. */
TEST (SecondCheck, DoesNotJudgeWhatFollowsFromItsLight)
{
  const CheckedBench e =
      check_bench (bench_of_two (4, "second:bright=1.6"), check_second_alone);
  ASSERT_EQ (e.finding.diagnoses.size (), 1u);
  EXPECT_EQ (e.first_diagnosis (), "second-bright");
}

TEST (SecondCheck, SaysWhatItDoesNotCheck)
{
  const CheckedBench e = check_bench (bench_of_two (6), check_second_alone);
  EXPECT_EQ (e.finding.verdict (), Verdict::pass) << e.first_diagnosis ();
  EXPECT_TRUE (std::ranges::any_of (e.finding.notes, [] (const auto &note) {
    return note.first == "not checked of the second camera" &&
           std::ranges::all_of (std::vector<std::string> ({"linearity",
                                    "clipped black", "vignetting", "leakage"}),
               [&] (const std::string &what) {
                 return note.second.find (what) != note.second.npos;
               });
  }));
}

TEST (SecondCheck, ALongerWayOfItsFramesIsSaid)
{
  const CheckedBench e = check_bench (
      bench_of_two (5, "second:frame-jitter=20ms"), check_second_alone);
  EXPECT_EQ (e.finding.verdict (), Verdict::warn);
  EXPECT_EQ (e.first_diagnosis (), "second-arrival");
}

TEST (SecondCheck, AFewFramesThatAreMissingAreSaid)
{
  int seen = 0;
  for (int seed = 1; seed <= 4; seed++) {
    const CheckedBench e = check_bench (
        bench_of_two (seed, "second:lose=0.06"), check_second_alone);
    const Reading *missing =
        e.finding.reading ("second camera: missing frames");
    const Reading *lost = e.finding.reading ("second camera: lost frames");
    ASSERT_TRUE (missing);
    if (e.finding.verdict () == Verdict::fail)
      continue; // of light that did not come; the rest was not looked at
    ASSERT_TRUE (lost);
    const bool any = missing->number.value > 0.0 || lost->number.value > 0.0;
    seen += any;
    EXPECT_EQ (std::ranges::count (e.finding.diagnoses, "lose", &Diagnosis::id),
        any ? 1 : 0);
  }
  EXPECT_EQ (seen, 3);
}

TEST (SecondCheck, ItsPoseIsNoFault)
{
  for (const char *words :
      {"second:rotation=1.5 second:perspective=0.03/0.02 second:flipped-y",
          "second:turned=180 second:scale=0.95"}) {
    const CheckedBench e =
        check_bench (bench_of_two (7, words), check_second_alone);
    EXPECT_EQ (e.finding.verdict (), Verdict::pass)
        << words << ": " << e.first_diagnosis ();
  }
}

TEST (SecondCheck, FaultsOfTheFirstCameraAreNotItsOwn)
{
  const CheckedBench e =
      check_bench (bench_of_two (3, "blur=3 rotation=4"), check_second_alone);
  EXPECT_EQ (e.finding.verdict (), Verdict::pass) << e.first_diagnosis ();
}

TEST (SecondCheck, IsMadeOfTwoCamerasOnly)
{
  EXPECT_FALSE (choose_checks ("second", false));
  SickBenchOptions one;
  const auto refused = inflict (one, "second:blur=2");
  ASSERT_FALSE (refused);
  EXPECT_EQ (refused.error ().message,
      "fault 'second:blur=2' is of a second camera, and this bench has one; "
      "simulate both, or leave it out");
  auto rig = SimulatedRig::make (one);
  ASSERT_TRUE (rig);
  EXPECT_EQ ((*rig)->second (), nullptr);
  Examination examination{**rig};
  const auto finding =
      run_check (choose_checks ("second", true)->at (4), examination, {});
  ASSERT_TRUE (finding);
  EXPECT_TRUE (finding->skipped);
}

} // namespace
