/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames without the black level of the camera. */
#include "extract/black_level.h"

#include <algorithm>
#include <cstdint>

#include <gtest/gtest.h>

using namespace codedexposure;

namespace
{

/* Small and large values, in rows of all lengths around those of a vector; the pixel
 * behind each row stays as it is. */
template <typename Pixel>
void
expect_subtracted (int black, int bits)
{
  const int largest = (1 << bits) - 1;
  int value = -100;
  for (int width = 1; width <= 200; width++) {
    Image<Pixel> frame (width, 3), light (width + 1, 3);
    for (int y = 0; y < 3; y++) {
      for (int x = 0; x < width; x++)
        frame.at (x, y) = Pixel (value++);
      light.at (width, y) = 77;
    }
    subtract_black<Pixel> (
        frame.view (), black, bits, light.view ().block (0, 0, width, 3));
    for (int y = 0; y < 3; y++) {
      for (int x = 0; x < width; x++) {
        const int seen = frame.at (x, y);
        ASSERT_EQ (light.at (x, y),
            seen >= largest ? seen : std::max (seen - black, 0))
            << seen;
      }
      ASSERT_EQ (light.at (width, y), 77);
    }
  }
}

TEST (BlackLevel, IsTakenOffButFromWhatIsSaturated)
{
  for (const int black : {0, 1, 16, 254, 255})
    expect_subtracted<std::uint8_t> (black, 8);
  expect_subtracted<std::uint8_t> (5, 7);
  for (const int bits : {10, 12, 16})
    for (const int black : {0, 64, (1 << bits) - 1})
      expect_subtracted<std::uint16_t> (black, bits);
}

} // namespace
