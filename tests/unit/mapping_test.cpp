/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Mappings: both directions, the derived pose, and the JSON form. */
#include "mapping/mapping.h"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <numbers>

#include <sys/resource.h>

#include <gtest/gtest.h>

#include "setup/stream_setup.h"

using namespace codedexposure;

namespace
{

constexpr Extent kCamera = {768, 576};
constexpr Extent kMirrors = {1024, 768};

Mapping
made (Mapping::Parts parts)
{
  auto mapping = Mapping::make (std::move (parts));
  EXPECT_TRUE (mapping.ok ()) << mapping.error ().message;
  return mapping.ok () ? *mapping : Mapping (kCamera);
}

std::string
refusal (Mapping::Parts parts)
{
  const auto mapping = Mapping::make (std::move (parts));
  return mapping.ok () ? "" : mapping.error ().message;
}

/** Rotated by @p degrees, @p scale pixels per mirror, centre on centre. */
Homography
turned (double degrees, double scale, double shift_x = 0, double shift_y = 0)
{
  const double turn = degrees * std::numbers::pi / 180;
  const double c = std::cos (turn) / scale, s = std::sin (turn) / scale;
  const double cx = 383.5, cy = 287.5;
  return {c, -s, 511.5 + shift_x - c * cx + s * cy, s, c,
      383.5 + shift_y - s * cx - c * cy, 0, 0, 1};
}

Mapping::Parts
all_parts ()
{
  Mapping::Parts parts = {kCamera, kMirrors, turned (0.5, 1.01, 3, -2)};
  parts.homography[6] = 1e-6;
  Mapping::Covariance covariance = {};
  for (std::size_t i = 0; i < 8; i++)
    for (std::size_t j = 0; j < 8; j++)
      covariance[i * 8 + j] = i == j ? 1e-8 : 1e-10 / double (i + j);
  parts.covariance = covariance;
  parts.displacement = {2, 3, {0, 0.25, 0, 0, 0, 0}, {0, 0, 0, 0, 0, -0.5}};
  parts.psf_sigma = 0.5;
  return parts;
}

std::string
with (const std::string &more)
{
  return R"({"format":"coded-exposure-mapping","version":1,"camera":[8,6],)"
         R"("mirrors":[8,6],"homography":[1,0,0,0,1,0,0,0,1])" +
         more + "}";
}

std::string
complaint (const std::string &json)
{
  const auto mapping = Mapping::from_json (json);
  return mapping.ok () ? "" : mapping.error ().message;
}

} // namespace

TEST (Mapping, OfTheSameSizeIsTheIdentity)
{
  const Mapping mapping (kCamera);
  EXPECT_EQ (mapping.mirror_at (12.25, 7.5), (Position{12.25, 7.5}));
  EXPECT_TRUE (mapping.one_to_one ());
  EXPECT_EQ (mapping.pose ().magnification, 1.0);
  EXPECT_FALSE (made ({kCamera, kMirrors, turned (0, 1, 0.25)}).one_to_one ());
  EXPECT_TRUE (made ({kCamera, kMirrors, turned (0, 1, 0.04)}).one_to_one ());
  EXPECT_FALSE (
      made ({{9, 9}, {99, 99}, {2, 0, 0, 0, 2, 0, 0, 0, 1}}).one_to_one ());
}

TEST (Mapping, SaysHowTheCameraStands)
{
  const Pose s =
      made ({kCamera, kMirrors, turned (0.5, 1.01, 3.25, -2)}).pose ();
  EXPECT_NEAR (s.shift_x, 3.25, 1e-9);
  EXPECT_NEAR (s.shift_y, -2.0, 1e-9);
  EXPECT_NEAR (s.rotation, 0.5, 1e-12);
  EXPECT_NEAR (s.magnification, 1.01, 1e-12);
  EXPECT_NEAR (s.stretch, 0.0, 1e-12);
  EXPECT_FALSE (s.flipped);
}

TEST (Mapping, TellsAFlipAndAStretch)
{
  const Pose s =
      made ({kCamera, kMirrors, {-1.02, 0, 900, 0, 1, 96, 0, 0, 1}}).pose ();
  EXPECT_TRUE (s.flipped);
  EXPECT_NEAR (s.rotation, 0.0, 1e-12);
  EXPECT_NEAR (s.stretch, 0.02, 1e-12);
}

