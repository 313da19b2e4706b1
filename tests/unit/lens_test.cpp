/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The lens of the simulated bench: where light goes, and how it is blurred. */
#include <algorithm>
#include <cmath>
#include <numbers>

#include "exposed.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

/* A bench with one mask that is on everywhere: the picture after the lens. */
Image<std::uint8_t>
seen (const Image<std::uint8_t> &picture, const Alignment &alignment,
    double psf_sigma = 0.0)
{
  const int width = picture.width (), height = picture.height ();
  Lens lens (alignment, psf_sigma, width, height);
  Image<float> mirrors (width, height), pixels (width, height);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      mirrors.at (x, y) = picture.at (x, y);
  if (lens.ideal ())
    return picture;
  lens.image (mirrors.view (), pixels.view ());
  Image<std::uint8_t> out (width, height);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      out.at (x, y) = std::uint8_t (std::lround (pixels.at (x, y)));
  return out;
}

/* Brightness along x, f periods a mirror, exactly as a mirror shows it. */
Image<float>
waves (int width, int height, double f)
{
  Image<float> image (width, height);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      image.at (x, y) =
          float (std::cos (2 * std::numbers::pi * f * (x - 0.5 * (width - 1))));
  return image;
}

TEST (Lens, WholeShiftsMoveThePictureTheOtherWay)
{
  const Image<std::uint8_t> picture = scene<std::uint8_t> (20, 16, 1);
  const Image<std::uint8_t> out = seen (picture, {3.0, -2.0, 0.0, 1.0});
  for (int y = 0; y < 16; y++)
    for (int x = 0; x < 20; x++)
      EXPECT_EQ (out.at (x, y),
          x + 3 < 20 && y - 2 >= 0 ? picture.at (x + 3, y - 2) : 0)
          << "at " << x << ", " << y << "; dark beyond the mirrors";
}

TEST (Lens, ShiftBeyondTheMirrorsIsDark)
{
  for (const double shift : {25.0, -25.0, 1000.0, -1000.0})
    EXPECT_EQ (seen (scene<std::uint8_t> (20, 16, 1), {shift, 0, 0, 1}),
        (flat<std::uint8_t> (20, 16, 0)));
}

TEST (Lens, HalfAMirrorMixesTwo)
{
  const Image<std::uint8_t> picture = scene<std::uint8_t> (8, 8, 1);
  const Image<std::uint8_t> out = seen (picture, {0.5, 0.0, 0.0, 1.0});
  EXPECT_EQ (out.at (2, 3),
      std::lround ((picture.at (2, 3) + picture.at (3, 3)) / 2.0));
}

TEST (Lens, TurnsAboutTheCentreFromXToY)
{
  const Image<std::uint8_t> picture = scene<std::uint8_t> (9, 9, 1);
  const Image<std::uint8_t> out = seen (picture, {0.0, 0.0, 90.0, 1.0});
  /* Pixel to the right of the centre looks at the mirror below it. */
  for (int y = 0; y < 9; y++)
    for (int x = 0; x < 9; x++)
      EXPECT_NEAR (out.at (x, y), picture.at (8 - y, x), 1);
}

TEST (Lens, ScaleTwoShowsEveryMirrorOnFourPixels)
{
  Image<std::uint8_t> picture = scene<std::uint8_t> (8, 8, 1);
  const Image<std::uint8_t> out = seen (picture, {0.0, 0.0, 0.0, 2.0});
  /* Pixel (x, y) lies on mirror 3.5 + (x - 3.5) / 2, a quarter off centre. */
  for (int y = 0; y < 8; y++)
    for (int x = 0; x < 8; x++)
      EXPECT_EQ (out.at (x, y), picture.at ((x + 4) / 2, (y + 4) / 2));
}

