/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The run-length code of images: every image is restored, and the streams use
 * only what controllers are known to read. */
#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "dmd/erle.h"
#include "hex.h"
#include "mirrors.h"
#include "emulation/spld_decoder.h"

using namespace codedexposure;
using namespace codedexposure::test;
using namespace codedexposure::emulated;

namespace
{

/** The image out of a function of x and y. */
template <typename Pixel>
Pixels
image_of (int width, int height, Pixel pixel)
{
  Pixels image (width, height);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      image.at (x, y) = pixel (x, y);
  return image;
}

Pixels
row_of (std::initializer_list<PlanePixel> pixels)
{
  return image_of (
      int (pixels.size ()), 1, [&] (int x, int) { return pixels.begin ()[x]; });
}

Bytes
code_of_rows (const Pixels &image)
{
  return encode_erle (rows_of (image), 0, image.width ()).joined ();
}

std::string
code_of (const Pixels &image)
{
  return to_hex (code_of_rows (image));
}

void
expect_round_trip (const Pixels &image)
{
  const PiecedBytes pieces = encode_erle (rows_of (image), 0, image.width ());
  const Bytes code = pieces.joined ();
  EXPECT_EQ (code.size () % 4, 0u);
  EXPECT_EQ (code.size (), pieces.size);
  Pixels decoded (image.width (), image.height ());
  ByteReader in (code, 0);
  ASSERT_TRUE (decode_erle (in, decoded));
  EXPECT_LT (code.size () - in.at (), 4u) << "more than padding is left over";
  EXPECT_EQ (decoded, image);
}

} // namespace

TEST (Erle, RepeatsAPixelWithItsHighestPlanesFirst)
{
  EXPECT_EQ (code_of (row_of ({0x102030, 0x102030, 0x102030})),
      "03 10 20 30 00 01 00 00");
}

TEST (Erle, WritesALonePixelAsARunOfOne)
{
  EXPECT_EQ (code_of (row_of ({0x000001})), "01 00 00 01 00 01 00 00");
}

TEST (Erle, WritesDifferentPixelsAsLiterals)
{
  EXPECT_EQ (code_of (row_of ({1, 2})), "00 02 00 00 01 00 00 02 00 01 00 00");
}

TEST (Erle, CopiesARowFromTheOneAbove)
{
  const Pixels image =
      image_of (3, 2, [] (int x, int) { return PlanePixel (x + 1); });
  EXPECT_EQ (code_of (image),
      "00 03 00 00 01 00 00 02 00 00 03 00 01 03 00 01 00 00 00 00");
}

TEST (Erle, AllEqualImageIsTheDocumentsStream)
{
  const Bytes code =
      code_of_rows (image_of (1920, 1080, [] (int, int) { return 1u; }));
  ASSERT_EQ (code.size (), 4324u);
  EXPECT_EQ (to_hex (ByteView (code).first (13)),
      "80 0F 00 00 01 00 01 80 0F 00 01 80 0F");
  EXPECT_EQ (to_hex (ByteView (code).last (7)), "00 01 80 0F 00 01 00");
}

class ErleRunLengths : public ::testing::TestWithParam<int>
{
};

TEST_P (ErleRunLengths, RunsLiteralsAndCopiesComeBack)
{
  const int n = GetParam ();
  expect_round_trip (image_of (n, 3, [] (int, int) { return 0xABCDEFu; }));
  expect_round_trip (
      image_of (n, 3, [] (int x, int) { return PlanePixel (x); }));
  expect_round_trip (
      image_of (n, 3, [] (int x, int y) { return PlanePixel (x + 7 * y); }));
  // One pixel before and one after the run of that length.
  expect_round_trip (image_of (n + 2, 3, [n] (int x, int y) {
    return x == 0 || x == n + 1 ? PlanePixel (y) : 0x808080u;
  }));
}

INSTANTIATE_TEST_SUITE_P (AroundTheBordersOfCounts, ErleRunLengths,
    ::testing::Values (1, 2, 3, 126, 127, 128, 129, 255, 256, 1920, 2560, 16383,
        16384, 32765));

TEST (Erle, ImagesOfAnyMakeComeBack)
{
  std::mt19937 random (5);
  const auto below = [&] (int bound) {
    return int (random () % unsigned (bound));
  };
  for (int i = 0; i < 400; i++) {
    const int colours = 1 + below (3);
    const int stripe = 1 + below (5), tile = 1 + below (5);
    const int sort = below (4);
    const Pixels image =
        image_of (1 + below (300), 1 + below (12), [&] (int x, int y) {
          switch (sort) {
          case 0:
            return PlanePixel (random () & 0xFFFFFF);
          case 1:
            return PlanePixel (below (colours + 1));
          case 2:
            return PlanePixel (x / stripe % 2);
          default:
            return PlanePixel (x % tile + tile * (y % tile));
          }
        });
    SCOPED_TRACE (i);
    expect_round_trip (image);
    if (HasFailure ())
      return;
  }
}

TEST (Erle, TakesAPartOfTheColumns)
{
  const Pixels wide =
      image_of (10, 4, [] (int x, int y) { return PlanePixel (x * y); });
  const Pixels narrow =
      image_of (6, 4, [] (int x, int y) { return PlanePixel (x * y); });
  EXPECT_EQ (
      encode_erle (rows_of (wide), 0, 6).joined (), code_of_rows (narrow));
}

TEST (Erle, RowsThatRepeatAreEncodedOnce)
{
  const Pixels image = image_of (
      40, 30, [] (int x, int y) { return PlanePixel (x * 3 + y % 3); });
  MirrorRows<PlanePixel> rows;
  rows.distinct =
      image_of (40, 3, [] (int x, int y) { return PlanePixel (x * 3 + y); });
  for (int y = 0; y < 30; y++)
    rows.order.push_back (y % 3);
  const PiecedBytes pieces = encode_erle (rows, 0, 40);
  EXPECT_EQ (pieces.pieces.size (), 5u); // the first, three, the end
  EXPECT_EQ (pieces.joined (), code_of_rows (image));
}
