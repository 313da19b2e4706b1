/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the checks of sensor, mirrors and optics compute, on numbers that are
 * known. */
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "doctor/blur_map.h"
#include "doctor/defects.h"
#include "doctor/dither.h"
#include "doctor/lens_fit.h"
#include "doctor/photon_transfer.h"
#include "doctor/rounding.h"
#include "doctor/switching.h"
#include "doctor/view.h"

namespace
{

using namespace codedexposure;

TEST (Rounding, IsUndone)
{
  const Offsets pixels = {-0.2, -0.1, 0.0, 0.1, 0.2};
  for (const double mean : {4.0, 4.13, 4.5, 4.81})
    for (const double sigma : {0.4, 0.5, 0.7, 1.2}) {
      const Moments seen = rounded ({mean, sigma * sigma}, pixels);
      const auto found = unrounded (seen, pixels);
      ASSERT_TRUE (found) << mean << " " << sigma;
      EXPECT_NEAR (found->mean, mean, 1e-3) << sigma;
      EXPECT_NEAR (found->variance, sigma * sigma, 2e-3) << mean;
    }
}

TEST (Rounding, SaysWhatItHides)
{
  EXPECT_FALSE (unrounded (rounded ({4.2, 0.01}, {}), {}));
  EXPECT_FALSE (unrounded ({4.0, 0.0}, {}));
}

/* Groups of pixels, as a camera that rounds to whole DN sees them. */
std::vector<DitherGroup>
dithered (double black, double off, double read, double gain, double unlike,
    double part)
{
  constexpr int kPixels = 150, kFrames = 16;
  std::mt19937 random (7);
  std::normal_distribution<double> normal;
  std::vector<DitherGroup> groups;
  for (int look = 0; look < 4; look++)
    for (int step = 0; step < 30; step++) {
      DitherGroup group{.look = look,
          .longer = look == 3,
          .light = 0.05 * step,
          .pixels = kPixels,
          .frames = kFrames};
      const double light =
          1.003 * group.light + (group.longer ? off : part * off);
      for (int pixel = 0; pixel < kPixels; pixel++) {
        const double own = black + light + unlike * normal (random);
        std::poisson_distribution<int> electrons (gain * light);
        double sum = 0.0, squares = 0.0;
        for (int frame = 0; frame < kFrames; frame++) {
          const double value =
              std::round (own - light +
                          (electrons (random) + read * normal (random)) / gain);
          sum += value / kFrames;
          squares += value * value / kFrames;
        }
        group.mean += sum / kPixels;
        group.spread += sum * sum / kPixels;
        group.variance +=
            (squares - sum * sum) * kFrames / (kFrames - 1) / kPixels;
      }
      group.spread -= group.mean * group.mean;
      groups.push_back (group);
    }
  return groups;
}

TEST (Dither, ShowsNoiseThatRoundingHides)
{
  const double gain = 60.0, part = 0.2, off = 0.7;
  for (const double black : {5.0, 5.3, 5.6, 5.9})
    for (const double read : {3.0, 10.0})
      for (const double unlike : {0.0, 0.06}) {
        SCOPED_TRACE (
            testing::Message () << black << " " << read << " " << unlike);
        const auto dark = fit_dither (
            dithered (black, off, read, gain, unlike, part), part, {gain, 0.3});
        ASSERT_TRUE (dark);
        const double variance = read * read / (gain * gain);
        EXPECT_NEAR (dark->black.value, black, 0.02);
        EXPECT_NEAR (dark->off.value, off, 0.02);
        EXPECT_NEAR (
            dark->variance.value, variance, 3.5 * dark->variance.sigma);
        EXPECT_LT (dark->variance.sigma, 0.02 * variance + 2.5e-4);
      }
}

TEST (PhotonTransfer, FindsGainAndReadNoise)
{
  const double gain = 2.5, read = 6.0, black = 60.0;
  std::vector<TransferPoint> points;
  for (const double light : {0.0, 0.01, 0.05, 0.2, 0.4, 0.6, 0.8, 1.0}) {
    const double electrons = 8000 * light;
    const double variance = (read * read + electrons) / (gain * gain);
    points.push_back ({light, {black + electrons / gain, 0.05},
        Measured{variance, 0.003 * variance}});
  }
  const auto found = fit_photon_transfer (points);
  ASSERT_TRUE (found);
  EXPECT_NEAR (found->conversion_gain.value, gain, 0.001);
  EXPECT_NEAR (found->read_noise.value, read, 0.01);
  EXPECT_NEAR (found->dark.value, black, 0.01);
  EXPECT_NEAR (found->deviation (points, 4095).value, 0.0, 0.1);
}

TEST (Defects, AreToldApart)
{
  std::mt19937 random (3);
  std::normal_distribution<float> noise (0.0f, 1.0f);
  Image<float> off (120, 100), on (120, 100);
  for (int y = 0; y < 100; y++)
    for (int x = 0; x < 120; x++) {
      off.at (x, y) = 5.0f + 0.1f * noise (random);
      on.at (x, y) = 200.0f - 0.3f * float (x) + 2.0f * noise (random);
    }
  off.at (30, 20) += 90.0f; // hot
  on.at (30, 20) = 255.0f;
  on.at (50, 60) = 5.0f;     // dead
  off.at (80, 30) += 120.0f; // a mirror that is always on
  off.at (81, 30) += 40.0f;
  on.at (80, 70) -= 110.0f; // a mirror that is always off
  on.at (80, 71) -= 50.0f;
  for (int y = 80; y < 90; y++)
    for (int x = 20; x < 30; x++)
      on.at (x, y) = 30.0f; // dust
  const Defects found = find_defects (off, on, 255);
  ASSERT_EQ (found.hot.size (), 1u);
  EXPECT_EQ (found.hot[0], (Offset{30, 20}));
  ASSERT_EQ (found.dead.size (), 1u);
  EXPECT_EQ (found.dead[0], (Offset{50, 60}));
  ASSERT_EQ (found.stuck_on.size (), 1u);
  EXPECT_NEAR (found.stuck_on[0].centre.x, 80.25, 0.1);
  ASSERT_EQ (found.stuck_off.size (), 1u);
  EXPECT_NEAR (found.stuck_off[0].centre.y, 70.3, 0.1);
  ASSERT_EQ (found.dust.size (), 1u);
  EXPECT_NEAR (found.dust[0].centre.x, 24.5, 0.5);
}

/* Light, in seconds, of mirrors that go off at @time within @took, where the
 * exposure ends at 0.02 s. */
double
light_seen (double time, double took)
{
  const double end = 0.02;
  double light = 0.0;
  for (double t = 0.01; t < end; t += 1e-6)
    light += 1e-6 * std::clamp (1.0 - (t - time) / took, 0.0, 1.0);
  return light;
}

TEST (Switching, IsTheRoundnessOfTheBend)
{
  for (const double took : {5e-6, 200e-6, 500e-6}) {
    std::vector<SwitchPoint> points;
    for (double time = 0.0185; time < 0.0206; time += 1e-4)
      points.push_back ({time, 30.0 + 5e3 * light_seen (time, took), 0.02});
    const Measured found = fit_switching (points);
    EXPECT_NEAR (found.value, took, 60e-6);
    EXPECT_NEAR (found.value, took, std::max (30e-6, 3 * found.sigma));
  }
}

TEST (Switching, IsNotJitterOfTheExposure)
{
  for (const double took : {5e-6, 150e-6}) {
    std::vector<SwitchPoint> points;
    for (double time = 0.0185; time < 0.0206; time += 5e-5) {
      double light = 0.0; // as if the mirrors were told at as many times
      for (int i = -3; i <= 3; i++)
        light += (light_seen (time + 20e-6 * i, took) - 20e-6 * i) / 7;
      points.push_back ({time, 30.0 + 5e3 * light, 0.01});
    }
    const Measured found = fit_switching (points, 40e-6);
    EXPECT_NEAR (found.value, took, std::max (30e-6, 3 * found.sigma));
    EXPECT_LT (found.sigma, 60e-6);
  }
}

TEST (LensFit, FindsPosePerspectiveAndDistortion)
{
  const Extent camera{256, 192}, mirrors{288, 224};
  const double turn = 0.7 * std::numbers::pi / 180, scale = 1.02;
  std::vector<PlacePair> pairs;
  for (int y = 0; y < 192; y += 16)
    for (int x = 0; x < 256; x += 16) {
      const double dx = x - 127.5, dy = y - 95.5;
      const double out =
          1 + 0.004 * (dx * dx + dy * dy) / (127.5 * 127.5 + 95.5 * 95.5);
      const double qx = out * dx, qy = out * dy;
      const double z = 1 + 0.01 * qx / 127.5 - 0.02 * qy / 95.5;
      const double c = std::cos (turn) / scale, s = std::sin (turn) / scale;
      pairs.push_back (
          {{double (x), double (y)}, {143.5 + 1.5 + (c * qx - s * qy) / z,
                                         111.5 - 0.5 + (s * qx + c * qy) / z}});
    }
  const auto found = fit_lens (pairs, camera, mirrors, 0.001);
  ASSERT_TRUE (found);
  EXPECT_NEAR (found->rotation.value, 0.7, 1e-4);
  EXPECT_NEAR (found->magnification.value, scale, 1e-5);
  EXPECT_NEAR (found->shift_x.value, 1.5, 1e-4);
  EXPECT_NEAR (found->shift_y.value, -0.5, 1e-4);
  EXPECT_NEAR (found->tilt_x.value, 0.01, 1e-5);
  EXPECT_NEAR (found->tilt_y.value, -0.02, 1e-5);
  EXPECT_NEAR (found->distortion.value, 0.004, 1e-5);
  EXPECT_LT (found->rms, 1e-4);
}

TEST (Focus, GrowsTowardsTheDirectionOfTheTilt)
{
  std::mt19937 random (5);
  std::normal_distribution<float> noise (0.0f, 0.02f);
  for (const double degrees : {20.0, 130.0, 250.0}) {
    BlurMap map = {.variance = Image<float> (16, 12), .sigma = {}};
    map.sigma = map.variance;
    const double c = std::cos (degrees * std::numbers::pi / 180);
    const double s = std::sin (degrees * std::numbers::pi / 180);
    for (int j = 0; j < 12; j++)
      for (int i = 0; i < 16; i++) {
        const double along = c * (i - 7.5) * 16 + s * (j - 5.5) * 16;
        const double z = 0.8 + 0.005 * along;
        map.variance.at (i, j) = float (0.16 + z * z) + noise (random);
        map.sigma.at (i, j) = 0.02f;
      }
    const auto found = fit_focus (map, {256, 192});
    ASSERT_TRUE (found);
    EXPECT_NEAR (found->direction.value, degrees, 5.0);
    EXPECT_NEAR (found->growth.value,
        0.005 * 256 * std::abs (c) + 0.005 * 192 * std::abs (s), 0.1);
  }
}

TEST (View, TellsOrientations)
{
  const auto is = [] (double xx, double xy, double yx, double yy) {
    return CoarseView{xx, xy, 0, yx, yy, 0}.orientation ();
  };
  EXPECT_EQ (is (1, 0.1, -0.1, 1).turned, 0);
  EXPECT_EQ (is (-1, 0, 0, -1).turned, 180);
  EXPECT_EQ (is (0, -1, 1, 0).turned, 90);
  EXPECT_EQ (is (0, 1, -1, 0).turned, 270);
  EXPECT_TRUE (is (-1, 0, 0, 1).flipped_x);
  EXPECT_TRUE (is (1, 0, 0, -1).flipped_y);
  EXPECT_FALSE (is (1, 0, 0, 1).flipped_x || is (1, 0, 0, 1).flipped_y);
}

} // namespace
