/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The pose of the camera, from frames of gratings and Gray codes. */
#include "calibrate/calibration.h"
#include "calibrate/live_moire.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "moire_bench.h"

using namespace codedexposure;

namespace
{

constexpr Extent kSize = {256, 192};

struct Distance {
  double rms = 0.0; ///< per axis, mirrors
  double most = 0.0;
};

Distance
distance (const Mapping &mapping, const Alignment &alignment)
{
  const Extent size = mapping.camera ();
  Distance found;
  double squares = 0.0, count = 0.0;
  for (int y = 0; y < size.height; y += 5)
    for (int x = 0; x < size.width; x += 5) {
      const Position m = mapping.mirror_at (x, y);
      const Position truth = mirror_seen (
          alignment, size.width, size.height, {double (x), double (y)});
      if (!mapping.covers (truth))
        continue;
      const double dx = m.x - truth.x, dy = m.y - truth.y;
      squares += dx * dx + dy * dy;
      count += 2.0;
      found.most = std::max (found.most, std::hypot (dx, dy));
    }
  found.rms = std::sqrt (squares / count);
  return found;
}

Result<CalibrationResult>
calibrate (MoireBench &bench, Extent size = kSize, int row_step = 1)
{
  const auto patterns = calibration_patterns (size);
  auto run = Calibration::make (size, size, patterns, row_step);
  if (!run)
    return run.error ();
  std::uint64_t number = 0;
  for (const Pattern &pattern : patterns) {
    const Image<std::uint8_t> frame = bench.frame (pattern, number++);
    if (const auto added = run->add (pattern, frame.view ()); !added)
      return added.error ();
  }
  return run->solve ();
}

} // namespace

TEST (LiveMoire, FindsWhereTheCameraStands)
{
  const Alignment alignments[] = {
      {0.3, -1.2, 1.5, 1.01}, {1.8, 0.5, -2, 0.98}, {-1.5, 1.9, 0.3, 1.02}};
  for (const Alignment &alignment : alignments) {
    MoireBench bench (alignment, 0.5, kSize);
    auto live = LiveMoire::make (Mapping (kSize));
    ASSERT_TRUE (live.ok ()) << live.error ().message;
    const auto frame = bench.frame (live_grating (), 0);
    const auto reading = live->solve (frame.view ());
    ASSERT_TRUE (reading.ok ()) << reading.error ().message;
    EXPECT_LT (distance (reading->mapping, alignment).most, 0.02);
    EXPECT_GT (reading->coverage, 0.9);
    EXPECT_NEAR (reading->contrast.x, 0.75, 0.1);
    EXPECT_NEAR (reading->contrast.y, 0.75, 0.1);
    EXPECT_EQ (reading->saturated, 0u);
  }
}

TEST (LiveMoire, ShiftsAreTheNearestToWhatIsExpected)
{
  const Alignment alignment = {21.3, -18.2, 0.5, 1.005};
  MoireBench bench (alignment, 0.5, kSize);
  const auto near =
      Mapping::make ({kSize, kSize, {1, 0, 20, 0, 1, -19, 0, 0, 1}});
  auto live = LiveMoire::make (*near);
  const auto frame = bench.frame (live_grating (), 0);
  const auto reading = live->solve (frame.view ());
  ASSERT_TRUE (reading.ok ()) << reading.error ().message;
  EXPECT_LT (distance (reading->mapping, alignment).most, 0.03);
}

TEST (LiveMoire, FringesVanishWhereAllIsAligned)
{
  MoireBench bench ({0.7, 0.2, 0, 1}, 0.5, kSize);
  auto live = LiveMoire::make (Mapping (kSize));
  const auto frame = bench.frame (live_grating (), 0);
  const auto reading = live->solve (frame.view ());
  ASSERT_TRUE (reading.ok ()) << reading.error ().message;
  const Image<float> phase = live->fringes ().x.phase;
  /* Within the third harmonic's alias, 0.05 mirrors of 4. */
  for (int y = 2; y < phase.height () - 2; y++)
    for (int x = 2; x < phase.width () - 2; x++)
      ASSERT_NEAR (phase.at (x, y), 2 * M_PI * (0.7 - 0.5) / 4, 0.15);
}

