/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Extraction compared with a plain copy of the frame, the sort of the paper and
 * libraries. Prints the tables of docs/performance.md: all of them without
 * arguments, else those that a regular expression over WIDTHxHEIGHT/DEPTH/N
 * selects; --target=NAME selects the instruction set. */
#include "../quality/must.h"
#include "extract/extractor.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <regex>
#include <string>

#include <benchmark/benchmark.h>
#ifdef HAVE_OPENCV
#include <opencv2/core.hpp>
#endif

#include "extract/planes.h"
#include "medians.h"

namespace
{

using namespace codedexposure;

/** Frames in flight at either side of an element, as buffer pools keep them. */
constexpr int kRing = 4;

struct Case {
  int width;
  int height;
  int depth;
  int columns;
  int rows;
  std::string_view target;

  int n () const { return columns * rows; }
  std::string name () const
  {
    return size () + "/u" + std::to_string (depth) + "/" +
           std::to_string (n ());
  }
  std::string size () const
  {
    return std::to_string (width) + "x" + std::to_string (height);
  }
  std::string tile () const
  {
    return std::to_string (columns) + "x" + std::to_string (rows);
  }
};

/** Coded frames of random pixels and the subframes that take them. */
template <typename Pixel>
class Pool
{
public:
  explicit Pool (const Case &c)
      : width_ (c.width / c.columns), height_ (c.height / c.rows)
  {
    std::mt19937_64 random (1);
    /* The default stride of a video buffer. */
    const std::size_t stride =
        (std::size_t (width_) * sizeof (Pixel) + 3) / 4 * 4;
    const std::size_t plane =
        (stride * std::size_t (height_) + 2 * 4096) / 4096 * 4096;
    for (int i = 0; i < kRing; i++) {
      coded_.emplace_back (c.width, c.height);
      auto view = coded_.back ().view ();
      for (int y = 0; y < c.height; y++)
        for (int x = 0; x < c.width; x++)
          view.at (x, y) =
              Pixel (random () % std::numeric_limits<Pixel>::max ());

      bytes_.emplace_back (plane * std::size_t (c.n ()) + 2 * 4096);
      auto *first = bytes_.back ().data ();
      first += 4096 - reinterpret_cast<std::uintptr_t> (first) % 4096;
      auto &planes = planes_.emplace_back ();
      for (int k = 0; k < c.n (); k++)
        planes.push_back (
            {reinterpret_cast<Pixel *> (
                 first + plane * std::size_t (k) + plane_stagger (k)),
                width_, height_, std::ptrdiff_t (stride)});
    }
  }