TEST (Lens, ScaleHalfGathersFourMirrors)
{
  const Image<std::uint8_t> picture = scene<std::uint8_t> (8, 8, 1);
  const Image<std::uint8_t> out = seen (picture, {0.0, 0.0, 0.0, 0.5});
  for (int y = 2; y < 6; y++)
    for (int x = 2; x < 6; x++) {
      const int u = 2 * x - 4, v = 2 * y - 4;
      const int sum = picture.at (u, v) + picture.at (u + 1, v) +
                      picture.at (u, v + 1) + picture.at (u + 1, v + 1);
      EXPECT_NEAR (out.at (x, y), sum / 4.0, 0.51);
    }
}

/* With such a blur, light comes from pixels that see no mirror plane. */
TEST (Lens, NothingIsSeenBeyondTheHorizon)
{
  Alignment alignment;
  alignment.tilt_x = 0.25;
  for (const double distortion : {0.0, 0.1}) {
    alignment.distortion = distortion;
    Image<float> mirrors (9, 9), seen (9, 9);
    mirrors.at (4, 4) = 1.0f;
    Lens (alignment, 16.0, 9, 9)
        .image (std::as_const (mirrors).view (), seen.view ());
    for (int y = 0; y < 9; y++)
      for (int x = 0; x < 9; x++)
        EXPECT_NEAR (seen.at (x, y), 0.0006, 0.0002);
  }
}

TEST (Lens, TiltAndDistortionMoveWhatIsSeen)
{
  Alignment alignment = {1.0, -2.0, 0.0, 1.0};
  const Position centre = {50.0, 25.0};
  alignment.distortion = 0.01;
  /* Nothing at the centre, a hundredth of the way at a corner. */
  EXPECT_EQ (mirror_seen (alignment, 101, 51, centre), (Position{51, 23}));
  const Position corner = mirror_seen (alignment, 101, 51, {100, 50});
  EXPECT_NEAR (corner.x, 51 + 50 * 1.01, 1e-12);
  EXPECT_NEAR (corner.y, 23 + 25 * 1.01, 1e-12);
  alignment.distortion = 0.0;
  alignment.tilt_x = 0.1;
  EXPECT_NEAR (
      mirror_seen (alignment, 101, 51, {100, 25}).x, 51 + 50 / 1.1, 1e-12);
  EXPECT_NEAR (
      mirror_seen (alignment, 101, 51, {0, 25}).x, 51 - 50 / 0.9, 1e-12);

  /* A bright column of mirrors is seen where it should be. */
  Image<float> mirrors (101, 51), seen (101, 51);
  for (int y = 0; y < 51; y++)
    mirrors.at (91, y) = 1.0f;
  Lens (alignment, 0.5, 101, 51)
      .image (std::as_const (mirrors).view (), seen.view ());
  double sum = 0.0, moment = 0.0;
  for (int x = 80; x < 101; x++) {
    sum += double (seen.at (x, 25));
    moment += x * double (seen.at (x, 25));
  }
  /* 51 + d / (1 + 0.1 d / 50) = 91 */
  EXPECT_NEAR (moment / sum, 50.0 + 40.0 / (1.0 - 40.0 * 0.1 / 50.0), 0.02);
}

TEST (Lens, ABlurReachesBeyondTheFrame)
{
  /* All mirrors are bright, and the camera sees their middle. */
  Image<float> mirrors (64, 64), seen (64, 64);
  for (int y = 0; y < 64; y++)
    for (int x = 0; x < 64; x++)
      mirrors.at (x, y) = 1.0f;
  Lens ({0, 0, 1.0, 2.0}, 1.5, 64, 64)
      .image (std::as_const (mirrors).view (), seen.view ());
  for (int y = 0; y < 64; y++)
    for (int x = 0; x < 64; x++)
      ASSERT_NEAR (seen.at (x, y), 1.0f, 1e-5f) << x << ' ' << y;
}