TEST (LiveMoire, CountsPixelsAtTheLargestOfTheirBits)
{
  MoireBench bench ({}, 0.5, kSize);
  const auto frame = bench.frame (live_grating (), 0);
  Image<std::uint16_t> deep (kSize.width, kSize.height);
  for (int y = 0; y < kSize.height; y++)
    for (int x = 0; x < kSize.width; x++)
      deep.at (x, y) = std::uint16_t (2 * frame.at (x, y));
  for (int x = 0; x < 5; x++)
    deep.at (x, 0) = 1023;
  for (const auto &[bits, saturated] : {std::pair (10, 5u), {0, 0u}}) {
    auto live = LiveMoire::make (Mapping (kSize), {.bits = bits});
    const auto reading = live->solve (std::as_const (deep).view ());
    ASSERT_TRUE (reading.ok ()) << reading.error ().message;
    EXPECT_EQ (reading->saturated, saturated);
  }
}

TEST (LiveMoire, SaysWhereThereIsNoGrating)
{
  MoireBench bench ({}, 0.5, kSize);
  auto live = LiveMoire::make (Mapping (kSize));
  const auto frame = bench.frame ({Pattern::Kind::white}, 0);
  const auto reading = live->solve (frame.view ());
  ASSERT_FALSE (reading.ok ());
  EXPECT_NE (reading.error ().message.find ("no grating is seen in x"),
      std::string::npos);
  EXPECT_EQ (LiveMoire::make (Mapping (Extent{20, 20})).error ().message,
      "a frame of 20x20 pixels holds less than 8 periods of the live grating");
}

TEST (LiveMoire, RefusesFramesOfAnotherSize)
{
  auto live = LiveMoire::make (Mapping (kSize));
  for (const Extent size : {Extent{255, 192}, {256, 191}, {64, 48}}) {
    const Image<std::uint8_t> frame (size.width, size.height);
    const auto reading = live->solve (frame.view ());
    ASSERT_FALSE (reading.ok ());
    EXPECT_NE (reading.error ().message.find ("256x192"), std::string::npos)
        << reading.error ().message;
  }
}

TEST (Calibration, FindsTheMappingToItsStatedUncertainty)
{
  const std::pair<Alignment, double> benches[] = {
      {{12.3, -31.4, 1.7, 0.985}, 0.5}, {{-39.6, 3.2, -1.1, 1.018}, 0.7}};
  for (const auto &[alignment, psf] : benches) {
    MoireBench bench (alignment, psf, kSize);
    const auto result = calibrate (bench);
    ASSERT_TRUE (result.ok ()) << result.error ().message;
    EXPECT_LT (distance (result->mapping, alignment).most, 1e-3);
    EXPECT_FALSE (result->mapping.displacement ());
    EXPECT_NEAR (result->psf_sigma, psf, 0.02);
    EXPECT_NEAR (result->misfit, 1.0, 0.05);
    const Pose pose = result->mapping.pose ();
    const Pose sigma = result->mapping.pose_sigma ();
    EXPECT_NEAR (pose.rotation, alignment.rotation, 5 * sigma.rotation);
    EXPECT_NEAR (pose.magnification, alignment.scale, 5 * sigma.magnification);
    EXPECT_LT (sigma.shift_x, 1e-4);
  }
}

TEST (Calibration, FindsATiltAsAHomography)
{
  Alignment alignment = {5.5, -3.2, 0.5, 1.01};
  alignment.tilt_x = 0.01;
  alignment.tilt_y = -0.02;
  MoireBench bench (alignment, 0.5, kSize);
  const auto result = calibrate (bench);
  ASSERT_TRUE (result.ok ()) << result.error ().message;
  EXPECT_LT (distance (result->mapping, alignment).most, 5e-3);
  EXPECT_NEAR (result->mapping.homography ()[6], 0.01 / 127.5, 3e-6);
  EXPECT_NEAR (result->mapping.homography ()[7], -0.02 / 95.5, 3e-6);
}