  void next () { at_ = (at_ + 1) % kRing; }
  const Image<Pixel> &coded () const { return coded_[at_]; }
  const std::vector<ImageView<Pixel>> &planes () const { return planes_[at_]; }
  int width () const { return width_; }
  int height () const { return height_; }

private:
  int width_;
  int height_;
  std::size_t at_ = 0;
  std::vector<Image<Pixel>> coded_;
  std::vector<std::vector<std::uint8_t>> bytes_;
  std::vector<std::vector<ImageView<Pixel>>> planes_;
};

template <typename Pixel>
using Body = std::function<void (Pool<Pixel> &)>;

template <typename Pixel>
void
copy (Pool<Pixel> &pool)
{
  const std::size_t bytes = std::size_t (pool.width ()) *
                            std::size_t (pool.height ()) * sizeof (Pixel);
  auto *from =
      reinterpret_cast<const std::uint8_t *> (pool.coded ().view ().data);
  for (const auto &plane : pool.planes ()) {
    std::memcpy (plane.data, from, bytes);
    from += bytes;
  }
}

template <typename Pixel>
Body<Pixel>
extraction (const Case &c, const std::string &code, ExtractOptions options,
    const std::string &tile = {})
{
  if (options.target.empty ())
    options.target = c.target;
  const auto fail = [] (const Error &error) {
    std::fprintf (stderr, "%s\n", error.message.c_str ());
    std::exit (1);
  };
  const auto schedule =
      Schedule::from_preset (code + ":" + (tile.empty () ? c.tile () : tile));
  if (!schedule)
    fail (schedule.error ());
  auto made = Extractor<Pixel>::make (*schedule, c.width, c.height, options);
  if (!made)
    fail (made.error ());
  const auto extractor = std::make_shared<Extractor<Pixel>> (std::move (*made));
  return [extractor] (Pool<Pixel> &pool) {
    quality::must (extractor->run (pool.coded ().view (), pool.planes ()));
  };
}

template <typename Pixel>
void
sort_groups (const Case &c, Pool<Pixel> &pool)
{
  std::vector<Pixel> group (std::size_t (c.n ()));
  const auto coded = pool.coded ().view ();
  for (int j = 0; j < pool.height (); j++)
    for (int i = 0; i < pool.width (); i++) {
      for (int y = 0; y < c.rows; y++)
        std::copy_n (coded.row (j * c.rows + y) + i * c.columns, c.columns,
            group.begin () + y * c.columns);
      std::ranges::sort (group);
      for (std::size_t k = 0; k < group.size (); k++)
        pool.planes ()[k].at (i, j) = group[k];
    }
}

#ifdef HAVE_OPENCV
template <typename Pixel>
constexpr int kCvDepth = sizeof (Pixel) == 1 ? CV_8U : CV_16U;

/** Every row of a cell is a row of pixels with as many channels as the cell is
 * wide. */
template <typename Pixel>
void
cv_split (const Case &c, Pool<Pixel> &pool)
{
  const auto coded = pool.coded ().view ();
  for (int y = 0; y < c.rows; y++) {
    const cv::Mat rows (pool.height (), pool.width (),
        CV_MAKETYPE (kCvDepth<Pixel>, c.columns),
        const_cast<Pixel *> (coded.row (y)),
        std::size_t (coded.stride * c.rows));
    std::vector<cv::Mat> planes;
    for (int x = 0; x < c.columns; x++) {
      const auto &plane = pool.planes ()[std::size_t (y * c.columns + x)];
      planes.emplace_back (plane.height, plane.width, kCvDepth<Pixel>,
          plane.data, std::size_t (plane.stride));
    }
    cv::split (rows, planes.data ());
  }
}

/** Groups as the rows of a matrix. */
template <typename Pixel>
void
cv_sort (const Case &c, Pool<Pixel> &pool)
{
  const auto coded = pool.coded ().view ();
  cv::Mat groups (pool.width (), c.n (), kCvDepth<Pixel>);
  for (int j = 0; j < pool.height (); j++) {
    for (int i = 0; i < pool.width (); i++)
      for (int y = 0; y < c.rows; y++)
        std::copy_n (coded.row (j * c.rows + y) + i * c.columns, c.columns,
            groups.ptr<Pixel> (i) + y * c.columns);
    cv::sort (groups, groups, cv::SORT_EVERY_ROW | cv::SORT_ASCENDING);
    for (int i = 0; i < pool.width (); i++)
      for (int k = 0; k < c.n (); k++)
        pool.planes ()[std::size_t (k)].at (i, j) = groups.at<Pixel> (i, k);
  }
}
#endif

/** Lattices with as many elements as the rasters of the table. */
const std::map<int, std::string> kLattices = {
    {4, "lattice:4/2"}, {9, "lattice:9/3"}, {16, "lattice:16/4"}};

template <typename Pixel>
std::vector<std::pair<std::string, Body<Pixel>>>
contenders (const Case &c)
{
  std::vector<std::pair<std::string, Body<Pixel>>> all = {
      {"memcpy", copy<Pixel>},
      {"select",
          extraction<Pixel> (c, "sequential", {.method = Method::kSelect})},
      {"decode", extraction<Pixel> (c, "staircase",
                     {.method = Method::kDecode, .interpolate = false})},
      {"decode, interpolated",
          extraction<Pixel> (c, "staircase", {.method = Method::kDecode})},
      {"decode, leakage",
          extraction<Pixel> (c, "sequential", {.method = Method::kDecode},
              c.tile () + ",leak=0.001")},
      {"rank", extraction<Pixel> (c, "staircase", {.method = Method::kRank})},
  };
  if (const auto lattice = kLattices.find (c.n ()); lattice != kLattices.end ())
    all.push_back (
        {"select, lattice", extraction<Pixel> (c, "sequential",
                                {.method = Method::kSelect}, lattice->second)});
  all.push_back ({"paper's quicksort",
      extraction<Pixel> (
          c, "staircase", {.method = Method::kRank, .target = "scalar"})});
  all.push_back (
      {"std::sort", [c] (Pool<Pixel> &pool) { sort_groups (c, pool); }});
#ifdef HAVE_OPENCV
  all.push_back ({"cv::sort", [c] (Pool<Pixel> &pool) { cv_sort (c, pool); }});
  all.push_back (
      {"cv::split", [c] (Pool<Pixel> &pool) { cv_split (c, pool); }});
#endif
  return all;
}

/** Ratios to memcpy by size, method, n and depth. */
class Summary
{
public:
  void add (const Case &c, const std::string &contender, double ratio)
  {
    if (std::ranges::find (contenders_, contender) == contenders_.end ())
      contenders_.push_back (contender);
    ratios_[c.size ()][contender][c.n ()][c.depth] = ratio;
  }
  void print () const
  {
    for (const auto &[size, rows] : ratios_) {
      std::printf ("\n%s, u8 / u16, of memcpy\n\n| | n = 4 | 9 | 16 | 81 | "
                   "256 |\n|---|---|---|---|---|---|\n",
          size.c_str ());
      for (const std::string &contender : contenders_)
        if (const auto row = rows.find (contender); row != rows.end ())
          print_row (contender, row->second);
    }
  }

private:
  using Row = std::map<int, std::map<int, double>>;

