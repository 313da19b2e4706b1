/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Extraction: exact samples, decoding within its quantisation bound, ordered
 * ranks. */
#include "extract/extractor.h"

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "extract/decoder.h"
#include "extract/group_sort.h"
#include "extract/linear.h"
#include "schedule/sample_grid.h"

namespace
{

using namespace codedexposure;
using Scene = std::function<double (int x, int y, int slot)>;

Schedule
preset (std::string_view text)
{
  auto schedule = Schedule::from_preset (text);
  EXPECT_TRUE (schedule) << text << ": "
                         << (schedule ? "" : schedule.error ().message);
  return schedule ? *schedule : Schedule ();
}

/** The coded frame of a scene: white in the slots of the brightest element is
 * the largest value; pixels are rounded and clamped. */
template <typename Pixel>
Image<Pixel>
expose (const Schedule &schedule, int width, int height, const Scene &scene)
{
  const Code &code = schedule.code ();
  const double white = std::numeric_limits<Pixel>::max ();
  Image<Pixel> coded (width, height);
  for (int y = 0; y < height; y++) {
    for (int x = 0; x < width; x++) {
      double light = 0.0;
      for (int s = 0; s < code.slots (); s++)
        light +=
            scene (x, y, s) *
            (code.on (schedule.element_at (x, y), s) ? 1.0 : schedule.leak ());
      coded.at (x, y) = Pixel (std::clamp (
          std::round (light / schedule.white_slots ()), 0.0, white));
    }
  }
  return coded;
}

template <typename Pixel>
struct Extracted {
  std::vector<Image<Pixel>> subframes;
  ExtractReport report;
};

template <typename Pixel>
Extracted<Pixel>
extract (const Schedule &schedule, const Image<Pixel> &coded,
    const ExtractOptions &options = {})
{
  const auto extractor = Extractor<Pixel>::make (
      schedule, coded.width (), coded.height (), options);
  if (!extractor) {
    ADD_FAILURE () << extractor.error ().message;
    return {};
  }
  Extracted<Pixel> out;
  std::vector<ImageView<Pixel>> views;
  const Extent size = extractor->subframe_size ();
  for (int k = 0; k < extractor->subframes (); k++)
    out.subframes.emplace_back (size.width, size.height);
  for (auto &subframe : out.subframes)
    views.push_back (subframe.view ());
  out.report = extractor->run (coded.view (), views).value ();
  return out;
}

std::string
refusal (
    const ExtractOptions &options, std::string_view text = "sequential:2x2")
{
  const auto made =
      Extractor<std::uint8_t>::make (preset (text), 8, 8, options);
  return made ? "" : made.error ().message;
}

/** Half a step from each coded pixel and half from the result. */
double
quantisation_bound (const Schedule &schedule)
{
  const auto decoder = Decoder::make (schedule, 0.0, false);
  double bound = 0.0;
  for (int s = 0; s < schedule.slots (); s++) {
    double sum = 0.0;
    for (const Term &term : decoder->terms (s))
      sum += std::abs (term.factor);
    bound = std::max (bound, sum / 2 + 0.5);
  }
  return bound + 1e-6;
}

TEST (Extract, SequentialSelectGivesEveryCodedPixelOnce)
{
  for (const char *text :
      {"sequential:2x2", "sequential:3x2,phase=1/1", "sequential:lattice:4/2",
          "sequential:lattice:8/3,order=bit-reversal", "sequential:lattice:5/2",
          "sequential:diamond:13"}) {
    SCOPED_TRACE (text);
    const Schedule schedule = preset (text);
    const SampleGrid grid (schedule);
    Image<std::uint16_t> coded (53, 31);
    std::uint16_t next = 0;
    for (int y = 0; y < 31; y++)
      for (int x = 0; x < 53; x++)
        coded.at (x, y) = next++;

    const auto out = extract (schedule, coded);
    const Extent cell = grid.cell ();
    ASSERT_EQ (int (out.subframes.size ()), schedule.elements ());
    for (int k = 0; k < schedule.elements (); k++) {
      const auto &subframe = out.subframes[std::size_t (k)];
      ASSERT_EQ (subframe.width (), 53 / cell.width);
      ASSERT_EQ (subframe.height (), 31 / cell.height);
      for (int j = 0; j < subframe.height (); j++) {
        for (int i = 0; i < subframe.width (); i++) {
          const int x = subframe.at (i, j) % 53, y = subframe.at (i, j) / 53;
          ASSERT_EQ (x / cell.width, i);
          ASSERT_EQ (y / cell.height, j);
          ASSERT_EQ (schedule.element_at (x, y), k);
        }
      }
    }
  }
}

TEST (Extract, SelectFollowsTheSlotsOfAPermutedCode)
{
  auto code = Code::from_rows ({"0010", "1000", "0001", "0100"});
  auto schedule = Schedule::make ({*Tile::raster (2, 2), *code});
  const auto coded = expose<std::uint8_t> (
      *schedule, 8, 8, [] (int, int, int slot) { return 10.0 * (slot + 1); });
  const auto out = extract (*schedule, coded);
  for (int k = 0; k < 4; k++)
    EXPECT_EQ (out.subframes[std::size_t (k)].at (1, 1), 10 * (k + 1));
}

TEST (Extract, DecodeGivesTheLightOfEverySlotWithinTheQuantisationBound)
{
  for (const char *text :
      {"staircase:2x2", "staircase:3x3,phase=1/2", "staircase:16x16",
          "staircase:lattice:8/3", "s-matrix:4x4", "staircase:4x2,leak=0.01",
          "s-matrix:7x1,leak=0.02", "sequential:2x2,leak=0.05"}) {
    SCOPED_TRACE (text);
    const Schedule schedule = preset (text);
    const double bound = quantisation_bound (schedule);
    const int n = schedule.slots ();
    const auto light = [n] (int, int, int slot) {
      return 20000.0 + 37000.0 * ((slot * 7) % n) / n;
    };
    const auto out =
        extract (schedule, expose<std::uint16_t> (schedule, 64, 64, light),
            {.method = Method::kDecode});
    for (int k = 0; k < n; k++)
      for (const int at : {0, 1})
        ASSERT_NEAR (
            out.subframes[std::size_t (k)].at (at, at), light (0, 0, k), bound);
  }
}

TEST (Extract, DecodeInterpolatesALinearSceneToTheCentreOfTheCell)
{
  for (const char *text : {"staircase:2x2", "staircase:3x3", "staircase:4x2",
           "staircase:4x4,phase=3/1", "s-matrix:4x2"}) {
    SCOPED_TRACE (text);
    const Schedule schedule = preset (text);
    const Extent cell = schedule.cell ();
    const auto ramp = [] (double x, double y) {
      return 1000.0 + 500.0 * x + 700.0 * y;
    };
    const auto out = extract (schedule,
        expose<std::uint16_t> (
            schedule, 48, 48, [&] (int x, int y, int) { return ramp (x, y); }),
        {.method = Method::kDecode});
    for (const auto &subframe : out.subframes)
      for (int j = 1; j < subframe.height () - 1; j++)
        for (int i = 1; i < subframe.width () - 1; i++)
          ASSERT_NEAR (subframe.at (i, j),
              ramp (i * cell.width + (cell.width - 1) / 2.0,
                  j * cell.height + (cell.height - 1) / 2.0),
              quantisation_bound (schedule));
  }
}

TEST (Extract, DecodeEqualsSumsInDoubles)
{
  std::mt19937 random (3);
  for (const char *text : {"staircase:2x2", "staircase:16x16", "s-matrix:7x1",
           "staircase:3x3,leak=0.02", "sequential:2x2,leak=0.001",
           "sequential:4x4,leak=0.001", "sequential:9x9,leak=0.05"})
    for (const bool interpolate : {false, true})
      for (const int white : {255, 65535})
        for (const double gain : {0.0, 0.5, 1.7}) {
          SCOPED_TRACE (std::string (text) + " " + std::to_string (white));
          const auto decoder = Decoder::make (preset (text), gain, interpolate);
          const LinearPlan plan (*decoder, white, white);
          const Linear &linear = plan.linear ();
          const bool exact =
              !linear.has_fractions || linear.numbers == Numbers::kDouble;
          const int n = decoder->slots ();
          const int most = white * (decoder->interpolates () ? 4 * n : 1);
          std::vector<int> values (std::size_t (n), 0);
          for (int i = 0; i < 100; i++) {
            for (int s = 0; s < n; s++) {
              double light = 0.0;
              for (const Term &term : decoder->terms (s))
                light += term.factor * values[std::size_t (term.element)];
              light = std::clamp (light, -0.5, white + 0.5);
              ASSERT_NEAR (linear.pixel (s, values.data ()), light,
                  exact ? 0.500001 : 0.52);
            }
            for (int &value : values)
              value = i % 9 == 0 ? most : int (random () % unsigned (most + 1));
          }
        }
}

TEST (Extract, LeakageIsDecodedInWholeNumbersAndFloats)
{
  for (const char *text :
      {"sequential:2x2,leak=0.001", "sequential:3x3,leak=0.001",
          "sequential:4x4,leak=0.001", "sequential:4x4,leak=0.02"}) {
    SCOPED_TRACE (text);
    const auto decoder = Decoder::make (preset (text), 0.0, true);
    const LinearPlan bytes (*decoder, 255, 255), words (*decoder, 65535, 4095);
    EXPECT_EQ (bytes.linear ().numbers, Numbers::kShort);
    EXPECT_EQ (words.linear ().numbers, Numbers::kInt);
    EXPECT_TRUE (bytes.linear ().is_one_hot);
    EXPECT_TRUE (words.linear ().is_one_hot);
  }
}

TEST (Extract, DecodeRestoresBrightnessAndClampsNoise)
{
  const Schedule schedule = preset ("staircase:2x2");
  Image<std::uint8_t> coded (4, 4);
  const int pixels[2][2] = {{10, 9}, {30, 200}};
  for (int y = 0; y < 4; y++)
    for (int x = 0; x < 4; x++)
      coded.at (x, y) = std::uint8_t (pixels[y % 2][x % 2]);

  const auto plain = extract (schedule, coded, {.interpolate = false});
  EXPECT_EQ (plain.subframes[0].at (0, 0), 40);
  EXPECT_EQ (plain.subframes[1].at (0, 0), 0);
  EXPECT_EQ (plain.subframes[2].at (0, 0), 84);
  EXPECT_EQ (plain.subframes[3].at (0, 0), 255);

  const auto weak =
      extract (schedule, coded, {.gain = 0.5, .bits = 6, .interpolate = false});
  EXPECT_EQ (weak.subframes[0].at (0, 0), 5);
  EXPECT_EQ (weak.subframes[2].at (0, 0), 11); /* 10.5 rounds up */
  EXPECT_EQ (weak.subframes[3].at (0, 0), 63);
}

TEST (Extract, AGainThatIsTooSmallGivesBlack)
{
  const auto light = [] (int, int, int) { return 1.0; };
  for (const char *text : {"staircase:2x2", "staircase:3x2,leak=0.01"})
    for (const double gain : {1e-10, 5e-324})
      for (const bool interpolate : {false, true}) {
        const Schedule schedule = preset (text);
        const auto out =
            extract (schedule, expose<std::uint8_t> (schedule, 60, 60, light),
                {.method = Method::kDecode,
                    .gain = gain,
                    .interpolate = interpolate});
        for (const auto &subframe : out.subframes)
          EXPECT_EQ (subframe.at (3, 3), 0) << text << " " << gain;
      }
}

TEST (Extract, RankIsMonotonicAndKeepsTheGroup)
{
  std::mt19937 random (1);
  for (const char *text : {"staircase:2x2", "staircase:9x9", "staircase:16x16",
           "staircase:lattice:8/3"}) {
    SCOPED_TRACE (text);
    const Schedule schedule = preset (text);
    Image<std::uint8_t> coded (50, 50);
    std::uint64_t sum_in = 0, sum_out = 0;
    const Extent cell = schedule.cell ();
    for (int y = 0; y < 50; y++)
      for (int x = 0; x < 50; x++) {
        coded.at (x, y) = std::uint8_t (random ());
        if (x < 50 / cell.width * cell.width &&
            y < 50 / cell.height * cell.height)
          sum_in += coded.at (x, y);
      }
    const auto out = extract (schedule, coded, {.method = Method::kRank});
    for (std::size_t k = 0; k < out.subframes.size (); k++)
      for (int j = 0; j < out.subframes[k].height (); j++)
        for (int i = 0; i < out.subframes[k].width (); i++) {
          sum_out += out.subframes[k].at (i, j);
          const auto &below = out.subframes[k > 0 ? k - 1 : 0];
          ASSERT_GE (out.subframes[k].at (i, j), below.at (i, j));
        }
    EXPECT_EQ (sum_in, sum_out);
  }
}

TEST (Extract, SaturatedPixelsOfTheCellsAreCounted)
{
  Image<std::uint16_t> coded (5, 5);
  coded.at (0, 0) = 1023;
  coded.at (3, 3) = 2000;
  coded.at (2, 1) = 1022;
  coded.at (4, 4) = 1023; /* outside the cells */
  for (const Method method : {Method::kRank, Method::kSelect, Method::kDecode})
    EXPECT_EQ (extract (preset ("staircase:2x2"), coded,
                   {.method = method, .bits = 10})
                   .report.saturated,
        2U);
}

TEST (Extract, AutoTakesTheCheapestMethodThatIsRight)
{
  const auto method = [] (std::string_view text) {
    return Extractor<std::uint8_t>::make (preset (text), 64, 64)->method ();
  };
  EXPECT_EQ (method ("sequential:2x2"), Method::kSelect);
  EXPECT_EQ (method ("sequential:2x2,leak=0.01"), Method::kDecode);
  EXPECT_EQ (method ("staircase:2x2"), Method::kDecode);
  EXPECT_EQ (method ("s-matrix:4x4"), Method::kDecode);

  auto singular = Code::from_rows ({"1100", "1100", "0011", "0011"});
  auto schedule = Schedule::make ({*Tile::raster (2, 2), *singular});
  EXPECT_EQ (Extractor<std::uint8_t>::make (*schedule, 64, 64)->method (),
      Method::kRank);
  EXPECT_FALSE (Extractor<std::uint8_t>::make (
      *schedule, 64, 64, {.method = Method::kDecode}));
}

TEST (Extract, WhatCannotBeIsRefusedByNameRuleAndRemedy)
{
  EXPECT_NE (refusal ({.bits = 9}).find ("bits 9"), std::string::npos);
  EXPECT_NE (refusal ({.gain = -1.0}).find ("gain -1"), std::string::npos);
  EXPECT_NE (refusal ({.gain = NAN}).find ("gain"), std::string::npos);
  EXPECT_NE (refusal ({.gain = 1e308}).find ("gain 1e+308"), std::string::npos);
  EXPECT_NE (refusal ({.target = "z80"}).find ("'z80'"), std::string::npos);
  EXPECT_NE (refusal ({}, "sequential:16x16").find ("no cell of 16x16"),
      std::string::npos);
  EXPECT_EQ (method_name (Method::kDecode), "decode");
}

TEST (GroupSort, SortsWhatIsRandomOrderedAndEqual)
{
  std::mt19937 random (2);
  for (std::size_t n = 0; n <= 300; n++) {
    for (const unsigned values : {1U, 2U, 5U, 256U, 65536U}) {
      std::vector<unsigned> group (n);
      for (auto &value : group)
        value = random () % values;
      auto truth = group;
      std::ranges::sort (truth);
      for (int pass = 0; pass < 2; pass++) {
        group_sort (std::span (group));
        ASSERT_EQ (group, truth) << n << " of " << values;
        std::ranges::reverse (group);
      }
    }
  }
}

} // namespace
