/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What a window shows: pictures of the last second, loop, pause and steps; and
 * where it shows them. */
#include "window/replay.h"

#include <gtest/gtest.h>

#include "window/layout.h"

namespace
{

using namespace codedexposure::app;
using codedexposure::Extent;
using Key = Replay::Key;
using Mode = Replay::Mode;

constexpr ViewTime kMs = 1'000'000;
constexpr ViewTime kSecond = 1000 * kMs;

/* 100 pictures a second, each of which is its own number. */
Recent<int>
pictures (int count, ViewTime span = kSecond)
{
  Recent<int> recent (span);
  for (int k = 0; k < count; k++)
    recent.add (ViewTime (k) * 10 * kMs, k);
  return recent;
}

TEST (Recent, KeepsItsSpan)
{
  const auto times = pictures (1000).times ();
  ASSERT_EQ (times.size (), 101u);
  EXPECT_EQ (times.front (), 8990 * kMs);
  EXPECT_EQ (times.back (), 9990 * kMs);
}

TEST (Recent, KeepsAFewPicturesOfASlowStream)
{
  Recent<int> recent (kSecond);
  for (int k = 0; k < 10; k++)
    recent.add (ViewTime (k) * 5 * kSecond, k);
  EXPECT_EQ (recent.times (),
      std::vector<ViewTime> ({35 * kSecond, 40 * kSecond, 45 * kSecond}));
  recent.clear ();
  EXPECT_EQ (recent.at (45 * kSecond), nullptr);
}

TEST (Recent, KeepsNoMoreThanItMay)
{
  Recent<int> recent (kSecond);
  for (int k = 0; k < 100; k++)
    recent.add (ViewTime (k) * 10 * kMs, k, 10);
  EXPECT_EQ (recent.times ().size (), 10u);
  EXPECT_EQ (*recent.at (0), 90);
}

TEST (Recent, ShowsTheLastPictureThatIsNotLater)
{
  const auto recent = pictures (200);
  EXPECT_EQ (*recent.at (1500 * kMs), 150);
  EXPECT_EQ (*recent.at (1509 * kMs), 150);
  EXPECT_EQ (*recent.at (9000 * kMs), 199);
}

TEST (Recent, ShowsTheFirstPictureBeforeAll)
{
  EXPECT_EQ (*pictures (200).at (0), 99);
  EXPECT_EQ (Recent<int> (kSecond).at (0), nullptr);
}

TEST (Recent, BeginsAnewWithAStreamThatDoes)
{
  auto recent = pictures (200);
  recent.add (10 * kMs, 7);
  EXPECT_EQ (recent.times (), std::vector<ViewTime> ({10 * kMs}));
  EXPECT_EQ (*recent.at (1500 * kMs), 7);
}

/* A replay of pictures at 0, 10 ... 990 ms. */
class ReplayTest : public ::testing::Test
{
protected:
  void press (Key key, ViewTime now)
  {
    replay_.press (key, now, pictures (100).times ());
  }
  Replay replay_;
};

TEST_F (ReplayTest, IsLiveAtFirstAndWithoutPictures)
{
  EXPECT_TRUE (replay_.is_live ());
  for (const Key key : {Key::kPause, Key::kLoop, Key::kBack, Key::kForward}) {
    replay_.press (key, 0, {});
    EXPECT_TRUE (replay_.is_live ());
  }
}

TEST_F (ReplayTest, PausesAtThePictureThatIsShown)
{
  press (Key::kPause, 505 * kMs);
  EXPECT_EQ (replay_.mode (), Mode::kPaused);
  EXPECT_EQ (replay_.time (505 * kMs), 500 * kMs);
  EXPECT_EQ (replay_.time (99 * kSecond), 500 * kMs);
  EXPECT_EQ (replay_.last (), 990 * kMs);
  press (Key::kPause, 99 * kSecond);
  EXPECT_TRUE (replay_.is_live ());
}

TEST_F (ReplayTest, StepsBackAndForwardWithinThePictures)
{
  press (Key::kBack, 15 * kMs);
  EXPECT_EQ (replay_.mode (), Mode::kPaused);
  EXPECT_EQ (replay_.shown (20 * kMs), 0u);
  press (Key::kBack, 20 * kMs);
  EXPECT_EQ (replay_.shown (30 * kMs), 0u);
  for (int k = 1; k < 150; k++) {
    press (Key::kForward, ViewTime (k) * kSecond);
    EXPECT_EQ (
        replay_.shown (ViewTime (k) * kSecond), std::size_t (std::min (k, 99)));
  }
}

TEST_F (ReplayTest, LoopsAllPicturesAtAQuarterOfTheirSpeed)
{
  press (Key::kLoop, 990 * kMs);
  EXPECT_EQ (replay_.mode (), Mode::kLoop);
  for (ViewTime since : {0, 39, 40, 2000, 3999, 4000, 4040, 8000, 399999}) {
    const ViewTime now = (990 + since) * kMs;
    EXPECT_EQ (replay_.shown (now), since % 4000 / 40) << since;
  }
  press (Key::kLoop, 5000 * kMs);
  EXPECT_TRUE (replay_.is_live ());
}

TEST_F (ReplayTest, HoldsPicturesWhereOthersAreMissing)
{
  replay_.press (Key::kLoop, 100, {10, 20, 60, 70});
  EXPECT_EQ (replay_.size (), 4u);
  /* 10 and 20 for 10, then 20 until 60, each 4 times as long. */
  for (const auto &[since, picture] : {std::pair{0, 0}, {39, 0}, {40, 1},
           {199, 1}, {200, 2}, {239, 2}, {240, 3}, {279, 3}, {280, 0}})
    EXPECT_EQ (replay_.shown (ViewTime (100 + since)), std::size_t (picture))
        << since;
}

TEST_F (ReplayTest, PausesALoopAndGoesOnFromThere)
{
  press (Key::kLoop, 990 * kMs);
  press (Key::kPause, (990 + 400) * kMs);
  EXPECT_EQ (replay_.mode (), Mode::kPaused);
  EXPECT_EQ (replay_.shown (9 * kSecond), 10u);
  press (Key::kForward, 9 * kSecond);
  press (Key::kLoop, 20 * kSecond);
  EXPECT_EQ (replay_.mode (), Mode::kLoop);
  EXPECT_EQ (replay_.shown (20 * kSecond), 11u);
  EXPECT_EQ (replay_.shown (20 * kSecond + 40 * kMs), 12u);
}

TEST_F (ReplayTest, KeepsThePicturesOfTheMomentWhenLiveEnded)
{
  press (Key::kPause, 500 * kMs);
  replay_.press (Key::kBack, 9 * kSecond, {8 * kSecond, 9 * kSecond});
  EXPECT_EQ (replay_.size (), 100u);
  EXPECT_EQ (replay_.time (9 * kSecond), 490 * kMs);
}

TEST_F (ReplayTest, LoopsASinglePicture)
{
  replay_.press (Key::kLoop, 7, {5});
  EXPECT_EQ (replay_.time (kSecond), 5u);
}

TEST (WindowLayout, FitsTheScreen)
{
  struct {
    Extent camera;
    int panes;
    Extent room, pane;
  } const cases[] = {
      {{768, 576}, 2, {1904, 1008}, {768, 576}},
      {{768, 576}, 3, {1904, 1008}, {576, 432}},
      {{768, 576}, 2, {1350, 696}, {576, 432}},
      {{768, 576}, 2, {1008, 528}, {384, 288}},
      {{768, 576}, 3, {1008, 528}, {256, 192}},
      {{192, 144}, 2, {1904, 1008}, {768, 576}}, // by whole factors only
      {{400, 300}, 2, {1904, 1008}, {400, 300}},
      {{4096, 3072}, 2, {1904, 1008}, {819, 614}},
      {{100, 1000}, 2, {1904, 1008}, {75, 750}},
      {{1, 1}, 2, {100, 150}, {12, 12}},
  };
  for (const auto &[camera, panes, room, pane] : cases) {
    const auto layout = WindowLayout::fit (camera, panes, room);
    EXPECT_EQ (layout.pane, pane) << camera.width << "x" << camera.height;
    EXPECT_LE (layout.left (panes) - WindowLayout::kGap, room.width);
    EXPECT_LE (layout.size ().height, room.height);
  }
}

TEST (WindowLayout, PutsAPictureWhereTheCameraHasItsPixels)
{
  struct {
    Extent pane, camera, picture;
    int wide, high; // a pixel
    Extent size;
  } const cases[] = {
      {{768, 576}, {768, 576}, {768, 576}, 1, 1, {768, 576}},  // the camera
      {{768, 576}, {768, 576}, {384, 288}, 1, 1, {768, 576}},  // cells of 2x2
      {{768, 576}, {768, 576}, {384, 280}, 1, 1, {768, 560}},  // and a pilot
      {{576, 432}, {768, 576}, {384, 138}, 1, 1, {576, 207}},  // of half of it
      {{768, 576}, {192, 144}, {48, 64}, 2, 1, {768, 512}},    // cells of 4x2
      {{768, 576}, {768, 576}, {85, 64}, 1, 1, {765, 576}},    // cells of 9x9
      {{768, 576}, {768, 576}, {912, 1140}, 1, 1, {460, 576}}, // more mirrors
      {{768, 576}, {768, 576}, {388, 291}, 1, 1, {768, 576}},  // cells of them
  };
  for (const auto &[pane, camera, picture, wide, high, size] : cases)
    EXPECT_EQ (WindowLayout ({pane, 2}).size_of (
                   camera, picture, double (wide) / high),
        size)
        << picture.width << "x" << picture.height;
}

TEST (WindowLayout, HasPanesBesideEachOtherAndRoomForTexts)
{
  const WindowLayout wide{{768, 576}, 3};
  EXPECT_EQ (wide.left (2), 2 * (768 + WindowLayout::kGap));
  EXPECT_EQ (wide.size ().width, 3 * 768 + 2 * WindowLayout::kGap);
  EXPECT_EQ (
      wide.size ().height, 576 + WindowLayout::kCaption + WindowLayout::kPanel);
  const WindowLayout narrow{{12, 12}, 2};
  EXPECT_EQ (narrow.size ().width, WindowLayout::kMinWidth);
}

} // namespace