  static void print_row (const std::string &contender, const Row &row)
  {
    std::printf ("| %s |", contender.c_str ());
    for (const int n : {4, 9, 16, 81, 256}) {
      const auto both = row.find (n);
      const char *separator = " ";
      for (const int depth : {8, 16})
        if (both != row.end () && both->second.count (depth) > 0) {
          std::printf ("%s%.2f", separator, both->second.at (depth));
          separator = " / ";
        }
      std::printf (" |");
    }
    std::printf ("\n");
  }

  std::vector<std::string> contenders_;
  std::map<std::string, std::map<std::string, Row>> ratios_;
};

template <typename Pixel>
void
run_case (const Case &c, Summary &summary)
{
  Pool<Pixel> pool (c);
  const auto all = contenders<Pixel> (c);
  benchmark::ClearRegisteredBenchmarks ();
  for (const auto &[name, body] : all)
    benchmark::RegisterBenchmark (
        name.c_str (), [&pool, body = body] (benchmark::State &state) {
          for (auto _ : state) {
            body (pool);
            pool.next ();
          }
        });
  bench::Medians medians;
  benchmark::RunSpecifiedBenchmarks (&medians);

  const double bytes = double (c.width) * c.height * c.depth / 8;
  const double copied = medians.seconds ("memcpy");
  const double sorted = medians.seconds ("paper's quicksort");
  std::printf ("\n%s: memcpy %.1f us, %.1f GB/s\n\n", c.name ().c_str (),
      copied * 1e6, bytes / copied * 1e-9);
  std::printf ("| | us | of memcpy | of the paper's quicksort |\n");
  std::printf ("|---|---|---|---|\n");
  for (const auto &[name, body] : all) {
    const double seconds = medians.seconds (name);
    if (seconds <= 0.0)
      continue;
    std::printf ("| %s | %.1f | %.3f | %.1f |\n", name.c_str (), seconds * 1e6,
        copied / seconds, sorted / seconds);
    if (name != "memcpy" && copied / seconds >= 0.01)
      summary.add (c, name, copied / seconds);
  }
  std::fflush (stdout);
}

} // namespace

int
main (int argc, char **argv)
{
  auto arguments = bench::taking_turns (argv[0]);
  std::string picked = ".*";
  std::string_view target = extract_targets ().front ();
  for (int i = 1; i < argc; i++) {
    if (std::strncmp (argv[i], "--target=", 9) == 0)
      target = argv[i] + 9;
    else if (std::strncmp (argv[i], "--", 2) == 0)
      arguments.push_back (argv[i]);
    else
      picked = argv[i];
  }
  int count = int (arguments.size ());
  benchmark::Initialize (&count, const_cast<char **> (arguments.data ()));

  std::printf ("Extraction for %s, one thread, %d frames in the pools\n",
      std::string (target).c_str (), kRing);
  Summary summary;
  for (const auto &[width, height] :
      {std::pair (768, 576), {1920, 1080}, {4096, 3072}})
    for (const int depth : {8, 16})
      for (const auto &[columns, rows] :
          {std::pair (2, 2), {3, 3}, {4, 4}, {9, 9}, {16, 16}}) {
        const Case c = {width, height, depth, columns, rows, target};
        if (!std::regex_search (c.name (), std::regex (picked)))
          continue;
        if (depth == 8)
          run_case<std::uint8_t> (c, summary);
        else
          run_case<std::uint16_t> (c, summary);
      }
  summary.print ();
}
