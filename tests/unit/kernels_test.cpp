/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Every instruction set of this machine gives the pixels of the scalar
 * reference, bit for bit, and writes no other bytes. */
#include "extract/extractor.h"

#include <algorithm>
#include <functional>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "extract/network.h"

namespace
{

using namespace codedexposure;

/** Views into a block of bytes that is not aligned, has padded rows and detects
 * writes outside the pixels. */
template <typename Pixel>
class Guarded
{
public:
  Guarded (int width, int height, int offset, int padding)
      : stride_ (std::ptrdiff_t (std::size_t (width) * sizeof (Pixel)) +
                 padding * std::ptrdiff_t (sizeof (Pixel))),
        bytes_ (std::size_t (stride_ * height) + 320, kGuard),
        view_{reinterpret_cast<Pixel *> (line_in (bytes_)) + offset, width,
            height, stride_}
  {
  }

  ImageView<Pixel> view () const { return view_; }
  bool untouched_beside () const
  {
    const auto *first = reinterpret_cast<const std::uint8_t *> (view_.data);
    for (std::size_t i = 0; i < bytes_.size (); i++) {
      const std::ptrdiff_t at = bytes_.data () + i - first;
      const bool inside =
          at >= 0 && at / stride_ < view_.height &&
          at % stride_ <
              std::ptrdiff_t (std::size_t (view_.width) * sizeof (Pixel));
      if (!inside && bytes_[i] != kGuard)
        return false;
    }
    return true;
  }

private:
  /* Non-temporal stores are used only if all planes have the same alignment to
   * cache lines. */
  static std::uint8_t *line_in (std::vector<std::uint8_t> &bytes)
  {
    const auto at = reinterpret_cast<std::uintptr_t> (bytes.data ());
    return bytes.data () + 64 + -at % 64;
  }

