/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Checks the figures in docs/quality.md and the statements on which they are
 * based. */
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>

#include <gtest/gtest.h>

#include "figures.h"
#include "footage.h"
#include "metrics.h"
#include "region_figures.h"
#include "trial.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::quality;

constexpr int kFrames = 32; // of the document

const std::vector<Scene> &
synthetic ()
{
  static const std::vector<Scene> scenes = {
      synthetic_scene (256, 192, kFrames)};
  return scenes;
}

const std::string &
document ()
{
  static const std::string text = [] {
    std::ifstream file (QUALITY_DOCUMENT);
    return std::string (std::istreambuf_iterator<char> (file), {});
  }();
  return text;
}

/* Within one unit of the last printed digit, or @units: the C library's sine
 * may differ. */
void
expect_same (const std::string &printed, const Cell &cell, int decimals,
    double units = 1.5)
{
  if (cell.is_text ())
    EXPECT_EQ (printed, cell.text);
  else if (!std::isfinite (cell.number))
    EXPECT_EQ (printed, std::isinf (cell.number) ? "exact" : "-");
  else
    EXPECT_NEAR (
        std::stod (printed), cell.number, units * std::pow (10.0, -decimals));
}

/* Rows of the document begin with the texts and numbers of @p table for its
 * first, synthetic scene, which is always available. */
void
expect_documented (const Table &table, double units = 1.5)
{
  SCOPED_TRACE (table.id);
  const auto printed = table_cells (document (), table.id);
  ASSERT_GE (printed.size (), table.rows.size ());
  for (std::size_t r = 0; r < table.rows.size (); r++) {
    SCOPED_TRACE (r);
    for (std::size_t c = 0; c < table.columns.size (); c++) {
      if (table.columns[c].title == "mean")
        continue; // over other scenes
      ASSERT_LT (c, printed[r].size ());
      expect_same (
          printed[r][c], table.rows[r][c], table.columns[c].decimals, units);
    }
  }
}

TEST (QualityDocument, SaysWhatTheMethodsDo)
{
  for (const Table &table : method_tables (synthetic (), [] (auto &) {}))
    expect_documented (table);
  expect_documented (mislabelled_table (synthetic (), [] (auto &) {}));
}

TEST (QualityDocument, SaysWhatLeakAndShiftCost)
{
  for (const Table &table : leak_tables (synthetic (), [] (auto &) {}))
    expect_documented (table);
  for (const Table &table : shift_tables (synthetic (), [] (auto &) {}))
    expect_documented (table);
}

TEST (QualityDocument, SaysWhatBordersOfRegionsCost)
{
  expect_documented (regions_table (synthetic (), [] (auto &) {}));
}

TEST (QualityDocument, SaysWhatAStillSceneAndAFlatGreyShow)
{
  expect_documented (still_table (synthetic ()));
  expect_documented (light_table ());
}

/* The clips are optional; see tests/quality/run. */
TEST (QualityDocument, AgreesWithTheIndependentCalculation)
{
  auto clips = read_clips (QUALITY_CLIPS, 8);
  if (!clips)
    GTEST_SKIP () << clips.error ().message;
  std::erase_if (*clips, [] (const Scene &scene) {
    return scene.name != "traffic48" && scene.name != "runner40";
  });
  if (clips->size () != 2)
    GTEST_SKIP () << "the clips traffic48 and runner40 are not there";

  const Table table = comparison_table (*clips);
  expect_documented (table);
  constexpr std::size_t kHere = 3, kThere = 5;
  for (const auto &row : table.rows) {
    SCOPED_TRACE (row[0].text + " " + row[1].text + " " + row[2].text);
    for (const std::size_t truth : {0, 1}) {
      const double here = row[kHere + truth].number;
      const double there = row[kThere + truth].number;
      if (std::isinf (there))
        EXPECT_TRUE (std::isinf (here));
      else
        EXPECT_NEAR (here, there, 0.06);
    }
  }
}

Way
way_of (const char *preset, Method method)
{
  Way way;
  way.schedule = schedule_of (preset);
  way.extract.method = method;
  return way;
}

TEST (Quality, SequentialSamplesAreExactWithoutNoise)
{
  for (const char *preset :
      {"sequential:2x2", "sequential:lattice:4/2", "sequential:lattice:8/3",
          "sequential:lattice:8/3,order=bit-reversal"}) {
    const Score score =
        score_scene (synthetic ()[0], way_of (preset, Method::kSelect), {});
    EXPECT_TRUE (std::isinf (score.point.psnr ())) << preset;
  }
}

/* Figs. 9c and 11c of the paper, for a static scene. */
TEST (Quality, RanksOfAStaircaseGrowBrighterAndRicherOnAStillScene)
{
  const Scene still = still_scene ("still", synthetic ()[0].frames[0], 4);
  const Way way = way_of ("staircase:2x2", Method::kRank);
  const auto subframes = split (take (still, way.schedule, {})[0], way);
  const double first = mean_of (subframes[0].view ());
  for (std::size_t k = 1; k < 4; k++) {
    EXPECT_NEAR (
        mean_of (subframes[k].view ()) / first, double (k + 1), 0.05 * (k + 1));
    EXPECT_GT (entropy_of (subframes[k].view ()),
        entropy_of (subframes[k - 1].view ()) + 0.2);
  }
}

TEST (Quality, DecodeBeatsRankAndSequentialBeatsBoth)
{
  const Condition noisy = {.electrons = 10000.0, .read_noise = 5.0};
  const auto psnr = [&] (const char *preset, Method method) {
    return score_scene (synthetic ()[0], way_of (preset, method), noisy)
        .point.psnr ();
  };
  const double rank = psnr ("staircase:2x2", Method::kRank);
  const double decode = psnr ("staircase:2x2", Method::kDecode);
  const double sequential = psnr ("sequential:2x2", Method::kSelect);
  EXPECT_GT (decode, rank + 5.0);
  EXPECT_GT (sequential, decode + 5.0);
}

TEST (Quality, InterpolationBeforeDecodingPays)
{
  Way interpolated = way_of ("staircase:2x2", Method::kDecode);
  Way in_place = interpolated;
  in_place.extract.interpolate = false;
  const Scene &scene = synthetic ()[0];
  EXPECT_GT (score_scene (scene, interpolated, {}).cell.psnr (),
      score_scene (scene, in_place, {}).cell.psnr () + 3.0);
  EXPECT_GT (score_scene (scene, interpolated, {}).point.psnr (),
      score_scene (scene, in_place, {}).point.psnr () + 3.0);
}

TEST (Quality, KnownLeakCostsNothing)
{
  const Way known = way_of ("sequential:2x2,leak=0.01", Method::kAuto);
  Way ignored = known;
  ignored.believed = schedule_of ("sequential:2x2");
  const Scene &scene = synthetic ()[0];
  EXPECT_GT (score_scene (scene, known, {}).point.psnr (), 45.0);
  EXPECT_LT (score_scene (scene, ignored, {.gain = 4.0}).point.psnr (), 40.0);
}

TEST (Quality, SameSeedSameFrames)
{
  const Condition noisy = {.electrons = 10000.0, .read_noise = 5.0};
  const Schedule schedule;
  EXPECT_EQ (take (synthetic ()[0], schedule, noisy),
      take (synthetic ()[0], schedule, noisy));
}

} // namespace
