/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The table of docs/quality.md about the borders of regions. */
#include "region_figures.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "extract/extractor.h"
#include "fuse/fuser.h"
#include "must.h"
#include "trial.h"

namespace codedexposure::quality
{

namespace
{

constexpr Condition kNoisy = {.electrons = 10000.0, .read_noise = 5.0};
constexpr int kFrameBorder = 16; // pixels that are left out
constexpr int kFusedReach = 4;   // pixels from the border of the region

struct Setup {
  const char *background, *region; ///< CODE:TILE
  bool fused;                      ///< else subframes, decoded
};
constexpr Setup kSetups[] = {{"staircase:2x2", "staircase:4x2", false},
    {"sequential:lattice:4/2", "sequential:lattice:8/3", true}};

Rect
grown (const Rect &rect, int x, int y)
{
  return {rect.x - x, rect.y - y, rect.width + 2 * x, rect.height + 2 * y};
}

/** Errors of one part of the frame: beside the border and elsewhere. */
struct Errors {
  PooledError near, far;
};

/* Called with every value and its reference, at the pixel where it begins. */
using Compared = std::function<void (int x, int y, double value, double truth)>;

/** Adds up the errors of the part that is inside or outside of @p rect, @p
 * reach being beside its border. */
class Zones
{
public:
  Zones (const Rect &rect, bool inside, Extent reach, Extent frame)
      : rect_ (rect), inside_ (inside),
        all_ (grown (
            {0, 0, frame.width, frame.height}, -kFrameBorder, -kFrameBorder)),
        far_ (grown (rect, inside ? -reach.width : reach.width,
            inside ? -reach.height : reach.height))
  {
  }

  void add (int x, int y, double value, double truth)
  {
    if (!all_.holds (x, y) || rect_.holds (x, y) != inside_)
      return;
    (far_.holds (x, y) == inside_ ? errors.far : errors.near)
        .add (value, truth);
  }