  static constexpr std::uint8_t kGuard = 0xa5;
  std::ptrdiff_t stride_;
  std::vector<std::uint8_t> bytes_;
  ImageView<Pixel> view_;
};

using Value = std::function<unsigned (int x, int y)>;
struct Content {
  const char *name;
  Value value;
};

std::mt19937 random_bits (1);

const std::vector<Content> &
contents ()
{
  static const std::vector<Content> all = {
      {"random", [] (int, int) { return unsigned (random_bits ()); }},
      {"equal", [] (int, int) { return 77U; }},
      {"rising", [] (int x, int y) { return unsigned (3 * x + 5 * y); }},
      {"falling", [] (int x, int y) { return unsigned (65535 - x - 7 * y); }},
      {"two values", [] (int, int) { return random_bits () % 2 * 65535U; }},
      {"saturated", [] (int, int) { return 65535U; }},
  };
  return all;
}

struct Case {
  const char *schedule;
  ExtractOptions options;
};

/** Extracts a frame with one instruction set. */
template <typename Pixel>
struct Run {
  std::vector<Guarded<Pixel>> subframes;
  ExtractReport report;
};

template <typename Pixel>
Run<Pixel>
run (const Schedule &schedule, ImageView<const Pixel> coded,
    ExtractOptions options, std::string_view target, int offset, int padding)
{
  options.target = target;
  const auto extractor =
      Extractor<Pixel>::make (schedule, coded.width, coded.height, options);
  if (!extractor) {
    ADD_FAILURE () << extractor.error ().message;
    return {};
  }
  Run<Pixel> result;
  const Extent size = extractor->subframe_size ();
  std::vector<ImageView<Pixel>> views;
  for (int k = 0; k < extractor->subframes (); k++)
    result.subframes.emplace_back (size.width, size.height, offset, padding);
  for (auto &subframe : result.subframes)
    views.push_back (subframe.view ());
  result.report = extractor->run (coded, views).value ();
  return result;
}

template <typename Pixel>
bool
same_pixels (ImageView<Pixel> a, ImageView<Pixel> b)
{
  for (int y = 0; y < a.height; y++)
    if (!std::equal (a.row (y), a.row (y) + a.width, b.row (y)))
      return false;
  return true;
}

/** Compares all instruction sets for a frame with @p columns cells per row. */
template <typename Pixel>
void
expect_equal (const Case &c, const Content &content, int columns, int rows)
{
  const auto schedule = Schedule::from_preset (c.schedule);
  ASSERT_TRUE (schedule) << schedule.error ().message;
  const Extent cell = schedule->cell ();
  const int width = columns * cell.width + columns % cell.width;
  const int height = rows * cell.height;
  const int padding = columns % 3 * 5;
  const int offset = columns % 4;
  Guarded<Pixel> coded (width, height, offset, padding);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      coded.view ().at (x, y) = Pixel (content.value (x, y));

  const ImageView<const Pixel> frame = coded.view ();
  const auto truth = run (*schedule, frame, c.options, "scalar", 0, 0);
  for (const auto target : extract_targets ()) {
    SCOPED_TRACE (std::string (c.schedule) + " " +
                  std::string (method_name (c.options.method)) + " " +
                  content.name + " " + std::string (target) + " " +
                  std::to_string (width) + "x" + std::to_string (height) +
                  " of " + std::to_string (sizeof (Pixel)) + " bytes");
    const auto got = run (*schedule, frame, c.options, target, offset, padding);
    EXPECT_EQ (got.report.saturated, truth.report.saturated);
    for (std::size_t k = 0; k < truth.subframes.size (); k++) {
      ASSERT_TRUE (
          same_pixels (got.subframes[k].view (), truth.subframes[k].view ()))
          << "subframe " << k;
      ASSERT_TRUE (got.subframes[k].untouched_beside ()) << "subframe " << k;
    }
  }
}

template <typename Pixel>
class Kernels : public ::testing::Test
{
};
using Pixels = ::testing::Types<std::uint8_t, std::uint16_t>;
TYPED_TEST_SUITE (Kernels, Pixels);

TYPED_TEST (Kernels, EqualTheReferenceOnEveryTileAndMethod)
{
  const Case cases[] = {
      {"sequential:2x2", {.method = Method::kSelect}},
      {"sequential:3x3,phase=1/2", {.method = Method::kSelect}},
      {"sequential:16x16,order=bit-reversal", {.method = Method::kSelect}},
      {"sequential:17x3", {.method = Method::kSelect}},
      {"sequential:251x1", {.method = Method::kSelect}},
      {"sequential:1x7", {.method = Method::kSelect}},
      {"sequential:lattice:4/2,phase=3/1", {.method = Method::kSelect}},
      {"sequential:lattice:5/2", {.method = Method::kSelect}},
      {"sequential:lattice:8/3,order=bit-reversal",
          {.method = Method::kSelect}},
      {"sequential:lattice:9/3", {.method = Method::kSelect}},
      {"sequential:diamond:13", {.method = Method::kSelect}},
      {"sequential:lattice:256/16", {.method = Method::kSelect}},
      {"staircase:2x2", {.method = Method::kDecode}},
      {"staircase:2x2,phase=1/1", {.method = Method::kDecode}},
      {"staircase:8x8,order=bit-reversal", {.method = Method::kDecode}},
      {"staircase:9x9", {.method = Method::kDecode}},
      {"staircase:16x16", {.method = Method::kDecode}},
      {"staircase:3x3", {.method = Method::kDecode, .interpolate = false}},
      {"staircase:4x4",
          {.method = Method::kDecode, .gain = 7.0, .interpolate = false}},
      {"staircase:3x2", {.method = Method::kDecode, .gain = 1.7}},
      {"staircase:9x9", {.method = Method::kDecode, .interpolate = false}},
      {"staircase:16x16", {.method = Method::kDecode, .interpolate = false}},
      {"staircase:17x3", {.method = Method::kDecode, .interpolate = false}},
      {"staircase:lattice:8/3", {.method = Method::kDecode}},
      {"staircase:2x2,leak=0.01", {.method = Method::kDecode}},
      {"sequential:2x2,leak=0.01", {.method = Method::kDecode}},
      {"s-matrix:4x4", {.method = Method::kDecode}},
      {"s-matrix:7x1", {.method = Method::kDecode}},
      {"staircase:2x2", {.method = Method::kRank}},
      {"staircase:3x3", {.method = Method::kRank}},
      {"staircase:4x4", {.method = Method::kRank}},
      {"staircase:9x9", {.method = Method::kRank}},
      {"staircase:16x16", {.method = Method::kRank}},
      {"staircase:lattice:13/5", {.method = Method::kRank}},
      {"staircase:4x2,phase=1/1", {.method = Method::kRank}},
      {"staircase:2x4", {.method = Method::kRank}},
  };
  for (const Case &c : cases)
    for (const Content &content : contents ())
      for (const auto &[columns, rows] : {std::pair (17, 2), {85, 5}})
        expect_equal<TypeParam> (c, content, columns, rows);
}

TYPED_TEST (Kernels, EqualTheReferenceAtEveryWidth)
{
  const Case cases[] = {
      {"sequential:2x2", {.method = Method::kSelect}},
      {"sequential:3x3", {.method = Method::kSelect}},
      {"sequential:lattice:8/3", {.method = Method::kSelect}},
      {"staircase:2x2", {.method = Method::kDecode}},
      {"staircase:3x3", {.method = Method::kDecode, .interpolate = false}},
      {"staircase:5x4", {.method = Method::kDecode, .interpolate = false}},
      {"s-matrix:2x2", {.method = Method::kDecode}},
      {"staircase:3x3", {.method = Method::kRank}},
      {"staircase:5x5", {.method = Method::kRank}},
  };
  for (const Case &c : cases)
    for (int columns = 1; columns <= 200; columns++)
      expect_equal<TypeParam> (c, contents ()[0], columns, 2);
}

TYPED_TEST (Kernels, RankEqualsTheReferenceForEveryGroupSize)
{
  for (int n = 2; n <= 256; n++) {
    const std::string schedule =
        "staircase:lattice:" + std::to_string (n) + "/1";
    for (const std::size_t content : {0, 2, 4})
      expect_equal<TypeParam> ({schedule.c_str (), {.method = Method::kRank}},
          contents ()[content], 70, 1);
  }
}

TYPED_TEST (Kernels, EqualTheReferenceOnFramesThatBypassTheCaches)
{
  /* Just above the size from which non-temporal stores are used, in bytes. */
  const int rows = 750 / int (sizeof (TypeParam));
  for (const char *schedule : {"sequential:4x2", "sequential:lattice:8/3"})
    expect_equal<TypeParam> (
        {schedule, {.method = Method::kSelect}}, contents ()[0], 1501, rows);
  expect_equal<TypeParam> (
      {"staircase:3x3", {.method = Method::kRank}}, contents ()[0], 1301, rows);
  expect_equal<TypeParam> ({"staircase:9x9", {.method = Method::kRank}},
      contents ()[0], 301, 360 / int (sizeof (TypeParam)));
  expect_equal<TypeParam> ({"sequential:3x3", {.method = Method::kSelect}},
      contents ()[0], 1301, rows);
  expect_equal<TypeParam> (
      {"staircase:4x4", {.method = Method::kDecode, .interpolate = false}},
      contents ()[0], 601, 900 / int (sizeof (TypeParam)));
}

TYPED_TEST (Kernels, BandsOfRowsMakeTheWholeFrame)
{
  for (const Method method :
      {Method::kSelect, Method::kRank, Method::kDecode}) {
    const auto extractor = Extractor<TypeParam>::make (
        *Schedule::from_preset ("staircase:3x3"), 100, 60, {.method = method});
    Image<TypeParam> coded (100, 60);
    for (int y = 0; y < 60; y++)
      for (int x = 0; x < 100; x++)
        coded.at (x, y) = TypeParam (random_bits ());

    const Extent size = extractor->subframe_size ();
    std::vector<Image<TypeParam>> whole (
        9, Image<TypeParam> (size.width, size.height));
    auto banded = whole;
    std::vector<ImageView<TypeParam>> to_whole, to_banded;
    for (std::size_t k = 0; k < 9; k++) {
      to_whole.push_back (whole[k].view ());
      to_banded.push_back (banded[k].view ());
    }
    const Image<TypeParam> &frame = coded;
    const auto truth = extractor->run (frame.view (), to_whole).value ();
    std::uint64_t saturated = 0;
    const int end = size.height;
    for (const auto &[first, rows] :
        {std::pair (13, 7), {0, 13}, {7, 0}, {end, 0}})
      saturated += extractor->run_rows (frame.view (), to_banded, first, rows)
                       .value ()
                       .saturated;
    EXPECT_EQ (saturated, truth.saturated);
    EXPECT_EQ (whole, banded) << method_name (method);
  }
}

/** 0-1 principle (Knuth, The Art of Computer Programming 3, 5.3.4): a network
 * that sorts all sequences of zeros and ones sorts everything. */
template <int N>
void
expect_sorts_zeros_and_ones ()
{
  constexpr auto net = Network<N>::sort ();
  for (unsigned input = 0; input < 1U << N; input++) {
    unsigned wires = input;
    for (int i = 0; i < net.size (); i++) {
      const Comparator c = net[i];
      if ((wires >> c.low & 1U) > (wires >> c.high & 1U))
        wires ^= 1U << c.low | 1U << c.high;
    }
    for (int k = 1; k < N; k++)
      ASSERT_LE (wires >> net.wire (k - 1) & 1U, wires >> net.wire (k) & 1U)
          << N << " wires, input " << input;
  }
}

TEST (Network, SortsByTheZeroOnePrincipleUpTo16Wires)
{
  []<int... I> (std::integer_sequence<int, I...>)
  {
    (expect_sorts_zeros_and_ones<I + 2> (), ...);
  }
  (std::make_integer_sequence<int, 15> ());
}

TEST (Network, IsAsSmallAsTheBestKnownWhereItMatters)
{
  EXPECT_EQ (Network<4>::sort ().size (), 5);
  EXPECT_EQ (Network<9>::sort ().size (), 25);
  EXPECT_EQ (Network<16>::sort ().size (), 60);
}

} // namespace
