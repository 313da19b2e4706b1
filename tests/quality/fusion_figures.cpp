/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fusion_figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <span>
#include <utility>

#include "base/text.h"
#include "baselines.h"
#include "bench/scene.h"

namespace codedexposure::quality
{

namespace
{

constexpr int kDrawnFrames = 16;
constexpr Condition kClean = {};
constexpr Condition kNoisy = {.electrons = 10000.0, .read_noise = 5.0};

FuseOptions
options_of (FuseQuality quality, const Condition &condition)
{
  FuseOptions options;
  options.quality = quality;
  options.noise = {condition.electrons, condition.read_noise};
  return options;
}

/* A method that gives a frame for every slot of a scene. */
struct FusionWay {
  std::string name;
  std::function<std::vector<Picture> (const Scene &, const Condition &)> frames;
};

FusionWay
rank_way (int n, bool normalised)
{
  const Schedule schedule =
      schedule_of (n == 4 ? "staircase:2x2" : "staircase:4x2");
  return {normalised ? "staircase, rank, normalised" : "staircase, rank",
      [=] (const Scene &scene, const Condition &condition) {
        return rank_frames (
            take (scene, schedule, condition), schedule, normalised);
      }};
}

FusionWay
fusion_way (int n, FuseQuality quality, bool refine = false, int lookahead = 0,
    const std::string &leak = "0", int overlap = 1)
{
  return {std::string (quality_name (quality)) + (refine ? ", refined" : "") +
              (overlap > 1    ? ", overlap " + std::to_string (overlap)
                  : lookahead ? std::string (", lookahead")
                              : std::string ()),
      [=] (const Scene &scene, const Condition &condition) {
        const Schedule schedule = fusion_schedule (n, leak);
        FuseOptions options = options_of (quality, condition);
        options.refine = refine;
        options.lookahead = lookahead;
        options.overlap = overlap;
        return fuse (take (scene, schedule, condition), schedule, options);
      }};
}

std::vector<FusionWay>
ways (int n)
{
  return {rank_way (n, false), rank_way (n, true),
      {"random masks, GAP-TV",
          [n] (const Scene &scene, const Condition &condition) {
            return gap_tv_frames (scene, n, condition);
          }},
      {"bicubic",
          [n] (const Scene &scene, const Condition &condition) {
            const Schedule schedule = fusion_schedule (n);
            return bicubic_frames (take (scene, schedule, condition), schedule);
          }},
      fusion_way (n, FuseQuality::kFast),
      fusion_way (n, FuseQuality::kBalanced),
      fusion_way (n, FuseQuality::kBest),
      fusion_way (n, FuseQuality::kFast, true),
      fusion_way (n, FuseQuality::kBalanced, true),
      fusion_way (n, FuseQuality::kLearned)};
}

/* Each coded frame by itself, without those before and after it. */
FusionWay
lone_way (int n, FuseQuality quality)
{
  return {std::string (quality_name (quality)) + ", each frame alone",
      [=] (const Scene &scene, const Condition &condition) {
        const Schedule schedule = fusion_schedule (n);
        std::vector<Picture> all;
        for (const Picture &coded : take (scene, schedule, condition))
          std::ranges::move (
              fuse ({coded}, schedule, options_of (quality, condition)),
              std::back_inserter (all));
        return all;
      }};
}

FusionWay
overlap_way (int n, FuseQuality quality, bool refine, int overlap)
{
  return fusion_way (n, quality, refine, 1, "0", overlap);
}

/* Those of sequences: files are fused with lookahead. */
std::vector<FusionWay>
sequence_ways (int n)
{
  std::vector<FusionWay> all;
  for (const FuseQuality quality :
      {FuseQuality::kFast, FuseQuality::kBalanced, FuseQuality::kBest}) {
    all.push_back (lone_way (n, quality));
    for (const int lookahead : {0, 1})
      all.push_back (fusion_way (n, quality, false, lookahead));
  }
  all.push_back (fusion_way (n, FuseQuality::kFast, true, 1));
  all.push_back (fusion_way (n, FuseQuality::kBalanced, true, 1));
  all.push_back (fusion_way (n, FuseQuality::kLearned, false, 1));
  all.push_back (overlap_way (n, FuseQuality::kBalanced, false, 2));
  all.push_back (overlap_way (n, FuseQuality::kBalanced, true, 2));
  for (int overlap = 2; overlap <= n; overlap *= 2)
    all.push_back (overlap_way (n, FuseQuality::kLearned, false, overlap));
  return all;
}

/* The first frames of @p scene, as many as complete coded frames contain. */
Scene
first_of (const Scene &scene, int frames, int n)
{
  Scene part{scene.name, scene.frames};
  const auto most = std::min (std::size_t (frames), scene.frames.size ());
  part.frames.resize (most / std::size_t (n) * std::size_t (n));
  return part;
}

std::string
condition_name (bool noisy)
{
  return noisy ? "noisy" : "clean";
}

using Figures = std::vector<double>;

/* A table that has @p figures of every scene and their mean. */
Table
scene_table (std::string id, std::string title,
    const std::vector<Scene> &scenes, const std::vector<Column> &figures)
{
  Table table{std::move (id), std::move (title), {{"n"}, {"method"}}, {}};
  const auto add = [&] (const std::string &name) {
    for (const Column &figure : figures)
      table.columns.push_back ({name + figure.title, figure.decimals});
  };
  for (const Scene &scene : scenes)
    add (scene.name);
  add ("mean");
  return table;
}

/* @p row with the figures of every scene and their mean. */
void
add_row (
    Table &table, std::vector<Cell> row, const std::vector<Figures> &scenes)
{
  Figures mean (scenes[0].size ());
  for (const Figures &figures : scenes)
    for (std::size_t i = 0; i < figures.size (); i++) {
      row.emplace_back (figures[i]);
      mean[i] += figures[i] / double (scenes.size ());
    }
  row.insert (row.end (), mean.begin (), mean.end ());
  table.rows.push_back (std::move (row));
}

/* Root mean square over pixels of the standard deviation over pictures. */
double
flicker (std::span<const Picture> slots)
{
  double sum = 0.0;
  const auto n = double (slots.size ());
  for (int y = 0; y < slots[0].height (); y++) {
    for (int x = 0; x < slots[0].width (); x++) {
      double mean = 0.0, square = 0.0;
      for (const Picture &slot : slots) {
        mean += slot.at (x, y) / n;
        square += double (slot.at (x, y)) * slot.at (x, y) / n;
      }
      sum += square - mean * mean;
    }
  }
  return std::sqrt (
      std::max (sum, 0.0) / (slots[0].width () * slots[0].height ()));
}

} // namespace

Schedule
fusion_schedule (int n, const std::string &leak)
{
  return schedule_of ((n == 4 ? "sequential:lattice:4/2"
                              : "sequential:lattice:8/3,order=bit-reversal") +
                      (leak == "0" ? "" : ",leak=" + leak));
}

std::vector<Table>
fusion_tables (
    const std::vector<Scene> &scenes, int frames, const Progress &progress)
{
  std::vector<Table> tables;
  for (const bool noisy : {false, true}) {
    const std::string name = condition_name (noisy);
    const std::string first =
        " of the first " + std::to_string (frames) + " frames, " + name;
    Table accuracy = scene_table ("fusion-" + name,
        "Mean PSNR (dB) and SSIM" + first, scenes, {{" dB", 2}, {" SSIM", 3}});
    Table flicker = scene_table ("fusion-flicker-" + name,
        "Error of the change from slot to slot (grey levels, rms)" + first,
        scenes, {{"", 2}});
    Table texture = scene_table ("fusion-texture-" + name,
        "Detail relative to the truth, and its correlation with the truth," +
            first,
        scenes, {{" detail", 2}, {" correlation", 2}});
    for (const int n : {4, 8}) {
      for (const FusionWay &way : ways (n)) {
        std::vector<Figures> accuracies, flickers, textures;
        for (const Scene &scene : scenes) {
          progress (std::to_string (n) + " " + way.name + " of " + scene.name);
          const Scene part = first_of (scene, frames, n);
          const FrameMean mean =
              compare (way.frames (part, noisy ? kNoisy : kClean), part.frames);
          accuracies.push_back ({mean.psnr, mean.ssim});
          flickers.push_back ({mean.flicker});
          textures.push_back ({mean.detail, mean.likeness});
        }
        const std::vector<Cell> row{std::to_string (n), way.name};
        add_row (accuracy, row, accuracies);
        add_row (flicker, row, flickers);
        add_row (texture, row, textures);
      }
    }
    std::ranges::move (std::initializer_list<Table>{accuracy, flicker, texture},
        std::back_inserter (tables));
  }
  return tables;
}

Table
still_fusion_table (const std::vector<Scene> &scenes, const Progress &progress)
{
  constexpr int kCoded = 3;
  Table table = scene_table ("fusion-still",
      "Static pixels, third coded frame: PSNR (dB), and standard deviation "
      "over slots in grey levels",
      scenes, {{" dB", 2}, {" levels", 2}});
  table.columns.insert (table.columns.begin () + 1, {"condition"});
  for (const bool noisy : {false, true}) {
    for (const int n : {4, 8}) {
      for (const FuseQuality quality :
          {FuseQuality::kFast, FuseQuality::kBest}) {
        std::vector<Figures> figures;
        for (const Scene &scene : scenes) {
          progress ("still " + scene.name);
          const Scene still =
              still_scene (scene.name, scene.frames[0], kCoded * n);
          const auto all =
              fusion_way (n, quality).frames (still, noisy ? kNoisy : kClean);
          const std::vector<Picture> last (
              all.end () - std::ptrdiff_t (n), all.end ());
          const std::vector<Picture> truth (std::size_t (n), still.frames[0]);
          figures.push_back ({compare (last, truth).psnr, flicker (last)});
        }
        add_row (table,
            {std::to_string (n), condition_name (noisy),
                std::string (quality_name (quality))},
            figures);
      }
    }
  }
  return table;
}

/* Mean PSNR of each slot over the coded frames from frame @p from on. */
static Figures
slot_psnr (const std::vector<Picture> &frames,
    const std::vector<Picture> &truth, int from, int n)
{
  Figures slots (std::size_t (n), 0.0);
  const auto count =
      double ((truth.size () - std::size_t (from)) / slots.size ());
  for (auto i = std::size_t (from); i < truth.size (); i++)
    slots[i % slots.size ()] += psnr (frames[i], truth[i]) / count;
  return slots;
}

static double
mean_of (const Figures &figures)
{
  return std::accumulate (figures.begin (), figures.end (), 0.0) /
         double (figures.size ());
}

std::vector<Table>
sequence_tables (const std::vector<Scene> &scenes, const Progress &progress)
{
  constexpr int kFrom = 8;
  constexpr int kAll = kSequenceFrames + kFramesAfter;
  std::vector<Table> tables;
  for (const bool noisy : {false, true}) {
    for (const int n : {4, 8}) {
      const std::string slots = std::to_string (n);
      Table &table = tables.emplace_back (
          Table{"fusion-sequences-" + condition_name (noisy) + "-" + slots,
              "Frames 8 to 31, n = " + slots + ", " + condition_name (noisy) +
                  ": mean PSNR (dB), and that of each slot of the coded frame",
              {{"clip"}, {"method"}, {"mean", 2}}, {}});
      for (int s = 0; s < n; s++)
        table.columns.push_back ({"slot " + std::to_string (s), 2});
      for (const Scene &scene : scenes) {
        if (scene.frames.size () < kAll)
          continue;
        const Scene part = first_of (scene, kAll, n);
        Scene compared = part;
        compared.frames.resize (kSequenceFrames);
        for (const FusionWay &way : sequence_ways (n)) {
          progress (
              "sequence, " + slots + " " + way.name + " of " + scene.name);
          auto fused = way.frames (part, noisy ? kNoisy : kClean);
          fused.resize (kSequenceFrames);
          const Figures psnrs = slot_psnr (fused, compared.frames, kFrom, n);
          auto &row = table.rows.emplace_back (
              std::vector<Cell>{scene.name, way.name, mean_of (psnrs)});
          row.insert (row.end (), psnrs.begin (), psnrs.end ());
        }
      }
    }
  }
  return tables;
}

/* The scene of codedexposure-scene from just before the candle is blown out. */
static Scene
bench_scene (std::string name, SceneKind kind)
{
  constexpr Extent kSize{192, 144};
  constexpr double kStart = 0.45, kRate = 100.0;
  const auto drawn = SyntheticScene::make (kind, kSize);
  Scene scene{std::move (name), {}};
  Image<float> light (kSize.width, kSize.height);
  for (int t = 0; t < kDrawnFrames; t++) {
    drawn->draw (kStart + t / kRate, light.view ());
    Picture &picture = scene.frames.emplace_back (kSize.width, kSize.height);
    for (int y = 0; y < kSize.height; y++)
      for (int x = 0; x < kSize.width; x++)
        picture.at (x, y) = std::uint8_t (std::lround (
            255.0 * std::clamp (double (light.at (x, y)), 0.0, 1.0)));
  }
  return scene;
}

static std::vector<Scene>
drawn_scenes ()
{
  constexpr unsigned kDiscs = 12;
  constexpr int kSize = 128;
  std::vector<Scene> scenes{synthetic_scene (192, 144, kDrawnFrames),
      bench_scene ("candle", SceneKind::kCandle),
      bench_scene ("blown-out", SceneKind::kBlownOut),
      bench_scene ("pour", SceneKind::kPour)};
  for (unsigned seed = 1; seed <= kDiscs; seed++) {
    scenes.push_back (leaves_scene (seed, kSize, kDrawnFrames));
    scenes.back ().name = "discs " + std::to_string (seed);
  }
  return scenes;
}

std::vector<Table>
refinement_tables (const std::vector<Scene> &clips, const Progress &progress)
{
  constexpr FuseQuality kQualities[] = {
      FuseQuality::kFast, FuseQuality::kBalanced, FuseQuality::kBest};
  std::vector<Scene> scenes = clips;
  std::ranges::move (drawn_scenes (), std::back_inserter (scenes));
  std::vector<Table> tables;
  for (const bool noisy : {false, true}) {
    Table &table = tables.emplace_back (
        Table{"fusion-refinement-" + condition_name (noisy),
            "PSNR (dB) that the refinement gains over each quality, " +
                condition_name (noisy),
            {{"scene"}}, {}});
    for (const int n : {4, 8})
      for (const FuseQuality quality : kQualities)
        table.columns.push_back ({std::string (quality_name (quality)) +
                                      ", n = " + std::to_string (n),
            2});
    for (const Scene &scene : scenes) {
      progress ("refinement of " + scene.name);
      auto &row = table.rows.emplace_back (std::vector<Cell>{scene.name});
      for (const int n : {4, 8}) {
        const Scene part = first_of (scene, kSequenceFrames, n);
        for (const FuseQuality quality : kQualities) {
          const auto figure = [&] (bool refine) {
            const auto frames = fusion_way (n, quality, refine)
                                    .frames (part, noisy ? kNoisy : kClean);
            return mean_of (slot_psnr (frames, part.frames, 0, n));
          };
          row.emplace_back (figure (true) - figure (false));
        }
      }
    }
  }
  return tables;
}

namespace
{

using Qualities = std::array<FuseQuality, 2>;

/* Calls @p use for the columns of what is measured at both numbers of slots,
 * clean and noisy. */
template <typename Use>
void
for_each_column (Qualities qualities, const Use &use)
{
  for (const int n : {4, 8})
    for (const bool noisy : {false, true})
      for (const FuseQuality quality : qualities)
        use (n, noisy, quality);
}

void
add_columns (Table &table, Qualities qualities)
{
  for_each_column (qualities, [&] (int n, bool noisy, FuseQuality quality) {
    table.columns.push_back (
        {std::string (quality_name (quality)) + ", " + condition_name (noisy) +
                ", n = " + std::to_string (n),
            2});
  });
}

/* Mean PSNR over the first @p most frames of each scene, and over scenes. */
double
mean_psnr (const std::vector<Scene> &scenes, int most, int n,
    const FusionWay &way, const Condition &condition)
{
  double sum = 0.0;
  for (const Scene &scene : scenes) {
    const Scene part = first_of (scene, most, n);
    sum +=
        mean_of (slot_psnr (way.frames (part, condition), part.frames, 0, n));
  }
  return sum / double (scenes.size ());
}

} // namespace

Table
leakage_table (const std::vector<Scene> &scenes, const Progress &progress)
{
  constexpr Qualities kQualities = {FuseQuality::kBest, FuseQuality::kLearned};
  Table table{"fusion-leakage",
      "PSNR (dB) with off-state leakage that is known, mean over scenes",
      {{"leakage"}}, {}};
  add_columns (table, kQualities);
  for (const char *leak : {"0", "0.001", "0.01", "0.05"}) {
    progress ("leakage " + std::string (leak));
    auto &row = table.rows.emplace_back (std::vector<Cell>{leak});
    for_each_column (kQualities, [&] (int n, bool noisy, FuseQuality quality) {
      row.emplace_back (mean_psnr (scenes, kSequenceFrames, n,
          fusion_way (n, quality, false, 0, leak), noisy ? kNoisy : kClean));
    });
  }
  return table;
}

Table
blur_table (const std::vector<Scene> &scenes, const Progress &progress)
{
  constexpr int kFrames = 8;
  constexpr Qualities kQualities = {FuseQuality::kFast, FuseQuality::kLearned};
  Table table{"fusion-blur",
      "PSNR (dB) with a lens that blurs, an aligned camera, mean over scenes",
      {{"blur"}, {"mapping"}}, {}};
  add_columns (table, kQualities);
  for (const double blur : {0.0, 0.1, 0.2, 0.3, 0.5})
    for (const bool known : {false, true}) {
      if (blur == 0.0 && known)
        continue;
      const std::string name = real_text (blur) + " px";
      progress ("blur of " + name);
      auto &row = table.rows.emplace_back (
          std::vector<Cell>{name, known ? "with the blur" : "none"});
      for_each_column (
          kQualities, [&] (int n, bool noisy, FuseQuality quality) {
            Condition condition = noisy ? kNoisy : kClean;
            condition.blur = blur;
            condition.mapped = known;
            row.emplace_back (mean_psnr (
                scenes, kFrames, n, fusion_way (n, quality), condition));
          });
    }
  return table;
}

} // namespace codedexposure::quality