  Errors errors;

private:
  Rect rect_;
  bool inside_;
  Rect all_, far_;
};

/** The scene as a part of fewer slots should show it: means over those of the
 * exposure for which each of its masks is held. */
std::vector<Image<float>>
truths_of (const Picture *slots, int all, int shown)
{
  const int held = all / shown;
  std::vector<Image<float>> truths;
  for (int k = 0; k < shown; k++) {
    Image<float> &truth =
        truths.emplace_back (slots[0].width (), slots[0].height ());
    for (int y = 0; y < truth.height (); y++)
      for (int x = 0; x < truth.width (); x++) {
        for (int s = k * held; s < (k + 1) * held; s++)
          truth.at (x, y) += slots[s].at (x, y);
        truth.at (x, y) /= float (held);
      }
  }
  return truths;
}

/* Subframes of @schedule's background, @region -1, or of a region against the
 * means of cells. */
void
compare_subframes (const Schedule &schedule, int region, const Picture &coded,
    const std::vector<Image<float>> &truths, const Compared &compared)
{
  const Rect rect = region < 0 ? Rect{0, 0, coded.width (), coded.height ()}
                               : schedule.regions ()[std::size_t (region)].rect;
  const auto extractor = must (Extractor<std::uint8_t>::make (
      region < 0 ? schedule : schedule.region (region), rect.width,
      rect.height));
  const Extent size = extractor.subframe_size ();
  std::vector<Picture> subframes (
      truths.size (), Picture (size.width, size.height));
  std::vector<ImageView<std::uint8_t>> views;
  for (Picture &subframe : subframes)
    views.push_back (subframe.view ());
  must (extractor.run (
      coded.view ().block (rect.x, rect.y, rect.width, rect.height), views));
  const Extent cell = {rect.width / size.width, rect.height / size.height};
  for (std::size_t k = 0; k < subframes.size (); k++)
    for (int j = 0; j < size.height; j++)
      for (int i = 0; i < size.width; i++) {
        const int left = rect.x + i * cell.width;
        const int top = rect.y + j * cell.height;
        double sum = 0.0;
        for (int y = 0; y < cell.height; y++)
          for (int x = 0; x < cell.width; x++)
            sum += truths[k].at (left + x, top + y);
        compared (left, top, subframes[k].at (i, j),
            sum / (cell.width * cell.height));
      }
}

void
compare_fused (Fuser<std::uint8_t> &fuser, const Picture &coded,
    const std::vector<Image<float>> &truths, const Compared &compared)
{
  std::vector<Picture> frames (
      std::size_t (fuser.slots ()), Picture (coded.width (), coded.height ()));
  std::vector<ImageView<std::uint8_t>> views;
  for (Picture &frame : frames)
    views.push_back (frame.view ());
  must (fuser.take (coded.view ()));
  must (fuser.fuse (views));
  const std::size_t held = frames.size () / truths.size ();
  for (std::size_t k = 0; k < frames.size (); k++)
    for (int y = 0; y < coded.height (); y++)
      for (int x = 0; x < coded.width (); x++)
        compared (x, y, frames[k].at (x, y), truths[k / held].at (x, y));
}

/** A schedule of @p setup with a region in @p rect. */
Schedule
schedule_with (const Setup &setup, const Rect &rect)
{
  return schedule_of (std::string (setup.background) +
                      ",region=" + rect_text (rect) + ":" + setup.region);
}

/** The errors of one part of the frames that @p schedule makes of @p scene. */
Errors
errors_of (const Scene &scene, const Setup &setup, const Schedule &schedule,
    bool inside, Zones zones)
{
  const Schedule part = inside ? schedule.region (0) : schedule.background ();
  const Picture *slots = scene.frames.data ();
  const Compared add = [&] (int x, int y, double value, double truth) {
    zones.add (x, y, value, truth);
  };
  FuseOptions options;
  options.noise = {kNoisy.electrons, kNoisy.read_noise};
  auto fuser = must (Fuser<std::uint8_t>::make (
      schedule, slots->width (), slots->height (), options));
  for (const Picture &coded : take (scene, schedule, kNoisy)) {
    const auto truths = truths_of (slots, schedule.slots (), part.slots ());
    if (setup.fused)
      compare_fused (fuser, coded, truths, add);
    else
      compare_subframes (schedule, inside ? 0 : -1, coded, truths, add);
    slots += schedule.slots ();
  }
  return zones.errors;
}

/** PSNR beside the border, there without one, and elsewhere. */
std::vector<double>
figures_of (const Scene &scene, const Setup &setup, bool inside)
{
  const Extent frame = {
      scene.frames.front ().width (), scene.frames.front ().height ()};
  const auto eighths = [] (int pixels) { return pixels / 8 * 8; };
  const Rect rect{eighths (frame.width / 4), eighths (frame.height / 4),
      eighths (frame.width / 2), eighths (frame.height / 2)};
  const Schedule schedule = schedule_with (setup, rect);
  /* The same light and the same codes, but one part all over the picture. */
  const Schedule plain = schedule_with (
      setup, inside ? Rect{0, 0, frame.width, frame.height} : Rect{0, 0, 8, 8});
  const Extent cell = inside ? schedule.region (0).cell () : schedule.cell ();
  const Zones zones (rect, inside,
      setup.fused ? Extent{kFusedReach, kFusedReach}
                  : Extent{2 * cell.width, 2 * cell.height},
      frame);
  const Errors with = errors_of (scene, setup, schedule, inside, zones);
  const Errors without = errors_of (scene, setup, plain, inside, zones);
  return {with.near.psnr (), without.near.psnr (), with.far.psnr ()};
}

} // namespace

Table
regions_table (const std::vector<Scene> &scenes, const Progress &progress)
{
  Table table{"regions",
      "PSNR (dB) of decoded subframes against the mean of the cell, within 2 "
      "cells of a region's border, and of fused frames, within 4 pixels; noisy",
      {{"background"}, {"region"}, {"pictures"}, {"where"}}, {}};
  for (const Scene &scene : scenes)
    table.columns.push_back ({scene.name});
  table.columns.push_back ({"mean"});
  for (const Setup &setup : kSetups)
    for (const bool inside : {true, false}) {
      const std::string pictures =
          std::string (setup.fused ? "fused, " : "subframes, ") +
          (inside ? "region" : "background");
      progress (std::string ("regions: ") + pictures);
      std::vector<std::vector<double>> figures;
      for (const Scene &scene : scenes)
        figures.push_back (figures_of (scene, setup, inside));
      std::size_t f = 0;
      for (const char *where :
          {"at the border", "there, without a border", "elsewhere"}) {
        auto &row = table.rows.emplace_back ();
        row = {setup.background, setup.region, pictures, where};
        double sum = 0.0;
        for (const auto &of_scene : figures) {
          row.push_back (of_scene[f]);
          sum += of_scene[f];
        }
        row.push_back (sum / double (figures.size ()));
        f++;
      }
    }
  return table;
}

} // namespace codedexposure::quality
