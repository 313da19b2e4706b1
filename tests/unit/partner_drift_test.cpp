/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How far a second camera has moved, by the frames of both. */
#include <cmath>

#include <gtest/gtest.h>

#include "sync/partner_drift.h"
#include "two_beams.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;
using namespace codedexposure::test::two_beams;

constexpr Extent kSize{288, 216};

/* As a camera sees it that has moved by @shift of (x, y), px. */
template <typename Shift>
Image<std::uint8_t>
moved (const Image<std::uint8_t> &frame, Shift shift)
{
  Image<std::uint8_t> image (frame.width (), frame.height ());
  for (int y = 0; y < frame.height (); y++)
    for (int x = 0; x < frame.width (); x++) {
      const Position by = shift (x, y);
      image.at (x, y) = std::uint8_t (std::lround (bilinear (frame.view (),
          {std::clamp (x - by.x, 0.0, frame.width () - 1.0),
              std::clamp (y - by.y, 0.0, frame.height () - 1.0)})));
    }
  return image;
}

struct Frames {
  Schedule schedule;
  Image<std::uint8_t> on, off;
};

Frames
frames (const std::string &preset, double speed, const BenchOptions &first = {},
    BenchOptions second = {})
{
  const Schedule schedule = schedule_of (preset);
  const Pictures slots = moving_clouds (kSize, schedule.slots (), speed);
  second.seed = first.seed + 1;
  return {schedule, std::move (coded (schedule, slots, first).front ()),
      std::move (
          coded (schedule.complement ().value (), slots, second).front ())};
}

constexpr BeamCamera kAligned{kSize, nullptr};

template <typename Shift>
std::optional<PartnerDrift::Shift>
largest (const Frames &both, Shift shift)
{
  const PartnerDrift drift (both.schedule, kAligned, kAligned);
  const auto off = moved (both.off, shift);
  return drift.largest (both.on.view (), off.view ());
}

auto
by (double x, double y)
{
  return [=] (int, int) { return Position{x, y}; };
}

struct Case {
  const char *preset;
  double speed;  ///< px a slot
  double margin; ///< px
};
class PartnerDriftOf : public ::testing::TestWithParam<Case>
{
};

TEST_P (PartnerDriftOf, IsWhatTheSecondCameraHasMoved)
{
  const Frames both = frames (GetParam ().preset, GetParam ().speed);
  for (const Position shift : {Position{0.0, 0.0}, Position{0.1, 0.0},
           Position{-0.05, 0.2}, Position{0.3, -0.3}}) {
    const auto found = largest (both, by (shift.x, shift.y));
    ASSERT_TRUE (found);
    EXPECT_NEAR (found->by.x, shift.x, GetParam ().margin)
        << shift.x << ", " << shift.y;
    EXPECT_NEAR (found->by.y, shift.y, GetParam ().margin)
        << shift.x << ", " << shift.y;
    EXPECT_LT (found->uncertainty, 0.03);
  }
}

INSTANTIATE_TEST_SUITE_P (Codes, PartnerDriftOf,
    ::testing::Values (Case{"sequential:lattice:4/2", 0.0, 0.01},
        Case{"sequential:lattice:4/2", 0.7, 0.05},
        Case{"sequential:2x2", 0.7, 0.05},
        Case{"sequential:lattice:8/3,leak=0.01", 0.4, 0.05},
        Case{"sequential:4x4,pilot=8", 0.2, 0.05}));

/* Noise, gain and black level of the second camera. */
TEST (PartnerDrift, HasTheUncertaintyThatItSays)
{
  BenchOptions noisy;
  noisy.full_well = 10000.0;
  noisy.read_noise = 5.0;
  double squares = 0.0;
  int count = 0;
  for (int seed = 0; seed < 20; seed++) {
    noisy.seed = std::uint64_t (2 * seed);
    const Frames both = frames ("sequential:lattice:4/2", 0.0, noisy, noisy);
    const auto found = largest (both, by (0.0, 0.0));
    ASSERT_TRUE (found);
    EXPECT_LT (std::hypot (found->by.x, found->by.y), 5.0 * found->uncertainty);
    squares +=
        found->by.x * found->by.x / found->uncertainty / found->uncertainty;
    count++;
  }
  /* That of the worst of nine parts. */
  EXPECT_LT (std::sqrt (squares / count), 3.0);
  EXPECT_GT (std::sqrt (squares / count), 0.3);
}

TEST (PartnerDrift, OfARotationIsThatAtTheEdge)
{
  constexpr double kTurn = 0.002;
  const Frames both = frames ("sequential:lattice:4/2", 0.0);
  const auto found = largest (both, [] (int x, int y) {
    return Position{
        -kTurn * (y - 0.5 * kSize.height), kTurn * (x - 0.5 * kSize.width)};
  });
  ASSERT_TRUE (found);
  EXPECT_NEAR (found->by.x, -kTurn * (found->at.y - 0.5 * kSize.height), 0.03);
  EXPECT_NEAR (found->by.y, kTurn * (found->at.x - 0.5 * kSize.width), 0.03);
  EXPECT_GT (std::hypot (found->by.x, found->by.y), 0.18);
}

TEST (PartnerDrift, IsNotKnownWithoutTexture)
{
  Frames both = frames ("sequential:lattice:4/2", 0.0);
  for (Image<std::uint8_t> *frame : {&both.on, &both.off})
    for (int y = 0; y < kSize.height; y++)
      for (int x = 0; x < kSize.width; x++)
        frame->at (x, y) = 100;
  EXPECT_FALSE (largest (both, by (0.0, 0.0)));
  const PartnerDrift tiny (schedule_of ("sequential:lattice:8/3"),
      {{16, 12}, nullptr}, {{16, 12}, nullptr});
  const Image<std::uint8_t> dark (16, 12);
  EXPECT_FALSE (tiny.largest (dark.view (), dark.view ()));
}

/* It is left out. */
TEST (PartnerDrift, IsNotThatOfSaturatedPixels)
{
  Frames both = frames ("sequential:lattice:4/2", 0.0);
  for (int y = 90; y < 120; y++)
    for (int x = 20; x < 60; x++)
      both.off.at (x, y) = 255;
  const auto found = largest (both, by (0.1, 0.0));
  ASSERT_TRUE (found);
  EXPECT_NEAR (found->by.x, 0.1, 0.03);
}

} // namespace
