/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Every instruction set of this machine gives the pixels of the scalar
 * reference, bit for bit, writes no other bytes, and reads none. */
#include "extract/extractor.h"

#include <algorithm>
#include <functional>
#include <random>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "extract/network.h"

namespace
{

using namespace codedexposure;

/** A copy of a frame that has no memory right before its first pixel or right
 * after its last one, so that reading there ends the test. */
template <typename Pixel>
class Walled
{
public:
  enum class Wall { kBefore, kAfter };

  Walled (ImageView<const Pixel> frame, Wall wall)
      : page_ (std::size_t (sysconf (_SC_PAGESIZE)))
  {
    const std::size_t size = std::size_t (frame.stride * (frame.height - 1)) +
                             std::size_t (frame.width) * sizeof (Pixel);
    pages_ = (size + page_ - 1) / page_ * page_;
    auto *const first =
        static_cast<std::uint8_t *> (mmap (nullptr, pages_ + 2 * page_,
            PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
    all_ = first;
    mprotect (first, page_, PROT_NONE);
    mprotect (first + page_ + pages_, page_, PROT_NONE);
    auto *const data =
        first + page_ + (wall == Wall::kAfter ? pages_ - size : 0);
    view_ = {reinterpret_cast<Pixel *> (data), frame.width, frame.height,
        frame.stride};
    for (int y = 0; y < frame.height; y++)
      std::copy_n (frame.row (y), frame.width, view_.row (y));
  }
  Walled (const Walled &) = delete;
  Walled &operator= (const Walled &) = delete;
  ~Walled () { munmap (all_, pages_ + 2 * page_); }

  ImageView<const Pixel> view () const { return view_; }

private:
  std::size_t page_;
  std::size_t pages_;
  void *all_;
  ImageView<Pixel> view_;
};

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
  using Wall = typename Walled<Pixel>::Wall;
  const Walled<Pixel> after (frame, Wall::kAfter);
  const Walled<Pixel> before (frame, Wall::kBefore);
  const auto truth = run (*schedule, frame, c.options, "scalar", 0, 0);
  for (const auto target : extract_targets ())
    for (const auto &walled : {after.view (), before.view ()}) {
      SCOPED_TRACE (std::string (c.schedule) + " " +
                    std::string (method_name (c.options.method)) + " " +
                    content.name + " " + std::string (target) + " " +
                    std::to_string (width) + "x" + std::to_string (height) +
                    " of " + std::to_string (sizeof (Pixel)) + " bytes");
      const auto got =
          run (*schedule, walled, c.options, target, offset, padding);
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
      {"staircase:6x5", {.method = Method::kDecode}},
      {"staircase:8x8", {.method = Method::kDecode, .gain = 0.3}},
      {"staircase:2x2,leak=0.01", {.method = Method::kDecode}},
      {"staircase:3x3,leak=0.01",
          {.method = Method::kDecode, .interpolate = false}},
      {"sequential:2x2,leak=0.01", {.method = Method::kDecode}},
      {"sequential:3x3,leak=0.001", {.method = Method::kDecode, .bits = 7}},
      {"sequential:4x4,leak=0.001", {.method = Method::kDecode}},
      {"sequential:2x2,leak=0.3", {.method = Method::kDecode}},
      {"sequential:16x16,leak=0.0001", {.method = Method::kDecode}},
      {"sequential:lattice:8/3,leak=0.001", {.method = Method::kDecode}},
      {"sequential:2x2,phase=1/1,leak=0.05", {.method = Method::kDecode}},
      {"sequential:3x3,order=bit-reversal,leak=0.01",
          {.method = Method::kDecode}},
      {"sequential:4x4,phase=3/2,leak=0.02", {.method = Method::kDecode}},
      {"sequential:5x5,leak=0.001", {.method = Method::kDecode}},
      {"sequential:4x2,leak=0.001", {.method = Method::kDecode}},
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
      {"sequential:2x2,leak=0.001", {.method = Method::kDecode}},
      {"sequential:3x3,leak=0.001", {.method = Method::kDecode}},
      {"sequential:4x4,leak=0.001", {.method = Method::kDecode}},
      {"staircase:3x3", {.method = Method::kRank}},
      {"staircase:5x5", {.method = Method::kRank}},
  };
  for (const Case &c : cases)
    for (int columns = 1; columns <= 200; columns++)
      expect_equal<TypeParam> (c, contents ()[0], columns, 2);
}

TYPED_TEST (Kernels, EqualTheReferenceForEveryWidthOfCells)
{
  for (int width = 2; width <= 20; width++)
    for (const auto &[code, method] :
        {std::pair ("sequential:", Method::kSelect),
            {"staircase:", Method::kRank}, {"staircase:", Method::kDecode}})
      for (const int columns : {17, 40, 64, 67}) {
        const std::string schedule = code + std::to_string (width) + "x2";
        expect_equal<TypeParam> (
            {schedule.c_str (), {.method = method, .interpolate = false}},
            contents ()[0], columns, 2);
      }
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
  expect_equal<TypeParam> (
      {"sequential:4x4,leak=0.001", {.method = Method::kDecode}},
      contents ()[0], 601, 900 / int (sizeof (TypeParam)));
}

/** 0-1 principle (Knuth, The Art of Computer Programming 3, 5.3.4): a network
 * that sorts all sequences of zeros and ones sorts everything. */
TEST (MergeExchange, SortsByTheZeroOnePrincipleUpTo16Wires)
{
  for (int n = 1; n <= 16; n++) {
    int comparators = 0;
    for (unsigned input = 0; input < 1U << n; input++) {
      unsigned wires = input;
      comparators = 0;
      merge_exchange (n, [&] (int low, int high) {
        comparators++;
        if ((wires >> low & 1U) > (wires >> high & 1U))
          wires ^= 1U << low | 1U << high;
      });
      for (int k = 1; k < n; k++)
        ASSERT_LE (wires >> (k - 1) & 1U, wires >> k & 1U)
            << n << " wires, input " << input;
    }
    EXPECT_LE (comparators, 63) << n;
  }
}

} // namespace
