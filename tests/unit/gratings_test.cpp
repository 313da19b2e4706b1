/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Calibration patterns: names, mirrors and the complete sequence. */
#include "calibrate/gratings.h"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

using namespace codedexposure;

namespace
{

std::string
row_of (const char *text, int width, int y = 0)
{
  const auto pattern = Pattern::parse (text);
  EXPECT_TRUE (pattern.ok ()) << pattern.error ().message;
  std::string row;
  for (int x = 0; x < width; x++)
    row += pattern->on (x, y) ? '1' : '0';
  return row;
}

} // namespace

TEST (Gratings, Mirrors)
{
  EXPECT_EQ (row_of ("dark", 4), "0000");
  EXPECT_EQ (row_of ("white", 4), "1111");
  EXPECT_EQ (row_of ("grating-x:4/0", 10), "1100110011");
  EXPECT_EQ (row_of ("grating-x:4/1", 10), "1001100110");
  EXPECT_EQ (row_of ("grating-y:4/0", 4, 1), "1111");
  EXPECT_EQ (row_of ("grating-y:4/0", 4, 2), "0000");
  EXPECT_EQ (row_of ("grating-both:4/0", 8, 1), "11001100");
  EXPECT_EQ (row_of ("grating-both:4/0", 8, 2), "00000000");
  EXPECT_EQ (row_of ("gray-x:2/0", 16), "0011110000111100");
  EXPECT_EQ (row_of ("gray-x:2/1", 16), "0000111111110000");
  EXPECT_EQ (row_of ("gray-x:2/1-inverse", 8), "11110000");
}

TEST (Gratings, TheOtherBeamShowsAPatternOfTheRun)
{
  const auto patterns = calibration_patterns ({64, 48});
  for (const Pattern &pattern : patterns) {
    const Pattern other = pattern.complement ();
    EXPECT_NE (std::ranges::find (patterns, other), patterns.end ())
        << pattern.text ();
    for (int y = 0; y < 48; y++)
      for (int x = 0; x < 64; x++)
        ASSERT_NE (pattern.on (x, y), other.on (x, y)) << pattern.text ();
  }
}

TEST (Gratings, NamesGoBothWays)
{
  for (const Pattern &pattern : calibration_patterns ({1024, 768})) {
    const auto read = Pattern::parse (pattern.text ());
    ASSERT_TRUE (read.ok ()) << pattern.text ();
    EXPECT_EQ (*read, pattern);
  }
  EXPECT_EQ (live_grating ().text (), "grating-both:4/0");
}

TEST (Gratings, WrongNamesAreExplained)
{
  const std::pair<const char *, const char *> cases[] = {
      {"grey-x:2/0", "it is not known"},
      {"grating-z:4/0", "its axis must be x, y or both"},
      {"grating-x:4", "two whole numbers"},
      {"grating-x:5/0", "its period must be even"},
      {"grating-x:4/4", "its phase must be"},
      {"gray-x:0/1", "1 to 256 mirrors wide"},
      {"gray-x:4/14", "its bit must be 0 to 13"},
      {"gray-both:4/1", "the axis of a Gray code must be x or y"},
  };
  for (const auto &[text, why] : cases) {
    const auto pattern = Pattern::parse (text);
    ASSERT_FALSE (pattern.ok ()) << text;
    EXPECT_NE (pattern.error ().message.find (why), std::string::npos)
        << pattern.error ().message;
  }
}

TEST (Gratings, GrayCodesTellAllStripes)
{
  const auto patterns = calibration_patterns ({1000, 700});
  for (const bool along_y : {false, true}) {
    std::set<std::string> codes;
    const int size = along_y ? 700 : 1000;
    for (int at = 0; at < size; at++) {
      std::string code;
      for (const Pattern &p : patterns)
        if (p.kind == Pattern::Kind::gray && (p.axis == Axis::y) == along_y)
          code += p.on (along_y ? 0 : at, along_y ? at : 0) ? '1' : '0';
      codes.insert (code);
    }
    EXPECT_EQ (int (codes.size ()), (size + 5) / 6);
  }
}

TEST (Gratings, ARunHasEachPatternOnce)
{
  const auto patterns = calibration_patterns ({1024, 768}, 12);
  /* Dark and white; 8 bits of 171 and 7 of 128 stripes, twice; 12 phases of
   * each direction. */
  EXPECT_EQ (patterns.size (), 2u + 2 * (8 + 7) + 2 * 12);
  std::set<std::string> names;
  for (const Pattern &pattern : patterns)
    names.insert (pattern.text ());
  EXPECT_EQ (names.size (), patterns.size ());
}