TEST (Mapping, PlacesGoBothWays)
{
  const Mapping mapping = made (all_parts ());
  for (const Position p : {Position{0, 0}, Position{767, 575},
           Position{383.5, 100.25}, Position{-3, 580}}) {
    const Position m = mapping.mirror_at (p.x, p.y);
    const Position back = mapping.camera_at (m);
    EXPECT_NEAR (back.x, p.x, 1e-9);
    EXPECT_NEAR (back.y, p.y, 1e-9);
  }
}

TEST (Mapping, RowsOfMirrorsAreSeenWhereEachIs)
{
  Mapping::Parts tilted = all_parts ();
  tilted.displacement.reset ();
  Mapping::Parts bent = tilted;
  /* Changes by 0.1 mirrors a pixel where it is steepest. */
  bent.displacement = {9, 2,
      {0, 5, 0, -4, 4, 0, 5, -4, 3, 0, 2, 0, 9, 1, 0, 8, 0, 1},
      {0, 1, -1, 0, 4, -4, 5, 0, 0, 1, 1, 0, 0, 3, -3, 3, 0, 0}};
  std::vector<Position> seen (std::size_t (kMirrors.width));
  for (const auto &[parts, error] :
      {std::pair (tilted, 1e-9), std::pair (bent, 1e-3)}) {
    const Mapping mapping = made (parts);
    for (const int y : {0, 200, 767}) {
      mapping.camera_row (y, seen);
      for (int x = 0; x < kMirrors.width; x++) {
        const Position at = mapping.camera_at ({double (x), double (y)});
        ASSERT_NEAR (seen[std::size_t (x)].x, at.x, error) << x << ' ' << y;
        ASSERT_NEAR (seen[std::size_t (x)].y, at.y, error) << x << ' ' << y;
      }
    }
  }
}

TEST (Mapping, DisplacementIsBilinearBetweenTheCorners)
{
  Mapping::Parts parts = {{101, 201}, {101, 201}};
  parts.displacement = {2, 3, {0, 1, 0, 0, 0, 0}, {0, 0, 0, 0, 0, -0.5}};
  const Mapping mapping = made (parts);
  EXPECT_EQ (mapping.mirror_at (100, 0), (Position{101, 0}));
  EXPECT_EQ (mapping.mirror_at (100, 200), (Position{100, 199.5}));
  EXPECT_EQ (mapping.mirror_at (50, 50), (Position{50.25, 50}));
  EXPECT_EQ (mapping.mirror_at (0, 0), (Position{0, 0}));
  /* Beyond the frame, that of the border. */
  EXPECT_EQ (mapping.mirror_at (120, -5), (Position{121, -5}));
  const auto slope = mapping.slope_at (50, 50);
  EXPECT_NEAR (slope[0], 1.005, 1e-12);
  EXPECT_NEAR (slope[1], -0.005, 1e-12);
}

TEST (Mapping, SlopeIsThatOfThePlaces)
{
  const Mapping mapping = made (
      {kCamera, kMirrors, {0.98, 0.03, 5, -0.02, 1.01, 7, 2e-5, -1e-5, 1}});
  const auto slope = mapping.slope_at (200, 300);
  const Position l = mapping.mirror_at (199.5, 300);
  const Position r = mapping.mirror_at (200.5, 300);
  EXPECT_NEAR (slope[0], r.x - l.x, 1e-7);
  EXPECT_NEAR (slope[2], r.y - l.y, 1e-7);
}

TEST (Mapping, SlopeFollowsTheDisplacement)
{
  Mapping::Parts parts = {
      {101, 201}, {101, 201}, {0.98, 0.03, 5, -0.02, 1.01, 7, 0, 0, 1}};
  parts.displacement = {2, 3, {0, 1, 2, -1, 0, 3}, {4, 1, 0, 2, 5, -2}};
  const Mapping mapping = made (parts);
  const auto slope = mapping.slope_at (40, 70);
  const Position left = mapping.mirror_at (39.5, 70);
  const Position right = mapping.mirror_at (40.5, 70);
  const Position up = mapping.mirror_at (40, 69.5);
  const Position down = mapping.mirror_at (40, 70.5);
  EXPECT_NEAR (slope[0], right.x - left.x, 1e-9);
  EXPECT_NEAR (slope[1], down.x - up.x, 1e-9);
  EXPECT_NEAR (slope[2], right.y - left.y, 1e-9);
  EXPECT_NEAR (slope[3], down.y - up.y, 1e-9);
}