/* 192 rows are no multiple of five. */
TEST (Calibration, AFifthOfTheRowsIsEnough)
{
  const Alignment alignment = {12.3, -31.4, 1.7, 0.985};
  MoireBench bench (alignment, 0.5, kSize);
  const auto result = calibrate (bench, kSize, 5);
  ASSERT_TRUE (result.ok ()) << result.error ().message;
  EXPECT_LT (distance (result->mapping, alignment).most, 2e-3);
  EXPECT_NEAR (result->psf_sigma, 0.5, 0.02);
  const Pose pose = result->mapping.pose ();
  const Pose sigma = result->mapping.pose_sigma ();
  EXPECT_NEAR (pose.rotation, alignment.rotation, 5 * sigma.rotation);
  EXPECT_NEAR (pose.magnification, alignment.scale, 5 * sigma.magnification);
  EXPECT_NEAR (result->gray_difference, 0.0, 0.05);
}

TEST (Calibration, FindsADistortionAsADisplacement)
{
  Alignment alignment = {-4.3, 2.7, -1.0, 0.99};
  alignment.distortion = 0.003;
  MoireBench bench (alignment, 0.5, kSize);
  const auto result = calibrate (bench);
  ASSERT_TRUE (result.ok ()) << result.error ().message;
  ASSERT_TRUE (result->mapping.displacement ());
  EXPECT_LT (distance (result->mapping, alignment).rms, 5e-3);
  /* A homography alone leaves more than that. */
  double squares = 0.0;
  for (int y = 0; y < result->residual_x.height (); y++)
    for (int x = 0; x < result->residual_x.width (); x++)
      squares += std::pow (double (result->residual_x.at (x, y)), 2) +
                 std::pow (double (result->residual_y.at (x, y)), 2);
  EXPECT_GT (std::sqrt (squares / result->residual_x.width () /
                        result->residual_x.height ()),
      0.02);
}

TEST (Calibration, TellsWhatPixelsAreGoodFor)
{
  MoireBench bench ({30, 0, 0, 1}, 0.5, kSize);
  const auto result = calibrate (bench);
  ASSERT_TRUE (result.ok ()) << result.error ().message;
  const auto uncovered = result->pixels (PixelQuality::uncovered);
  EXPECT_NEAR (double (uncovered), 30.0 * kSize.height, 1.0 * kSize.height);
  EXPECT_EQ (result->quality.at (250, 100), PixelQuality::uncovered);
  EXPECT_EQ (result->quality.at (100, 100), PixelQuality::good);
}

TEST (Calibration, TooMuchLightIsAnError)
{
  MoireBench bench ({}, 0.5, kSize, 1.5);
  const auto result = calibrate (bench);
  ASSERT_FALSE (result.ok ());
  EXPECT_NE (result.error ().message.find ("reduce light"), std::string::npos);
}

TEST (Calibration, TakesFramesOfAPatternInARow)
{
  const auto patterns = calibration_patterns (kSize);
  auto run = Calibration::make (kSize, kSize, patterns);
  ASSERT_TRUE (run.ok ());
  const Image<std::uint8_t> frame (kSize.width, kSize.height);
  for (int i = 0; i < 6; i++)
    EXPECT_TRUE (run->add (patterns[std::size_t (i)], frame.view ()).ok ());
  EXPECT_TRUE (run->add (patterns[5], frame.view ()).ok ());
  const auto late = run->add (patterns[2], frame.view ());
  ASSERT_FALSE (late.ok ());
  EXPECT_NE (late.error ().message.find ("was evaluated"), std::string::npos);
}

TEST (Calibration, NamesWhatIsMissing)
{
  auto patterns = calibration_patterns (kSize);
  auto run = Calibration::make (kSize, kSize, patterns);
  ASSERT_TRUE (run.ok ());
  EXPECT_EQ (run->missing (), patterns);
  EXPECT_NE (run->solve ().error ().message.find ("the first is dark"),
      std::string::npos);
  Image<std::uint8_t> frame (8, 8);
  EXPECT_NE (run->add (patterns[0], std::as_const (frame).view ())
                 .error ()
                 .message.find ("256x192 are expected"),
      std::string::npos);
  EXPECT_FALSE (
      run->add (live_grating (), std::as_const (frame).view ()).ok ());
  patterns.pop_back ();
  EXPECT_FALSE (Calibration::make (kSize, kSize, patterns).ok ());
}
