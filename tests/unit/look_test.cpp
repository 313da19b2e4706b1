/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Which part of the pictures a window shows, and in which tones. */
#include "window/look.h"

#include <gtest/gtest.h>

namespace
{

using namespace codedexposure::app;
using codedexposure::Position;

constexpr Position kMiddle{0.5, 0.5};

TEST (Look, IsPlainAtFirst)
{
  const Look look;
  EXPECT_TRUE (look.is_plain ());
  EXPECT_EQ (look.whole ({0.25, 0.75}), (Position{0.25, 0.75}));
  EXPECT_EQ (look.tones (4095), (Tones{0, 4095}));
}

TEST (Look, KeepsWhatIsAtThePointer)
{
  Look look;
  const Position at{0.75, 0.25};
  for (int zoom = 2; zoom <= Look::kMostZoom; zoom *= 2) {
    look.zoom_in (at);
    EXPECT_EQ (look.zoom (), zoom);
    EXPECT_EQ (look.whole (at), at);
  }
  look.zoom_in (at);
  EXPECT_EQ (look.zoom (), Look::kMostZoom);
  while (look.zoom () > 1)
    look.zoom_out (at);
  EXPECT_TRUE (look.is_plain ());
}

TEST (Look, NeverLeavesThePicture)
{
  Look look;
  look.zoom_in (kMiddle);
  EXPECT_EQ (look.whole ({0, 0}), (Position{0.25, 0.25}));
  look.move ({-0.25, 0.25});
  EXPECT_EQ (look.whole ({0, 0}), (Position{0.375, 0.125}));
  look.move ({-10, 10});
  EXPECT_EQ (look.whole ({0, 0}), (Position{0.5, 0}));
  look.zoom_out ({1, 1});
  EXPECT_EQ (look.whole ({0, 0}), (Position{0, 0}));
  look.move ({0.5, 0.5});
  EXPECT_TRUE (look.is_plain ());
}

TEST (Look, IsTwiceAsBrightAndBack)
{
  Look look;
  look.brighten (true, 255);
  EXPECT_EQ (look.tones (255), (Tones{0, 127}));
  for (int k = 0; k < 20; k++)
    look.brighten (true, 255);
  EXPECT_EQ (look.tones (255), (Tones{0, 1}));
  for (int k = 0; k < 20; k++)
    look.brighten (false, 255);
  EXPECT_TRUE (look.has_all_tones ());
}

TEST (Look, DragsTones)
{
  Look look;
  look.set_tones ({1000, 2000}, 4095);
  EXPECT_EQ (look.tones (4095), (Tones{1000, 2000}));
  look.drag_tones ({0.25, 0});
  EXPECT_EQ (look.tones (4095), (Tones{1250, 1750}));
  look.drag_tones ({0, -0.5});
  EXPECT_EQ (look.tones (4095), (Tones{1000, 1500}));
  for (int k = 0; k < 50; k++)
    look.drag_tones ({1, 1});
  const Tones tones = look.tones (4095);
  EXPECT_LT (tones.black, tones.white);
  EXPECT_LE (tones.white, 4095);
  look.show_all_tones ();
  EXPECT_TRUE (look.is_plain ());
}

} // namespace
