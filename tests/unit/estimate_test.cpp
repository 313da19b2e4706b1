/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Covariances and kriging against cases that can be worked out by hand. */
#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "estimate/kriging.h"

namespace
{

using namespace codedexposure;

Observation
observation_of (const char *preset)
{
  return {Schedule::from_preset (preset).value (), {}, 0.0, 255.0};
}

TEST (Kriging, SimpleWeightsOfTwoTaps)
{
  /* C = [[2, 1], [1, 2]] with the noise, C^-1 = [[2, -1], [-1, 2]] / 3. What
   * stands below the diagonal is not read. */
  const KrigingSystem system{
      {1.0, 1.0, -99.0, 1.5}, {1.0, 0.5}, {1.0, 0.0, 0.5, 0.5}};
  const std::vector<double> weights = solve_kriging (system);
  const std::vector<double> expected{2.0 / 3, -1.0 / 3, 0.5 / 3, 0.5 / 3};
  ASSERT_EQ (weights.size (), expected.size ());
  for (std::size_t i = 0; i < weights.size (); i++)
    EXPECT_NEAR (weights[i], expected[i], 1e-14) << i;
}

/* Taps that have nothing in common with the target give its mean. */
TEST (Kriging, OrdinaryWeightsKeepFlatLight)
{
  const std::vector<double> light{1.0, 0.5, 0.25};
  const KrigingSystem system{{1.0, 0.2, 0.1, 0.0, 1.0, 0.3, 0.0, 0.0, 1.0},
      {0.1, 0.1, 0.2}, {0.7, 0.3, 0.2, 0.0, 0.0, 0.0}, light, {1.0, 0.5}};
  const std::vector<double> weights = solve_kriging (system);
  EXPECT_NEAR (
      std::inner_product (light.begin (), light.end (), weights.begin (), 0.0),
      1.0, 1e-14);
  EXPECT_NEAR (std::inner_product (
                   light.begin (), light.end (), weights.begin () + 3, 0.0),
      0.5, 1e-14);
}

/* Twice the same tap, and covariances that no process has: the first cannot be
 * inverted, the second has a negative pivot. */
TEST (Kriging, GivesFiniteWeightsWithoutACholeskyFactor)
{
  for (const double common : {1.0, 1.0 + 1e-9, 1.5}) {
    const KrigingSystem system{
        {1.0, common, 0.0, 1.0}, {0.0, 0.0}, {0.8, 0.8}, {1.0, 1.0}, {1.0}};
    const std::vector<double> weights = solve_kriging (system);
    ASSERT_EQ (weights.size (), 2u);
    EXPECT_NEAR (weights[0], 0.5, 1e-3) << common;
    EXPECT_NEAR (weights[1], 0.5, 1e-3) << common;
  }
}

/* The first two taps see the target almost alone; the third one, with its pair,
 * adds little. */
TEST (SparseKriging, TakesThePairsThatHelpMost)
{
  const KrigingSystem system{{1.0, 0.5, 0.1, 0.0, 0.0, 1.0, 0.1, 0.0, 0.0, 0.0,
                                 1.0, 0.0, 0.0, 0.0, 0.0, 1.0},
      {0.01, 0.01, 0.01, 0.01}, {}, {1.0, 1.0, 1.0, 1.0}};
  const std::vector<double> target{0.8, 0.7, 0.15, 0.1};
  const std::vector<TapPair> pairs{{0, 1}, {1, 2}, {2, 3}, {3, -1}};
  const SparseKriging kriging (system, pairs);
  const auto solved = [&] (double excess) {
    return kriging.solve (target, 1.0, 1.0, excess);
  };
  KrigingSystem all = system, two{{1.0, 0.5, 0.0, 1.0}, {0.01, 0.01},
                                  {0.8, 0.7}, {1.0, 1.0}, {1.0}};
  all.targets = target;
  all.flat_targets = {1.0};
  const auto every = solve_kriging (all), best = solve_kriging (two);
  for (std::size_t i = 0; i < 4; i++) {
    EXPECT_NEAR (solved (0.0)[i], every[i], 1e-9) << i;
    EXPECT_NEAR (solved (0.5)[i], i < 2 ? best[i] : 0.0, 1e-9) << i;
  }
}

/* Where noise hides all, no tap lowers the error by what would be accepted. */
TEST (SparseKriging, KeepsFlatLightUnderAnyNoise)
{
  const std::vector<TapPair> pairs{{0, 1}, {1, -1}};
  for (const double noise : {1e3, 1e6, 1e12}) {
    const SparseKriging kriging (
        {{1.0, 0.5, 0.0, 1.0}, {noise, noise}, {}, {1.0, 1.0}}, pairs);
    const auto weights =
        kriging.solve (std::vector{0.8, 0.7}, 1.0, 1.0 + noise, 0.01);
    EXPECT_NEAR (weights[0] + weights[1], 1.0, 1e-9) << noise;
  }
  /* Nothing to estimate it from. */
  const SparseKriging alone ({{}, {}, {}, {}}, {});
  EXPECT_TRUE (alone.solve ({}, 1.0, 1.0, 0.01).empty ());
}

/* A one-hot code: pixels are points of the scene, each in its slot. */
TEST (CodedCovariance, IsTheScenesForOneHotCodes)
{
  const Observation observation = observation_of ("sequential:2x2");
  for (const SceneClass &patch :
      {SceneClass{}, SceneClass{1.0, -0.5, 12.0, 1.0, 0.9},
          SceneClass{.spread = 1.5}, SceneClass{.speed = 2.0}}) {
    const CodedCovariance covariance (patch, observation.shares (), 4, 3);
    for (int a = 0; a < 4; a++)
      for (int b = 0; b < 4; b++)
        for (const Offset apart : {Offset{0, 0}, Offset{-1, 0}, Offset{2, 3}}) {
          const double expected =
              scene_correlation (patch, apart.x, apart.y, a - b);
          EXPECT_NEAR (covariance.coded (apart, a, b), expected, 1e-12);
          EXPECT_NEAR (covariance.target (apart, a, b), expected, 1e-12);
        }
  }
}

/* Element 0 of a staircase of two sees slot 0, element 1 the mean of both. */
TEST (CodedCovariance, AveragesOverTheSlotsOfAnElement)
{
  const Observation observation = observation_of ("staircase:2x1");
  const SceneClass patch{.correlation = 0.6};
  const CodedCovariance covariance (patch, observation.shares (), 2, 1);
  const double space = scene_correlation (patch, 1, 0, 0);
  EXPECT_NEAR (covariance.target ({1, 0}, 1, 0), space * 0.8, 1e-12);
  EXPECT_NEAR (covariance.coded ({1, 0}, 1, 0), space * 0.8, 1e-12);
  EXPECT_NEAR (covariance.coded ({1, 0}, 1, 1), space * 0.8, 1e-12);
  EXPECT_NEAR (covariance.coded ({0, 0}, 0, 0), 1.0, 1e-12);
}

/* Light that is collected at two moments half a slot apart. */
TEST (CodedCovariance, AveragesOverTheTimesOfASlot)
{
  const Observation observation = observation_of ("sequential:2x1");
  const SceneClass patch{.correlation = 0.5};
  const CodedCovariance covariance (patch, observation.shares (), 2, 0,
      {{{-0.5, 0.25}, {0.0, 0.5}, {0.5, 0.25}}, {{-0.25, 0.5}, {0.25, 0.5}}});
  EXPECT_NEAR (
      covariance.coded ({0, 0}, 0, 0), 0.5 + 0.5 * std::sqrt (0.5), 1e-12);
  EXPECT_NEAR (covariance.coded ({0, 0}, 0, 1),
      0.25 * std::sqrt (0.5) + 0.5 * 0.5 + 0.25 * std::pow (0.5, 1.5), 1e-12);
  EXPECT_NEAR (covariance.target ({0, 0}, 0, 0), std::pow (0.5, 0.25), 1e-12);
}

TEST (SceneModel, CorrelationsAreThoseOfTheirDefinition)
{
  const SceneClass rough{.length = 2.0, .smoothness = 1.0, .correlation = 1.0};
  for (const double r : {0.1, 1.0, 3.7, 11.0})
    EXPECT_NEAR (scene_correlation (rough, 0.0, 2.0 * r, 0.0),
        r * std::cyl_bessel_k (1.0, r), 1e-5);
  EXPECT_EQ (scene_correlation (rough, 0.0, 0.0, 5.0), 1.0);
  EXPECT_EQ (scene_correlation (rough, 100.0, 0.0, 0.0), 0.0);
  const SceneClass smooth{.length = 2.0, .correlation = 0.8};
  EXPECT_NEAR (scene_correlation (smooth, 3.0, 4.0, -2.0),
      3.5 * std::exp (-2.5) * 0.64, 1e-12);
  /* A patch that moves is itself again where it has moved to. */
  const SceneClass moving{1.5, -2.0, 12.0, 1.0, 0.9};
  EXPECT_NEAR (scene_correlation (moving, 3.0, -4.0, 2.0), 0.81, 1e-12);
}

} // namespace