TEST (Mapping, CentredFormIsTheSameMapping)
{
  const Mapping mapping = made (
      {kCamera, kMirrors, {0.98, 0.03, 5, -0.02, 1.01, 7, 2e-5, -1e-5, 1}});
  const Homography c = mapping.centred ();
  EXPECT_NEAR (c[8], 1.0, 1e-12);
  EXPECT_NEAR (c[2], mapping.mirror_at (383.5, 287.5).x, 1e-9);
  const auto back = Mapping::from_centred (kCamera, kMirrors, c);
  ASSERT_TRUE (back.ok ());
  EXPECT_NEAR (
      back->mirror_at (700, 20).x, mapping.mirror_at (700, 20).x, 1e-9);
}

TEST (Mapping, UncertaintyOfAShiftAndATurn)
{
  Mapping::Parts parts = {kCamera, kMirrors, turned (0, 1)};
  Mapping::Covariance covariance = {};
  covariance[2 * 8 + 2] = 0.01 * 0.01; // of the shift in x
  covariance[1 * 8 + 1] = 0.02 * 0.02; // of x against y
  parts.covariance = covariance;
  const Mapping mapping = made (parts);
  const Pose sigma = mapping.pose_sigma ();
  EXPECT_NEAR (sigma.shift_x, 0.01, 1e-12);
  EXPECT_NEAR (sigma.rotation, 0.01 / 383.5 * 180 / std::numbers::pi, 1e-7);
  EXPECT_NEAR (sigma.magnification, 0.0, 1e-7);

  parts.homography = turned (180, 1);
  EXPECT_NEAR (made (parts).pose_sigma ().rotation, sigma.rotation, 1e-7);
}

TEST (Mapping, RefusesWhatNoBenchHas)
{
  EXPECT_NE (
      refusal ({{0, 5}, kMirrors}).find ("camera of 0x5"), std::string::npos);
  EXPECT_NE (refusal ({kCamera, kMirrors, {1, 0, 0, 0, 1, 0, -0.01, 0, 1}})
                 .find ("horizon must lie outside"),
      std::string::npos);
  EXPECT_NE (refusal ({kCamera, kMirrors, {1, 1, 0, 1, 1, 0, 0, 0, 1}})
                 .find ("must have an inverse"),
      std::string::npos);
  EXPECT_NE (refusal ({kCamera, kMirrors, {NAN, 1, 0, 1, 1, 0, 0, 0, 1}})
                 .find ("homography[0] is nan"),
      std::string::npos);
  Mapping::Parts parts = all_parts ();
  parts.displacement->x.pop_back ();
  EXPECT_NE (refusal (parts).find ("columns x rows = 6"), std::string::npos);
  parts = all_parts ();
  (*parts.covariance)[9] = -1;
  EXPECT_NE (
      refusal (parts).find ("no variance is negative"), std::string::npos);
  parts = all_parts ();
  parts.displacement->y[1] = 2e9;
  EXPECT_NE (refusal (parts).find ("displacement.y[1] is 2e+09; it must be "
                                   "within -1e+09 and 1e+09"),
      std::string::npos);
  EXPECT_NE (refusal ({kCamera, kMirrors, {1, 0, 3e10, 0, 1, 0, 0, 0, 2}})
                 .find ("homography[2] is 1.5e+10"),
      std::string::npos);
}

TEST (Mapping, AMirrorThatIsSeenNowhereIsNotInTheFrame)
{
  Mapping::Parts parts = {kCamera, kMirrors, {1, 0, 0, 0, 0, 1, 0, 1, 10}};
  parts.displacement = {2, 2, {0, 0, 0, 0}, {0, 0, 0, 0}};
  const Position at = made (parts).camera_at ({0, 0});
  EXPECT_FALSE (
      at.x >= 0 && at.x < kCamera.width && at.y >= 0 && at.y < kCamera.height);
}

TEST (MappingJson, HoldsEveryKeyBothWays)
{
  const Mapping mapping = made (all_parts ());
  const auto read = Mapping::from_json (mapping.to_json ());
  ASSERT_TRUE (read.ok ()) << read.error ().message;
  EXPECT_EQ (*read, mapping);
  EXPECT_EQ (read->to_json (), mapping.to_json ());
}

