/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The drawn scenes: the same in every run, with the correct brightness. */
#include <algorithm>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "bench/scene.h"

namespace
{

using namespace codedexposure;

constexpr Extent kSize{96, 72};

Image<float>
picture_of (SceneKind kind, double seconds, Extent size = kSize)
{
  Image<float> light (size.width, size.height);
  SyntheticScene::make (kind, size)->draw (seconds, light.view ());
  return light;
}

double
mean_of (const Image<float> &light)
{
  const float *first = light.view ().data;
  const int pixels = light.width () * light.height ();
  return std::accumulate (first, first + pixels, 0.0) / pixels;
}

class EveryScene : public ::testing::TestWithParam<SceneKind>
{
};
INSTANTIATE_TEST_SUITE_P (Kinds, EveryScene,
    ::testing::Values (
        SceneKind::kCandle, SceneKind::kBlownOut, SceneKind::kPour));

TEST_P (EveryScene, DependsOnTheTimeOnly)
{
  const auto scene = SyntheticScene::make (GetParam (), kSize);
  Image<float> light (kSize.width, kSize.height);
  for (double seconds : {0.7, 0.0, 0.2, 0.5}) {
    scene->draw (seconds, light.view ());
    EXPECT_EQ (light, picture_of (GetParam (), seconds)) << seconds;
  }
}

TEST_P (EveryScene, StaysWithinTheRangeOfLight)
{
  for (int k = 0; k < 60; k++) {
    const auto light = picture_of (GetParam (), k * 0.02);
    const float *first = light.view ().data;
    const auto [least, most] =
        std::minmax_element (first, first + kSize.width * kSize.height);
    EXPECT_GE (*least, 0.0f) << k;
    EXPECT_LE (*most, 1.0f) << k;
  }
}

TEST_P (EveryScene, IsTheSameInEverySize)
{
  for (double seconds : {0.1, 0.56})
    EXPECT_NEAR (mean_of (picture_of (GetParam (), seconds)),
        mean_of (picture_of (GetParam (), seconds, {384, 288})), 0.004);
  for (const Extent size : {Extent{1, 1}, Extent{5, 300}, Extent{300, 5}})
    EXPECT_GE (mean_of (picture_of (GetParam (), 0.55, size)), 0.0);
}

TEST (Scene, TheCandleFlickersElevenTimesASecond)
{
  std::vector<double> means;
  for (int k = 0; k < 100; k++)
    means.push_back (mean_of (picture_of (SceneKind::kCandle, k * 0.01)));
  int peaks = 0;
  for (std::size_t k = 1; k + 1 < means.size (); k++)
    peaks += means[k] > means[k - 1] && means[k] >= means[k + 1];
  EXPECT_NEAR (peaks, 11, 1);
}

TEST (Scene, TheCandleGoesOutWithinATenthOfASecond)
{
  const auto at = [] (double seconds) {
    return mean_of (picture_of (SceneKind::kBlownOut, seconds));
  };
  EXPECT_EQ (picture_of (SceneKind::kBlownOut, 0.49),
      picture_of (SceneKind::kCandle, 0.49));
  EXPECT_LT (at (0.62), 0.35 * at (0.49));
  double before = at (0.55);
  for (int k = 1; k < 6; k++) {
    const double now = at (0.55 + 0.01 * k);
    EXPECT_LT (now, before) << "it only fades, " << k;
    before = now;
  }
}

TEST (Scene, ThePouredLiquidDarkensTheGlass)
{
  double before = 1.0;
  for (double seconds : {0.0, 0.3, 0.6, 0.9, 1.2}) {
    const double now = mean_of (picture_of (SceneKind::kPour, seconds));
    EXPECT_LT (now, before) << seconds;
    before = now;
  }
}

} // namespace
