/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fusion_figures.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <utility>

#include "baselines.h"

namespace codedexposure::quality
{

namespace
{

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
fusion_way (int n, FuseQuality quality, bool refine = false)
{
  return {std::string (quality_name (quality)) + (refine ? ", refined" : ""),
      [=] (const Scene &scene, const Condition &condition) {
        const Schedule schedule = fusion_schedule (n);
        FuseOptions options = options_of (quality, condition);
        options.refine = refine;
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

/* The first frames of @p scene, as many as complete coded frames contain. */
Scene
first_of (const Scene &scene, int frames, int n)
{
  Scene part{scene.name, scene.frames};
  const auto most = std::min (std::size_t (frames), scene.frames.size ());
  part.frames.resize (most / std::size_t (n) * std::size_t (n));
  return part;
}

Table
empty_table (std::string id, std::string title,
    const std::vector<Scene> &scenes, const char *second, int decimals)
{
  Table table{std::move (id), std::move (title), {{"n"}, {"method"}}, {}};
  const auto add = [&] (const std::string &name) {
    table.columns.push_back ({name + " dB", 2});
    table.columns.push_back ({name + " " + second, decimals});
  };
  for (const Scene &scene : scenes)
    add (scene.name);
  add ("mean");
  return table;
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
fusion_schedule (int n)
{
  return schedule_of (n == 4 ? "sequential:lattice:4/2"
                             : "sequential:lattice:8/3,order=bit-reversal");
}

std::vector<Table>
fusion_tables (
    const std::vector<Scene> &scenes, int frames, const Progress &progress)
{
  std::vector<Table> tables;
  for (const bool noisy : {false, true}) {
    const char *name = noisy ? "noisy" : "clean";
    Table &table =
        tables.emplace_back (empty_table (std::string ("fusion-") + name,
            "Full-size frames, " + std::string (name) +
                ": mean PSNR (dB) and SSIM of the first " +
                std::to_string (frames) + " frames",
            scenes, "SSIM", 3));
    for (const int n : {4, 8}) {
      for (const FusionWay &way : ways (n)) {
        auto &row = table.rows.emplace_back (
            std::vector<Cell>{std::to_string (n), way.name});
        FrameMean mean;
        for (const Scene &scene : scenes) {
          progress (std::to_string (n) + " " + way.name + " of " + scene.name);
          const Scene part = first_of (scene, frames, n);
          const FrameMean figure =
              compare (way.frames (part, noisy ? kNoisy : kClean), part.frames);
          row.insert (row.end (), {figure.psnr, figure.ssim});
          mean.psnr += figure.psnr / double (scenes.size ());
          mean.ssim += figure.ssim / double (scenes.size ());
        }
        row.insert (row.end (), {mean.psnr, mean.ssim});
      }
    }
  }
  return tables;
}

Table
still_fusion_table (const std::vector<Scene> &scenes, const Progress &progress)
{
  constexpr int kCoded = 3;
  Table table = empty_table ("fusion-still",
      "Static pixels, third coded frame: PSNR (dB), and standard deviation "
      "over slots in grey levels",
      scenes, "levels", 2);
  table.columns.insert (table.columns.begin () + 1, {"condition"});
  for (const bool noisy : {false, true}) {
    for (const int n : {4, 8}) {
      for (const FuseQuality quality :
          {FuseQuality::kFast, FuseQuality::kBest}) {
        auto &row = table.rows.emplace_back (
            std::vector<Cell>{std::to_string (n), noisy ? "noisy" : "clean",
                std::string (quality_name (quality))});
        double psnr = 0.0, levels = 0.0;
        for (const Scene &scene : scenes) {
          progress ("still " + scene.name);
          const Scene still =
              still_scene (scene.name, scene.frames[0], kCoded * n);
          const auto all =
              fusion_way (n, quality).frames (still, noisy ? kNoisy : kClean);
          const std::vector<Picture> last (
              all.end () - std::ptrdiff_t (n), all.end ());
          const std::vector<Picture> truth (std::size_t (n), still.frames[0]);
          row.insert (row.end (), {compare (last, truth).psnr, flicker (last)});
          psnr += compare (last, truth).psnr / double (scenes.size ());
          levels += flicker (last) / double (scenes.size ());
        }
        row.insert (row.end (), {psnr, levels});
      }
    }
  }
  return table;
}

/* Mean PSNR of fast over whole coded frames of @scenes. */
static double
fast_psnr (const std::vector<Scene> &scenes, int frames, int n,
    const FuseOptions &options)
{
  const Schedule schedule = fusion_schedule (n);
  double psnr = 0.0;
  for (const Scene &scene : scenes) {
    const Scene part = first_of (scene, frames, n);
    psnr += compare (fuse (take (part, schedule, kClean), schedule, options),
                part.frames)
                .psnr /
            double (scenes.size ());
  }
  return psnr;
}

Table
training_table (
    const std::vector<Scene> &clips, int frames, const Progress &progress)
{
  constexpr unsigned kDrawn = 12;
  constexpr int kSize = 128;
  Table table{"fusion-training",
      "fast, clean: mean PSNR (dB) by the speeds of its models",
      {{"slow px/slot", 2}, {"moving px/slot", 2}, {"drawn, n = 4", 2},
          {"drawn, n = 8", 2}},
      {}};
  std::vector<Scene> drawn;
  for (unsigned seed = 1; seed <= kDrawn; seed++)
    drawn.push_back (leaves_scene (seed, kSize, frames));
  if (!clips.empty ()) {
    table.columns.push_back ({"clips, n = 4", 2});
    table.columns.push_back ({"clips, n = 8", 2});
  }
  for (const double slow : {0.1, 0.15, 0.2, 0.25, 0.3, 0.4}) {
    for (const double moving : {1.0, 2.0, 3.0}) {
      progress ("slow " + std::to_string (slow));
      FuseOptions options;
      options.scene.slow.spread = slow;
      options.scene.moving.spread = moving;
      auto &row = table.rows.emplace_back (std::vector<Cell>{slow, moving});
      for (const auto *scenes : {&std::as_const (drawn), &clips})
        for (const int n : {4, 8})
          if (!scenes->empty ())
            row.push_back (fast_psnr (*scenes, frames, n, options));
    }
  }
  return table;
}

} // namespace codedexposure::quality
