/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How bright two cameras see the same places. */
#include <gtest/gtest.h>

#include "fuse/light_ratio.h"

namespace
{

using codedexposure::fuse::LightRatio;

TEST (LightRatio, OfDifferencesNeedsNoBlackLevel)
{
  for (const double black : {0.0, 500.0}) {
    LightRatio ratio;
    for (int place = 0; place < 100; place++)
      ratio.add (10.0 * place, 4.0 * place + black);
    EXPECT_NEAR (ratio.value (), 2.5, 1e-9) << black;
  }
}

TEST (LightRatio, IsThatOfTheMeansWherePlacesDoNotDifferOrCamerasDisagree)
{
  LightRatio even, other;
  for (int place = 0; place < 100; place++) {
    even.add (300.0, 100.0);
    other.add (place % 2 == 0 ? 500.0 : 100.0, place % 3 == 0 ? 200.0 : 50.5);
  }
  EXPECT_NEAR (even.value (), 3.0, 1e-9);
  EXPECT_NEAR (other.value (), 30000.0 / (34 * 200.0 + 66 * 50.5), 1e-9);
}

TEST (LightRatio, IsOneWhereNothingIsKnown)
{
  EXPECT_EQ (LightRatio ().value (), 1.0);
  LightRatio dark;
  dark.add (0.0, -3.0);
  EXPECT_EQ (dark.value (), 1.0);
}

} // namespace