TEST (Lens, MappingSaysWhereEachPixelLooks)
{
  const Homography m = camera_to_mirrors ({1.5, -2.5, 90.0, 2.0}, 101, 51);
  const auto look = [&m] (double x, double y) {
    return std::pair (m[0] * x + m[1] * y + m[2], m[3] * x + m[4] * y + m[5]);
  };
  EXPECT_NEAR (look (50, 25).first, 51.5, 1e-12);
  EXPECT_NEAR (look (50, 25).second, 22.5, 1e-12);
  EXPECT_NEAR (look (60, 25).first, 51.5, 1e-12);
  EXPECT_NEAR (look (60, 25).second, 27.5, 1e-12);
}

TEST (Lens, FlatLightStaysFlatAwayFromTheBorder)
{
  const Image<std::uint8_t> white = flat<std::uint8_t> (40, 40, 255);
  for (const Alignment &alignment :
      {Alignment{}, Alignment{0.3, 0.7, 0, 1}, Alignment{0.1, 0.2, 1.0, 1.02}})
    for (const double sigma : {0.2, 0.5, 1.0, 2.0}) {
      const Image<std::uint8_t> out = seen (white, alignment, sigma);
      for (int y = 11; y < 29; y++)
        for (int x = 11; x < 29; x++)
          ASSERT_EQ (out.at (x, y), 255);
    }
}

/* The light of a pixel @u mirrors from the centre of a wave of @f periods per
 * mirror. Mirrors show samples of the wave, so all frequencies f + k occur;
 * each passes the box of the mirror, the Gaussian and the box of the pixel. */
double
wave_seen (double u, double f, double sigma, double scale)
{
  const auto box = [] (double g) {
    const double x = std::numbers::pi * g;
    return x == 0.0 ? 1.0 : std::sin (x) / x;
  };
  double sum = 0.0;
  for (int k = -6; k <= 6; k++) {
    const double g = f + k;
    sum += box (g) * box (g / scale) *
           std::exp (-2 * std::pow (std::numbers::pi * sigma / scale * g, 2)) *
           std::cos (2 * std::numbers::pi * g * u);
  }
  return sum;
}

TEST (Lens, ShowsWavesAsTheoryDemands)
{
  const int side = 81, centre = side / 2;
  for (const Alignment &alignment : {Alignment{}, Alignment{0.3, 0.0, 0.0, 1.0},
           Alignment{0.3, 0.1, 2.0, 0.98}, Alignment{-1.7, 0.4, -1.0, 1.02}}) {
    const Homography m = camera_to_mirrors (alignment, side, side);
    for (const double sigma : {0.3, 0.5, 0.7, 2.5})
      for (const double f : {0.03, 0.125, 0.25}) {
        Lens lens (alignment, sigma, side, side);
        Image<float> out (side, side);
        lens.image (waves (side, side, f).view (), out.view ());
        for (int y = centre - 10; y <= centre + 10; y++)
          for (int x = centre - 10; x <= centre + 10; x++) {
            const double u = m[0] * x + m[1] * y + m[2] - centre;
            ASSERT_NEAR (
                out.at (x, y), wave_seen (u, f, sigma, alignment.scale), 5e-4)
                << "sigma " << sigma << " f " << f << " scale "
                << alignment.scale << " at " << x << ", " << y;
          }
      }
  }
}

TEST (Lens, GeneralWayAgreesWithTheShiftsWay)
{
  const Image<float> picture = waves (61, 61, 0.21);
  for (const double sigma : {0.0, 0.5, 1.5})
    for (const double shift : {0.0, 0.25, -7.4}) {
      Lens straight ({shift, shift, 0.0, 1.0}, sigma, 61, 61);
      Lens turned ({shift, shift, 1e-9, 1.0}, sigma, 61, 61);
      Image<float> a (61, 61), b (61, 61);
      straight.image (picture.view (), a.view ());
      turned.image (picture.view (), b.view ());
      for (int y = 20; y < 41; y++)
        for (int x = 20; x < 41; x++)
          ASSERT_NEAR (a.at (x, y), b.at (x, y), 2e-3)
              << "sigma " << sigma << " shift " << shift;
    }
}

} // namespace