TEST (MappingJson, OfTheIdentity)
{
  EXPECT_EQ (Mapping (Extent{8, 6}).to_json (),
      R"({"format":"coded-exposure-mapping","version":1,"camera":[8,6],)"
      R"("mirrors":[8,6],"homography":[1.0,0.0,0.0,0.0,1.0,0.0,0.0,0.0,1.0]})");
  const auto read = Mapping::from_json (with (""));
  ASSERT_TRUE (read.ok ()) << read.error ().message;
  EXPECT_EQ (*read, Mapping (Extent{8, 6}));
}

TEST (MappingJson, NamesWhatIsWrong)
{
  const struct {
    std::string json, says;
  } cases[] = {
      {"[]", "mapping JSON: it must be an object"},
      {R"({"format":"coded-exposure","version":1})",
          R"(format "coded-exposure" is not known; a mapping begins with)"},
      {R"({"format":"coded-exposure-mapping","version":2})",
          "this program reads version 1"},
      {with (R"(,"skew":1)"), "no key 'skew'; the keys are format"},
      {with (R"(,"camera":[8,6])"), "key 'camera' stands twice"},
      {R"({"format":"coded-exposure-mapping","version":1,"camera":[8,6],)"
       R"("mirrors":[8,6],"homography":[1,0,0]})",
          "key 'homography' must be 9 numbers in a list"},
      {R"({"format":"coded-exposure-mapping","version":1,"camera":[8,6]})",
          "key 'mirrors' is missing"},
      {with (R"(,"covariance":[1])"), "must be 36 numbers"},
      {with (R"(,"displacement":{"columns":2,"rows":2,"x":[0,0,0,0]})"),
          "key 'displacement.y' is missing"},
      {with (R"(,"displacement":{"columns":1,"rows":2,"x":[0,0],"y":[0,0]})"),
          "displacement.columns is 1; it must be 2 to 257"},
  };
  for (const auto &c : cases)
    EXPECT_NE (complaint (c.json).find (c.says), std::string::npos)
        << complaint (c.json);
}

TEST (MappingJson, OfAFile)
{
  const std::string path = testing::TempDir () + "mapping_test.json";
  const Mapping mapping = made (all_parts ());
  ASSERT_TRUE (mapping.save (path).ok ());
  const auto read = Mapping::load (path);
  std::remove (path.c_str ());
  ASSERT_TRUE (read.ok ()) << read.error ().message;
  EXPECT_EQ (*read, mapping);
  EXPECT_EQ (Mapping::load ("/no/such/file").error ().message,
      "mapping file '/no/such/file': it cannot be opened: No such file or "
      "directory");
  EXPECT_NE (Mapping::load ("/dev/zero").error ().message.find ("more than"),
      std::string::npos);
}

TEST (MappingJson, AFailedSaveKeepsTheFile)
{
  const std::string path = testing::TempDir () + "mapping_test_kept.json";
  const Mapping mapping = made (all_parts ());
  ASSERT_TRUE (mapping.save (path).ok ());
  const auto handler = std::signal (SIGXFSZ, SIG_IGN);
  rlimit limit = {};
  getrlimit (RLIMIT_FSIZE, &limit);
  const rlimit full = {16, limit.rlim_max}; // bytes
  setrlimit (RLIMIT_FSIZE, &full);
  const auto saved = mapping.save (path);
  setrlimit (RLIMIT_FSIZE, &limit);
  std::signal (SIGXFSZ, handler);
  const auto read = Mapping::load (path);
  std::remove (path.c_str ());
  ASSERT_FALSE (saved.ok ());
  EXPECT_NE (saved.error ().message.find ("too large"), std::string::npos)
      << saved.error ().message;
  ASSERT_TRUE (read.ok ()) << read.error ().message;
  EXPECT_EQ (*read, mapping);
}

TEST (StreamSetup, CarriesAMappingBesideTheSchedule)
{
  const StreamSetup setup = {Schedule (), made (all_parts ())};
  const auto read = StreamSetup::from_json (setup.to_json ());
  ASSERT_TRUE (read.ok ()) << read.error ().message;
  EXPECT_EQ (*read, setup);
  EXPECT_EQ (StreamSetup{}.to_json (), Schedule ().to_json ());
  EXPECT_EQ (*StreamSetup::from_json (Schedule ().to_json ()), StreamSetup{});
}

