/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The tables of docs/quality.md. */
#include "figures.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "trial.h"

namespace codedexposure::quality
{

namespace
{

constexpr Condition kClean = {};
/* The light of an ordinary exposure that just fills the wells. */
constexpr Condition kNoisy = {.electrons = 10000.0, .read_noise = 5.0};

constexpr ExtractOptions kRank = {.method = Method::kRank};
constexpr ExtractOptions kSelect = {.method = Method::kSelect};
constexpr ExtractOptions kDecode = {.method = Method::kDecode};
constexpr ExtractOptions kDecodeInPlace = {
    .method = Method::kDecode, .interpolate = false};

Way
way_of (const std::string &preset, std::string label,
    const ExtractOptions &extract, Reading reading = Reading::kAsShown)
{
  return {std::move (label), schedule_of (preset), extract, reading};
}

std::vector<Way>
staircase_ways (const std::string &preset)
{
  return {
      way_of (preset, "rank, as shown", kRank),
      way_of (preset, "rank, normalised", kRank, Reading::kNormalised),
      way_of (preset, "rank, differences", kRank, Reading::kDifference),
      way_of (preset, "select, normalised", kSelect, Reading::kNormalised),
      way_of (preset, "decode in place", kDecodeInPlace),
      way_of (preset, "decode", kDecode),
  };
}

std::vector<Way>
all_ways ()
{
  std::vector<Way> ways = staircase_ways ("staircase:2x2");
  ways.push_back (way_of ("sequential:2x2", "rank", kRank));
  ways.push_back (way_of ("sequential:2x2", "select", kSelect));
  ways.push_back (way_of ("sequential:lattice:4/2", "select", kSelect));
  std::ranges::move (
      staircase_ways ("staircase:4x2"), std::back_inserter (ways));
  ways.push_back (way_of ("sequential:4x2", "select", kSelect));
  ways.push_back (way_of ("sequential:lattice:8/3", "select", kSelect));
  return ways;
}

/* A row of a table over scenes. */
struct Run {
  std::vector<Cell> labels;
  Way way;
  Condition condition;
};

/* One figure of a score, and the table it makes. */
struct Figure {
  std::string id;
  std::string title;
  double (*of) (const Score &score);
};

double
point_of (const Score &score)
{
  return score.point.psnr ();
}

double
cell_of (const Score &score)
{
  return score.cell.psnr ();
}

double
full_of (const Score &score)
{
  return score.full.psnr ();
}

double
mislabelled_of (const Score &score)
{
  return 100.0 * double (score.mislabelled) / double (score.pixels);
}

const std::string kPointTitle =
    "PSNR (dB) of subframes against the scene at the element's place";
const std::string kCellTitle =
    "PSNR (dB) of subframes against the mean of the cell";
const std::string kFullTitle =
    "PSNR (dB) of full-size frames, subframes interpolated linearly";

/* Not a number if only some scenes are exact. */
double
mean_over_scenes (const std::vector<double> &figures)
{
  double sum = 0.0;
  for (const double figure : figures)
    sum += figure;
  const bool some_exact =
      std::isinf (sum) && !std::ranges::all_of (figures, [] (double figure) {
        return std::isinf (figure);
      });
  return some_exact ? std::numeric_limits<double>::quiet_NaN ()
                    : sum / double (figures.size ());
}

std::vector<Table>
tables_over_scenes (const std::vector<std::string> &label_titles,
    const std::vector<Run> &runs, const std::vector<Figure> &figures,
    const std::vector<Scene> &scenes, const Progress &progress)
{
  std::vector<Table> tables;
  for (const Figure &figure : figures) {
    Table &table = tables.emplace_back (figure.id, figure.title);
    for (const std::string &title : label_titles)
      table.columns.push_back ({title});
    for (const Scene &scene : scenes)
      table.columns.push_back ({scene.name});
    table.columns.push_back ({"mean"});
  }
  for (const Run &run : runs) {
    progress (run.way.schedule.text () + " " + run.way.label);
    std::vector<Score> scores;
    for (const Scene &scene : scenes)
      scores.push_back (score_scene (scene, run.way, run.condition));
    for (std::size_t f = 0; f < figures.size (); f++) {
      std::vector<double> numbers;
      std::ranges::transform (
          scores, std::back_inserter (numbers), figures[f].of);
      auto &row = tables[f].rows.emplace_back (run.labels);
      row.insert (row.end (), numbers.begin (), numbers.end ());
      row.push_back (mean_over_scenes (numbers));
    }
  }
  return tables;
}

} // namespace

std::vector<Table>
method_tables (const std::vector<Scene> &scenes, const Progress &progress)
{
  std::vector<Table> tables;
  for (const bool noisy : {false, true}) {
    std::vector<Run> runs;
    for (Way &way : all_ways ()) {
      const std::vector<Cell> labels = {way.schedule.text (), way.label};
      runs.push_back ({labels, std::move (way), noisy ? kNoisy : kClean});
    }
    const std::string id = noisy ? "-noisy" : "-clean";
    const std::string title = noisy ? ", noisy" : ", clean";
    std::ranges::move (tables_over_scenes ({"schedule", "method"}, runs,
                           {{"point" + id, kPointTitle + title, point_of},
                               {"cell" + id, kCellTitle + title, cell_of},
                               {"full" + id, kFullTitle + title, full_of}},
                           scenes, progress),
        std::back_inserter (tables));
  }
  return tables;
}

Table
mislabelled_table (const std::vector<Scene> &scenes, const Progress &progress)
{
  std::vector<Run> runs;
  for (const char *preset :
      {"staircase:2x2", "staircase:4x2", "sequential:2x2"}) {
    runs.push_back ({{preset, "clean"}, way_of (preset, "", kRank), kClean});
    runs.push_back ({{preset, "noisy"}, way_of (preset, "", kRank), kNoisy});
  }
  return tables_over_scenes ({"schedule", "condition"}, runs,
      {{"mislabelled", "Pixels (%) whose rank is not their slot",
          mislabelled_of}},
      scenes, progress)[0];
}

std::vector<Table>
leak_tables (const std::vector<Scene> &scenes, const Progress &progress)
{
  std::vector<Run> runs;
  for (const std::string preset :
      {"sequential:2x2", "sequential:lattice:8/3", "staircase:2x2"}) {
    const Schedule tight = schedule_of (preset);
    const Schedule leaky = schedule_of (preset + ",leak=0.01");
    const double tight_gain =
        double (tight.slots ()) / tight.code ().max_on_slots ();
    Way believing_tight = {"", leaky};
    believing_tight.believed = tight;
    runs.push_back ({{preset, "none"}, {"", tight}, kClean});
    runs.push_back (
        {{preset, "1 %, ignored"}, believing_tight, {.gain = tight_gain}});
    runs.push_back ({{preset, "1 %, camera gain"}, believing_tight, kClean});
    runs.push_back ({{preset, "1 %, decoded"}, {"", leaky}, kClean});
  }
  return tables_over_scenes ({"schedule", "leak"}, runs,
      {{"leak-point", kPointTitle + ", clean", point_of},
          {"leak-full", kFullTitle + ", clean", full_of}},
      scenes, progress);
}

std::vector<Table>
shift_tables (const std::vector<Scene> &scenes, const Progress &progress)
{
  std::vector<Run> runs;
  for (const char *preset :
      {"sequential:2x2", "sequential:lattice:8/3", "staircase:2x2"}) {
    for (const char *shift : {"0", "0.05", "0.1", "0.2"})
      runs.push_back ({{preset, std::string (shift) + " px"},
          {"", schedule_of (preset)}, {.shift = std::strtod (shift, nullptr)}});
  }
  return tables_over_scenes ({"schedule", "shift"}, runs,
      {{"shift-point", kPointTitle + ", clean", point_of},
          {"shift-full", kFullTitle + ", clean", full_of}},
      scenes, progress);
}

namespace
{

/* PSNR of one method at one n and condition, against both truths, as an
 * independent calculation in floating point found it: on the two clips that
 * people have at hand, and on all six of that benchmark. */
struct Reference {
  int n;
  bool noisy;
  const char *method;
  double point_two, cell_two;
  double point_six, cell_six;
};

constexpr double kExact = std::numeric_limits<double>::infinity ();
constexpr double kNone = std::numeric_limits<double>::quiet_NaN ();

constexpr Reference kReferences[] = {
    {4, false, "sequential, select", kExact, 27.73, kExact, 29.3},
    {4, false, "decode in place", 22.06, 20.07, 23.6, 21.7},
    {4, false, "select, normalised", 27.01, 25.07, 29.0, 27.1},
    {4, false, "rank, differences", 22.32, 20.70, 23.7, 22.4},
    {4, false, "rank, normalised", 26.63, 25.35, 27.8, 27.6},
    {4, false, "rank, as shown", 14.29, 14.32, kNone, 13.7},
    {4, true, "sequential, select", 38.42, 27.32, 38.2, 28.5},
    {4, true, "decode in place", 21.67, 19.82, 22.9, 21.2},
    {4, true, "select, normalised", 26.77, 24.94, 28.5, 26.7},
    {4, true, "rank, differences", 21.91, 20.43, 22.9, 21.9},
    {4, true, "rank, normalised", 26.40, 25.21, 27.4, 27.2},
    {4, true, "rank, as shown", 14.28, 14.32, kNone, 13.7},
    {8, false, "sequential, select", kExact, 25.06, kExact, 26.7},
    {8, false, "decode in place", 18.15, 16.83, 19.6, 18.2},
    {8, false, "select, normalised", 23.39, 22.39, 25.6, 24.6},
    {8, false, "rank, differences", 18.45, 17.79, 20.0, 19.3},
    {8, false, "rank, normalised", 22.80, 22.87, 24.6, 25.4},
    {8, false, "rank, as shown", 13.12, 13.29, kNone, 12.7},
    {8, true, "sequential, select", 35.35, 24.60, 35.1, 25.8},
    {8, true, "decode in place", 17.62, 16.43, 18.6, 17.5},
    {8, true, "select, normalised", 23.25, 22.29, 25.3, 24.4},
    {8, true, "rank, differences", 17.90, 17.33, 18.9, 18.4},
    {8, true, "rank, normalised", 22.68, 22.76, 24.3, 25.1},
    {8, true, "rank, as shown", 13.12, 13.29, kNone, 12.7},
};

Way
way_of (const Reference &reference)
{
  const std::string tile = reference.n == 4 ? "2x2" : "4x2";
  const std::string label = reference.method;
  for (Way &way : staircase_ways ("staircase:" + tile)) {
    if (way.label == label)
      return std::move (way);
  }
  return way_of ("sequential:" + tile, label, kSelect);
}

/* Mean over the coded frames in the first 8 slots of every scene. */
std::vector<Cell>
mean_of_frames (const std::vector<Scene> &scenes, const Reference &reference)
{
  const Way way = way_of (reference);
  std::vector<double> points, cells;
  for (const Scene &scene : scenes) {
    const Scene start = {
        scene.name, {scene.frames.begin (), scene.frames.begin () + 8}};
    for (const Score &score :
        score_frames (start, way, reference.noisy ? kNoisy : kClean)) {
      points.push_back (score.point.psnr ());
      cells.push_back (score.cell.psnr ());
    }
  }
  return {mean_over_scenes (points), mean_over_scenes (cells)};
}

} // namespace

Table
comparison_table (const std::vector<Scene> &scenes)
{
  Table table{"comparison",
      "PSNR (dB) against the element's place / the mean of the cell: here, "
      "in an independent calculation on the same frames, and in the same on "
      "six clips",
      {{"n"}, {"condition"}, {"method"}, {"here"}, {"here, cell"},
          {"same clips", 2}, {"same clips, cell", 2}, {"six"}, {"six, cell"}},
      {}};
  table.columns[3].decimals = table.columns[4].decimals = 2;
  for (const Reference &reference : kReferences) {
    std::vector<Cell> row = {std::to_string (reference.n),
        reference.noisy ? "noisy" : "clean", reference.method};
    std::ranges::move (
        mean_of_frames (scenes, reference), std::back_inserter (row));
    row.insert (row.end (), {reference.point_two, reference.cell_two,
                                reference.point_six, reference.cell_six});
    table.rows.push_back (std::move (row));
  }
  return table;
}

Table
still_table (const std::vector<Scene> &scenes)
{
  Table table{"still",
      "Mean grey and entropy (bits per pixel) of I1..I4, staircase:2x2 and "
      "rank, of static scenes",
      {{"scene"}, {"condition"}}, {}};
  for (const char *figure : {"mean", "entropy"}) {
    for (int k = 1; k <= 4; k++)
      table.columns.push_back (
          {std::string (figure) + " I" + std::to_string (k),
              *figure == 'm' ? 1 : 2});
  }
  const Way way = way_of ("staircase:2x2", "", kRank);
  for (const Scene &scene : scenes) {
    const Scene still = still_scene (scene.name, scene.frames.front (), 4);
    for (const bool noisy : {false, true}) {
      const auto coded = take (still, way.schedule, noisy ? kNoisy : kClean);
      const auto subframes = split (coded.front (), way);
      auto &row = table.rows.emplace_back ();
      row = {scene.name, noisy ? "noisy" : "clean"};
      for (const Picture &subframe : subframes)
        row.push_back (mean_of (subframe.view ()));
      for (const Picture &subframe : subframes)
        row.push_back (entropy_of (subframe.view ()));
    }
  }
  return table;
}

namespace
{

/* Part of the light of an exposure without masks, in percent. */
double
light_through (const Schedule &schedule)
{
  int open = 0;
  for (int e = 0; e < schedule.elements (); e++)
    open += schedule.code ().on_slots (e);
  return 100.0 * open / (schedule.elements () * schedule.slots ());
}

} // namespace

Table
light_table ()
{
  Table table{"light",
      "Light that passes the mirrors (% of an exposure without masks), and "
      "signal-to-noise ratio (dB) of each subframe on a flat grey of 50 %, "
      "noisy",
      {{"schedule"}, {"method"}, {"light"}, {"I1"}, {"I2"}, {"I3"}, {"I4"}},
      {}};
  const Scene flat = flat_scene (512, 512, 4, 128);
  for (const Way &way : {way_of ("sequential:2x2", "select", kSelect),
           way_of ("staircase:2x2", "rank, as shown", kRank),
           way_of ("staircase:2x2", "decode in place", kDecodeInPlace),
           way_of ("staircase:2x2", "decode", kDecode),
           way_of ("s-matrix:2x2", "decode in place", kDecodeInPlace)}) {
    auto &row = table.rows.emplace_back ();
    row = {way.schedule.text (), way.label, light_through (way.schedule)};
    const auto coded = take (flat, way.schedule, kNoisy);
    for (const Picture &subframe : split (coded.front (), way))
      row.push_back (20.0 * std::log10 (mean_of (subframe.view ()) /
                                        deviation_of (subframe.view ())));
  }
  return table;
}

} // namespace codedexposure::quality
