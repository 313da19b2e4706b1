/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The check of the optics, on simulated benches whose numbers are known. */
#include "checked_bench.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

double
value_of (const CheckedBench &e, const std::string &name)
{
  const Reading *reading = e.finding.reading (name);
  EXPECT_TRUE (reading) << name;
  return reading ? reading->number.value : -1e9;
}

TEST (OpticsCheck, NumbersOfHealthyBenchesAreThoseInjected)
{
  for (int seed = 0; seed < bench_count (3); seed++) {
    const CheckedBench e = check_bench (healthy_bench (seed), check_optics);
    SCOPED_TRACE ("bench " + std::to_string (seed));
    EXPECT_EQ (e.finding.verdict (), Verdict::pass) << e.first_diagnosis ();
    EXPECT_LT (e.seconds, 35.0);
    ASSERT_TRUE (e.found ().mapping && e.found ().psf_sigma);
    const SickBenchOptions &truth = e.rig->truth ().options;
    EXPECT_NEAR (value_of (e, "rotation"), truth.alignment.rotation, 0.002);
    EXPECT_NEAR (value_of (e, "magnification"), truth.alignment.scale, 1e-4);
    EXPECT_NEAR (
        value_of (e, "perspective in x"), 100 * truth.alignment.tilt_x, 0.01);
    EXPECT_NEAR (
        value_of (e, "perspective in y"), 100 * truth.alignment.tilt_y, 0.01);
    EXPECT_NEAR (
        value_of (e, "distortion"), 100 * truth.alignment.distortion, 0.02);
    EXPECT_NEAR (e.found ().psf_sigma->value, truth.blur, 0.03);
    EXPECT_EQ (value_of (e, "pixels that see a mirror"), 100.0);
    BenchProfile profile = e.found ();
    profile.camera.size = truth.camera;
    profile.bits = truth.bits;
    const auto valid = profile.check ();
    EXPECT_TRUE (valid) << valid.error ().message;
    EXPECT_LT (value_of (e, "Gray codes against gratings"), 0.06);
  }
}

TEST (OpticsCheck, NamesWhatIsWrong)
{
  for (const char *words : {"blur=3", "blur=8", "focus-tilt=3:30",
           "perspective=0.03/0.02", "distortion=-0.02", "rotation=-4",
           "scale=1.1", "shift=0/-60", "dust=6"})
    expect_named (words, check_optics);
}

TEST (OpticsCheck, SaysWhereTheBlurGrows)
{
  for (const auto &[growth, degrees] :
      {std::pair{3.0, 30.0}, std::pair{1.5, 200.0}}) {
    const CheckedBench e =
        check_bench (sick_bench (7, "focus-tilt=" + std::to_string (growth) +
                                        ":" + std::to_string (degrees)),
            check_optics);
    EXPECT_EQ (e.first_diagnosis (), "focus-tilt");
    EXPECT_NEAR (value_of (e, "direction of the growth"), degrees, 10.0);
    EXPECT_NEAR (value_of (e, "growth of the blur over the frame"), growth,
        0.15 * growth);
  }
}

TEST (OpticsCheck, LeavesOtherFaultsToOtherChecks)
{
  for (const char *words :
      {"hot-pixels=200 dead-pixels=200", "stuck-on=20 stuck-off=20",
          "leak=0.03 vignetting=0.6", "flicker=100:0.1", "turned=180"})
    EXPECT_EQ (
        check_bench (sick_bench (4, words), check_optics).first_diagnosis (),
        "")
        << words;
}

} // namespace
