/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* scale_caps: coded caps to subframe caps and back. */
#include "common/caps.h"

#include <gtest/gtest.h>

#include "common/raii.h"

namespace
{

using namespace codedexposure::gst;

CapsScale
raster (int columns, int rows, bool raised_rate = true, int pilot_rows = 0)
{
  return {
      {raised_rate ? columns * rows : 1}, {1, columns}, {1, rows}, pilot_rows};
}

const CapsScale k2x2 = raster (2, 2);
const CapsScale k2x2SameRate = raster (2, 2, false);
const CapsScale k8x1 = raster (8, 1);
const CapsScale k2x2Pilot = raster (2, 2, true, 16);

struct Case {
  const char *rule;
  CapsScale scale;
  const char *in;
  const char *out;
};

void
PrintTo (const Case &c, std::ostream *os)
{
  *os << c.rule;
}

class ScaleCaps : public ::testing::TestWithParam<Case>
{
};

/* The fields of video/x-raw that do not matter here are left out. */
CapsPtr
video_caps (const std::string &fields)
{
  return CapsPtr (gst_caps_from_string (fields.c_str ()));
}

TEST_P (ScaleCaps, GivesTheCapsOfTheOtherSide)
{
  const Case &c = GetParam ();
  const CapsPtr in = video_caps (c.in);
  const CapsPtr expected = video_caps (c.out);
  ASSERT_TRUE (in && expected);
  const CapsPtr out (scale_caps (in.get (), c.scale));
  EXPECT_TRUE (gst_caps_is_equal (out.get (), expected.get ()))
      << CharPtr (gst_caps_to_string (out.get ())).get ();
}

INSTANTIATE_TEST_SUITE_P (ToSubframes, ScaleCaps,
    ::testing::Values (Case{"everything fixed", k2x2,
                           "video/x-raw,width=768,height=576,framerate=25/1,"
                           "pixel-aspect-ratio=1/1",
                           "video/x-raw,width=384,height=288,framerate=100/1,"
                           "pixel-aspect-ratio=1/1"},
        Case{"rate kept for a pad of one subframe", k2x2SameRate,
            "video/x-raw,width=768,framerate=25/1",
            "video/x-raw,width=384,framerate=25/1"},
        Case{"rate that is no whole number", k2x2,
            "video/x-raw,framerate=30000/1001",
            "video/x-raw,framerate=120000/1001"},
        Case{"unknown rate stays unknown", k2x2,
            "video/x-raw,framerate=0/1,max-framerate=25/1",
            "video/x-raw,framerate=0/1,max-framerate=100/1"},
        Case{"no fields, no limits", k2x2, "video/x-raw,format=GRAY8",
            "video/x-raw,format=GRAY8"},
        Case{"left-over column and row are cropped", k2x2,
            "video/x-raw,width=769,height=577",
            "video/x-raw,width=384,height=288"},
        Case{"ranges", k2x2, "video/x-raw,width=[64,129],framerate=[1/2,30/1]",
            "video/x-raw,width=[32,64],framerate=[2/1,120/1]"},
        Case{"no bound stays no bound", k2x2,
            "video/x-raw,width=[1,2147483647],"
            "framerate=(fraction)[0/1,2147483647/1]",
            "video/x-raw,width=[1,2147483647],"
            "framerate=(fraction)[0/1,2147483647/1]"},
        Case{"range that shrinks to one value", k2x2,
            "video/x-raw,width=[64,65]", "video/x-raw,width=32"},
        Case{"lists, without repeats", k2x2,
            "video/x-raw,width={64,65,128},framerate={25/1,30000/1001}",
            "video/x-raw,width={32,64},framerate={100/1,120000/1001}"},
        Case{"ranges in a list", k2x2, "video/x-raw,width={[64,80],[100,201]}",
            "video/x-raw,width={[32,40],[50,100]}"},
        Case{"too small for one cell", k8x1, "video/x-raw,width=7", "EMPTY"},
        Case{"only what holds a cell is left", k8x1,
            "video/x-raw,width={7,16};video/x-raw,width=5",
            "video/x-raw,width=2"},
        Case{"pixels of a flat cell are wide", k8x1,
            "video/x-raw,pixel-aspect-ratio=1/1",
            "video/x-raw,pixel-aspect-ratio=8/1"},
        Case{"aspect in lowest terms", raster (3, 2),
            "video/x-raw,pixel-aspect-ratio=10/11",
            "video/x-raw,pixel-aspect-ratio=15/11"},
        Case{"pilot rows are cropped first", k2x2Pilot,
            "video/x-raw,height=576", "video/x-raw,height=280"},
        Case{"nothing but pilot rows", k2x2Pilot, "video/x-raw,height=16",
            "EMPTY"},
        Case{"rate above what caps hold", k2x2,
            "video/x-raw,framerate=1000000000/1",
            "video/x-raw,framerate=2147483647/1"},
        Case{"features are kept", k2x2,
            "video/x-raw(meta:GstVideoMeta),width=64",
            "video/x-raw(meta:GstVideoMeta),width=32"},
        Case{"ANY", k2x2, "ANY", "ANY"},
        Case{"EMPTY", k2x2, "EMPTY", "EMPTY"}));

INSTANTIATE_TEST_SUITE_P (ToCoded, ScaleCaps,
    ::testing::Values (
        Case{"every size that would be cropped to it", k2x2.inverse (),
            "video/x-raw,width=384,height=288,framerate=100/1",
            "video/x-raw,width=[768,769],height=[576,577],framerate=25/1"},
        Case{"rate kept", k2x2SameRate.inverse (), "video/x-raw,framerate=25/1",
            "video/x-raw,framerate=25/1"},
        Case{"rate that is no whole number", k2x2.inverse (),
            "video/x-raw,framerate=120000/1001",
            "video/x-raw,framerate=30000/1001"},
        Case{"rate that does not divide", k2x2.inverse (),
            "video/x-raw,framerate=25/1", "video/x-raw,framerate=25/4"},
        Case{"unknown rate stays unknown", k2x2.inverse (),
            "video/x-raw,framerate=0/1", "video/x-raw,framerate=0/1"},
        Case{"no fields, no limits", k2x2.inverse (), "video/x-raw",
            "video/x-raw"},
        Case{"ranges", k2x2.inverse (),
            "video/x-raw,width=[32,64],framerate=[2/1,120/1]",
            "video/x-raw,width=[64,129],framerate=[1/2,30/1]"},
        Case{"no bound stays no bound", k2x2.inverse (),
            "video/x-raw,width=[1,2147483647],"
            "framerate=(fraction)[0/1,2147483647/1]",
            "video/x-raw,width=[2,2147483647],"
            "framerate=(fraction)[0/1,2147483647/1]"},
        Case{"lists", k2x2.inverse (),
            "video/x-raw,width={32,64},framerate={100/1,120000/1001}",
            "video/x-raw,width={[64,65],[128,129]},"
            "framerate={25/1,30000/1001}"},
        Case{"pixels of a flat cell", k8x1.inverse (),
            "video/x-raw,pixel-aspect-ratio=8/1",
            "video/x-raw,pixel-aspect-ratio=1/1"},
        Case{"pilot rows are put back", k2x2Pilot.inverse (),
            "video/x-raw,height=280", "video/x-raw,height=[576,577]"},
        Case{"size above what caps hold", k2x2.inverse (),
            "video/x-raw,width=2000000000", "video/x-raw,width=2147483647"}));

} // namespace
