/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Bench profiles: their JSON form, and which bench they are of. */
#include "setup/bench_profile.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>

#include "setup/stream_setup.h"

using namespace codedexposure;

namespace
{

using namespace std::chrono_literals;

BenchProfile
plain ()
{
  BenchProfile profile;
  profile.measured = std::chrono::sys_days (2026y / 3 / 14) + 9h + 26min + 53s;
  profile.camera.size = {64, 48};
  return profile;
}

BenchProfile
full ()
{
  BenchProfile profile = plain ();
  profile.camera.vendor = "Allied Vision";
  profile.camera.model = "Alvium \"1800\" é";
  profile.camera.serial = "0123";
  profile.dmd =
      BenchProfile::Device{{}, "LightCrafter 4500", "17", {912, 1140}};
  profile.pixel_format = "Mono12";
  profile.bits = 12;
  profile.conversion_gain = Measured{2.44, 0.1 + 0.2};
  profile.full_well = Measured{9870, 40};
  profile.read_noise = Measured{4.9, 1e-3};
  profile.black_level = Measured{15.8, 0.05};
  profile.linearity_error = Measured{0.002, 0.0005};
  profile.leak = Measured{0.0021, 1e-300};
  profile.trigger_delay = Measured{-18400.25, 3000};
  profile.exposure = Measured{39.2e6, 5000};
  profile.psf_sigma = Measured{0.52, 0.0};
  profile.mapping = Mapping (Extent{64, 48});
  return profile;
}

BenchProfile
of_two ()
{
  BenchProfile both = full ();
  BenchProfile second = plain ();
  second.camera.serial = "0456";
  second.mapping = Mapping (Extent{64, 48});
  second.light_ratio = Measured{1.25, 0.002};
  both.second = {second};
  return both;
}

std::string
refusal (const BenchProfile &profile)
{
  const auto good = profile.check ();
  return good ? "" : good.error ().message;
}

std::string
refusal (const std::string &from, const std::string &to)
{
  std::string json = full ().to_json ();
  const std::size_t at = json.find (from);
  EXPECT_NE (at, json.npos) << from;
  if (at != json.npos)
    json.replace (at, from.size (), to);
  const auto read = BenchProfile::from_json (json);
  return read ? "" : read.error ().message;
}

TEST (BenchProfile, ItsBlurIsThatOfAnAlignedCameraIfThereIsNoMapping)
{
  BenchProfile profile;
  profile.camera.size = {64, 48};
  EXPECT_EQ (profile.known_mapping (), std::nullopt);
  profile.psf_sigma = Measured{0.3, 0.01};
  const auto aligned = profile.known_mapping ();
  ASSERT_TRUE (aligned);
  EXPECT_TRUE (aligned->one_to_one (1e-9));
  EXPECT_EQ (aligned->camera (), profile.camera.size);
  EXPECT_EQ (aligned->psf_sigma (), 0.3);
  profile.mapping = Mapping (Extent{64, 48});
  EXPECT_EQ (profile.known_mapping (), profile.mapping);
}

TEST (BenchProfile, ReadsBackBitForBit)
{
  for (const BenchProfile &profile : {plain (), full (), of_two ()}) {
    const std::string json = profile.to_json ();
    const auto read = BenchProfile::from_json (json);
    ASSERT_TRUE (read.ok ()) << read.error ().message;
    EXPECT_EQ (*read, profile);
    EXPECT_EQ (read->to_json (), json);
  }
  EXPECT_EQ (plain ().to_json (),
      R"({"format":"coded-exposure-bench","version":1,)"
      R"("measured":"2026-03-14T09:26:53Z","camera":{"size":[64,48]},)"
      R"("bits":8})");
}

TEST (BenchProfile, OfTwoCamerasHasOneForEachBeam)
{
  const BenchProfile both = of_two ();
  EXPECT_EQ (both.of_beam (false), full ());
  EXPECT_EQ (both.of_beam (true), both.second.front ());
  EXPECT_EQ (full ().of_beam (true), full ()) << "of one camera in that beam";
  bool has_ratio = false;
  for (const auto &[name, text] : both.rows ())
    has_ratio |= name == "second camera: light ratio" && text == "1.25 ± 0.002";
  EXPECT_TRUE (has_ratio);
}

TEST (BenchProfile, RefusesASecondCameraThatIsNone)
{
  BenchProfile wrong = of_two ();
  wrong.second.front ().bits = 17;
  EXPECT_EQ (refusal (wrong), "second camera: 17 bits of a pixel are not 1 to "
                              "16");
  wrong = of_two ();
  wrong.light_ratio = Measured{1, 0};
  EXPECT_EQ (refusal (wrong),
      "a light ratio belongs to the second camera, not to the first; move it "
      "there");
  wrong = of_two ();
  wrong.second.front ().camera.size = {96, 48};
  wrong.second.front ().mapping = Mapping (Extent{96, 48});
  EXPECT_EQ (refusal (wrong),
      "the mappings of both cameras are to 64x48 and 96x48 mirrors, but they "
      "look at the same ones; measure both again");
  wrong = of_two ();
  wrong.second.front ().second = {plain ()};
  EXPECT_EQ (refusal (wrong),
      "the second camera of a profile has no second one itself; leave it out");
  const auto read = BenchProfile::from_json (wrong.to_json ());
  ASSERT_FALSE (read);
  EXPECT_EQ (read.error ().message,
      "bench profile JSON: in key 'second': the second camera of a profile has "
      "no second one itself; leave it out");
  std::string deep;
  for (int i = 0; i < 100'000; i++)
    deep += R"({"second":)";
  EXPECT_FALSE (BenchProfile::from_json (deep));
}

/* Cameras say their names in any encoding. */
TEST (BenchProfile, WritesNamesThatAreNoText)
{
  BenchProfile profile = plain ();
  profile.camera.vendor = "M\xfcller";
  const auto read = BenchProfile::from_json (profile.to_json ());
  ASSERT_TRUE (read.ok ()) << read.error ().message;
  EXPECT_EQ (read->camera.vendor, "M\xef\xbf\xbdller");
}

TEST (BenchProfile, IsReadFromATextOrAFile)
{
  const std::string path = testing::TempDir () + "bench_profile_test.json";
  ASSERT_TRUE (full ().save (path).ok ());
  const auto loaded = BenchProfile::parse (path);
  std::remove (path.c_str ());
  ASSERT_TRUE (loaded.ok ()) << loaded.error ().message;
  EXPECT_EQ (*loaded, full ());
  EXPECT_EQ (*BenchProfile::parse (full ().to_json ()), full ());
  EXPECT_EQ (BenchProfile::parse ("no.json").error ().message,
      "bench profile 'no.json': it cannot be opened: No such file or "
      "directory");
  BenchProfile wrong = plain ();
  wrong.bits = 17;
  EXPECT_FALSE (wrong.save (path).ok ());
  EXPECT_FALSE (std::ifstream (path).good ());
}

TEST (BenchProfile, RefusesWhatItDoesNotKnow)
{
  const std::string start = "bench profile JSON: ";
  EXPECT_EQ (
      refusal (R"("bits":12)", R"("bits":12,"glare":1)")
          .rfind (start + "there is no key 'glare'; the keys are format", 0),
      0u);
  EXPECT_EQ (refusal (R"("version":1)", R"("version":2)"),
      start + "version 2 is not known; this program reads version 1");
  EXPECT_EQ (refusal (R"("bits":12,)", ""),
      start + "key 'bits' is missing; a bench profile needs at least format, "
              "version, measured, camera and bits");
  for (const char *bits : {"0", "17", "-1"})
    EXPECT_EQ (refusal (R"("bits":12)", std::string (R"("bits":)") + bits),
        start + "key 'bits' must be a whole number from 1 to 16, not " + bits);
  EXPECT_EQ (refusal (R"({"value":9870.0,"sigma":40.0})", "9870"),
      start + "key 'full_well' must be an object, not 9870");
  EXPECT_EQ (refusal (R"(,"sigma":40.0)", ""),
      start + "key 'full_well.sigma' is missing; a measured number has a value "
              "and a sigma");
  for (const char *time : {"2026-02-29T09:26:53Z", "2026-03-14T24:26:53Z",
           "2026-03-14 09:26:53Z", "2026-03-14T09:26:53", "2026-03-14"})
    EXPECT_EQ (refusal ("2026-03-14T09:26:53Z", time),
        start +
            "key 'measured' must be a UTC time such as "
            "\"2026-03-14T09:26:53Z\", not \"" +
            time + "\"");
  EXPECT_NE (refusal (R"("camera":[64,48])", R"("camera":[32,24])")
                 .find ("the mapping is for frames of 32x24 pixels"),
      std::string::npos);
}

TEST (BenchProfile, RefusesNumbersOutOfRange)
{
  const double nan = std::numeric_limits<double>::quiet_NaN ();
  const struct {
    std::optional<Measured> BenchProfile::*number;
    Measured wrong;
    const char *words;
  } cases[] = {
      {&BenchProfile::conversion_gain, {0, 0}, "conversion gain of 0 e-/DN"},
      {&BenchProfile::full_well, {0, 1}, "full well of 0 e-"},
      {&BenchProfile::read_noise, {-1, 0}, "read noise of -1 e-"},
      {&BenchProfile::black_level, {255, 0}, "black level of 255"},
      {&BenchProfile::leak, {0.6, 0}, "leak of 0.6 is outside of 0 to 0.5;"},
      {&BenchProfile::trigger_delay, {4e12, 0}, "trigger delay of 4e+12 ns"},
      {&BenchProfile::psf_sigma, {nan, 0}, "psf_sigma of nan"},
      {&BenchProfile::psf_sigma, {1, -1}, "sigma of the psf_sigma of -1"},
      {&BenchProfile::exposure, {1, nan}, "sigma of the exposure of nan"},
      {&BenchProfile::exposure, {0, 1}, "the exposure of 0 ns is outside"},
  };
  for (const auto &[number, wrong, words] : cases) {
    BenchProfile profile = plain ();
    profile.*number = wrong;
    EXPECT_NE (refusal (profile).find (words), std::string::npos)
        << words << ": " << refusal (profile);
  }
}

TEST (BenchProfile, KnowsTheElectronsOfANumber)
{
  BenchProfile profile = plain ();
  EXPECT_FALSE (profile.electrons_per_number ());
  profile.black_level = Measured{15.4, 0.1};
  profile.full_well = Measured{2400, 10};
  EXPECT_DOUBLE_EQ (*profile.electrons_per_number (), 10.0);
  profile.conversion_gain = Measured{9.5, 0.1};
  EXPECT_DOUBLE_EQ (*profile.electrons_per_number (), 9.5);
}

TEST (BenchProfile, GivesAScheduleItsLeak)
{
  const Schedule schedule = *Schedule::parse ("staircase:2x2,pilot=4");
  EXPECT_EQ (*plain ().with_leak (schedule), schedule);
  EXPECT_EQ (*full ().with_leak (schedule),
      *Schedule::parse ("staircase:2x2,pilot=4,leak=0.0021"));
  const Schedule by_hand = *Schedule::parse ("staircase:2x2,leak=0.01");
  EXPECT_EQ (*full ().with_leak (by_hand), by_hand);
}

TEST (BenchProfile, RefusesAnotherBench)
{
  const BenchProfile profile = full ();
  EXPECT_TRUE (profile.check_frames ({64, 48}, 12).ok ());
  EXPECT_TRUE (profile.check_frames ({64, 48}, 0).ok ());
  EXPECT_EQ (profile.check_frames ({64, 48}, 10).error ().message,
      "the frames have 10 bits, but those of the bench profile have 12; use "
      "the bench profile of this camera, or measure the bench again");
  EXPECT_EQ (profile.check_frames ({32, 48}, 12).error ().message,
      "the frames have 32x48 pixels, but the camera of the bench profile has "
      "64x48; use the bench profile of this camera, or measure the bench "
      "again");

  EXPECT_TRUE (profile.check_bench (plain ()).ok ());
  BenchProfile other = full ();
  other.camera.serial = "0124";
  EXPECT_EQ (profile.check_bench (other).error ().message,
      "the bench profile is of the camera with the serial number '0123', but "
      "this is '0124'; use the bench profile of this camera, or measure the "
      "bench again");
  other = full ();
  other.dmd->serial = "18";
  EXPECT_NE (profile.check_bench (other).error ().message.find ("DMD"),
      std::string::npos);
}

TEST (BenchProfile, ShowsItsNumbersToPeople)
{
  const auto rows = full ().rows ();
  const auto has = [&] (const char *name, const char *text) {
    return std::find (rows.begin (), rows.end (),
               std::pair<std::string, std::string> (name, text)) != rows.end ();
  };
  EXPECT_TRUE (has ("size", "64x48"));
  EXPECT_TRUE (has ("DMD", "LightCrafter 4500 17"));
  EXPECT_TRUE (has ("full well", "9870 ± 40 e-"));
}

TEST (BenchProfile, SaysThatItIsOldOrOfTheFuture)
{
  const BenchProfile profile = plain ();
  EXPECT_FALSE (profile.why_doubtful (profile.measured - 24h));
  EXPECT_EQ (profile.why_doubtful (profile.measured - 49h),
      "The bench profile was measured 3 days after now, by the clock of this "
      "machine; set the clock, or measure the bench again.");
  EXPECT_FALSE (
      profile.why_doubtful (profile.measured + BenchProfile::kMaxAge));
  const auto old = profile.why_doubtful (profile.measured + 31 * 24h);
  ASSERT_TRUE (old.has_value ());
  EXPECT_EQ (
      old->rfind ("The bench profile was measured 31 days ago. ", 0), 0u);
}

TEST (BenchProfile, TravelsInTheSetupOfAStream)
{
  StreamSetup setup;
  setup.bench = full ();
  const auto read = StreamSetup::from_json (setup.to_json ());
  ASSERT_TRUE (read.ok ()) << read.error ().message;
  EXPECT_EQ (*read, setup);
  std::string wrong = setup.to_json ();
  wrong.replace (wrong.find ("measured"), 8, "pleasure");
  EXPECT_NE (
      StreamSetup::from_json (wrong).error ().message.find ("in key 'bench': "),
      std::string::npos);
}

TEST (BenchProfile, TheExampleOfTheDocumentationIsRead)
{
  std::ifstream page (SOURCE_ROOT "/docs/formats.md");
  ASSERT_TRUE (page.good ());
  int found = 0;
  std::string line, block;
  for (bool fenced = false; std::getline (page, line);) {
    if (!line.starts_with ("```")) {
      block += line + "\n";
      continue;
    }
    if (fenced && block.find ("\"coded-exposure-bench\"") != block.npos) {
      const auto profile = BenchProfile::from_json (block);
      EXPECT_TRUE (profile.ok ()) << profile.error ().message;
      found++;
    }
    fenced = !fenced;
    block.clear ();
  }
  EXPECT_EQ (found, 1);
}

} // namespace