TEST (StreamSetup, SaysWhetherATrackAccompaniesTheFrames)
{
  StreamSetup setup;
  EXPECT_EQ (setup.to_json ().find ("track"), std::string::npos);
  setup.track = true;
  const std::string json = setup.to_json ();
  EXPECT_NE (json.find (R"(,"track":true})"), std::string::npos) << json;
  const auto read = StreamSetup::from_json (json);
  ASSERT_TRUE (read.ok ()) << read.error ().message;
  EXPECT_EQ (*read, setup);

  std::string wrong = json;
  wrong.replace (wrong.find ("true"), 4, "1");
  EXPECT_EQ (StreamSetup::from_json (wrong).error ().message,
      "schedule JSON: key 'track' must be true or false, not 1");
}

TEST (StreamSetup, SaysHowManyBitsOfAPixelCount)
{
  StreamSetup setup;
  EXPECT_EQ (setup.to_json ().find ("bits"), std::string::npos);
  setup.bits = 12;
  const std::string json = setup.to_json ();
  EXPECT_NE (json.find (R"(,"bits":12})"), std::string::npos) << json;
  const auto read = StreamSetup::from_json (json);
  ASSERT_TRUE (read.ok ()) << read.error ().message;
  EXPECT_EQ (*read, setup);
  std::string wrong = json;
  wrong.replace (wrong.find ("12"), 2, "17");
  EXPECT_FALSE (StreamSetup::from_json (wrong));
}

TEST (StreamSetup, SaysWhetherTheFramesAreSimulated)
{
  StreamSetup setup;
  EXPECT_EQ (setup.to_json ().find ("simulated"), std::string::npos);
  setup.simulated = true;
  const std::string json = setup.to_json ();
  EXPECT_NE (json.find (R"(,"simulated":true})"), std::string::npos) << json;
  const auto read = StreamSetup::from_json (json);
  ASSERT_TRUE (read.ok ()) << read.error ().message;
  EXPECT_EQ (*read, setup);
}

TEST (StreamSetup, SaysInWhichBeamTheCameraIs)
{
  StreamSetup setup;
  EXPECT_EQ (setup.to_json ().find ("beam"), std::string::npos);
  setup.off_beam = true;
  const std::string json = setup.to_json ();
  EXPECT_NE (json.find (R"(,"beam":"off"})"), std::string::npos) << json;
  EXPECT_EQ (*StreamSetup::from_json (json), setup);
  std::string wrong = json;
  wrong.replace (wrong.find (R"("off")"), 5, R"("on")");
  EXPECT_FALSE (StreamSetup::from_json (wrong));
}

TEST (StreamSetup, SaysHowTheSecondCameraStands)
{
  StreamSetup setup;
  setup.partner = PartnerSetup{{640, 480}};
  const std::string json = setup.to_json ();
  EXPECT_NE (json.find (R"(,"partner":{"size":[640,480]}})"), std::string::npos)
      << json;
  EXPECT_EQ (*StreamSetup::from_json (json), setup);
  setup.partner->mapping = made (all_parts ());
  EXPECT_EQ (*StreamSetup::from_json (setup.to_json ()), setup);
  std::string wrong = json;
  wrong.replace (wrong.find ("640"), 3, "0");
  EXPECT_FALSE (StreamSetup::from_json (wrong));

  setup.partner->electrons = 31.25;
  setup.partner->read_noise = 5.0;
  setup.partner->light_ratio = 0.75;
  const std::string measured = setup.to_json ();
  EXPECT_NE (measured.find (
                 R"("electrons":31.25,"read_noise":5,"light_ratio":0.75}})"),
      std::string::npos)
      << measured;
  EXPECT_EQ (*StreamSetup::from_json (measured), setup);
  for (const char *other : {"-1", "1e10", "\"2\""}) {
    wrong = measured;
    wrong.replace (wrong.find ("31.25"), 5, other);
    const auto refused = StreamSetup::from_json (wrong);
    ASSERT_FALSE (refused) << other;
    EXPECT_NE (refused.error ().message.find ("'electrons'"), std::string::npos)
        << refused.error ().message;
  }
}

TEST (StreamSetup, NamesWhatIsWrongInside)
{
  std::string json = Schedule ().to_json ();
  json.replace (json.size () - 1, 1, R"(,"mapping":{"version":1}})");
  EXPECT_EQ (StreamSetup::from_json (json).error ().message.find (
                 "schedule JSON: in key 'mapping': key 'format' is missing"),
      0u);
}
