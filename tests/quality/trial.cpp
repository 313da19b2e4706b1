/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* One method to record and split coded frames, and its accuracy. */
#include "trial.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <numeric>
#include <utility>

#include "bench/bench.h"
#include "fuse/partner_correction.h"
#include "must.h"
#include "rectify/rectifier.h"
#include "schedule/sample_grid.h"
#include "upsample.h"

namespace codedexposure::quality
{

namespace
{

using Values = Image<float>;

Mapping
mapping_of (const Condition &condition, Extent size)
{
  Mapping::Parts parts{size, size};
  parts.psf_sigma = condition.blur;
  if (const auto &view = condition.view) {
    const double cx = 0.5 * (size.width - 1), cy = 0.5 * (size.height - 1);
    const double angle = view->rotation * std::numbers::pi / 180.0;
    const double c = std::cos (angle) / view->scale;
    const double s = std::sin (angle) / view->scale;
    const double along = view->stretch * (view->mirrored ? -1.0 : 1.0);
    const double z = view->keystone / cx, z0 = 1.0 - view->keystone;
    /* Of differences from the centre, which Z and the shift are added to. */
    const double xx = along * c, xy = -s, yx = along * s, yy = c;
    const double x = cx + view->shift_x, y = cy + view->shift_y;
    parts.homography = {xx + x * z, xy, x * z0 - xx * cx - xy * cy, yx + y * z,
        yy, y * z0 - yx * cx - yy * cy, z, 0.0, z0};
  }
  return must (Mapping::make (parts));
}

BenchOptions
bench_options (const Condition &condition, Extent size)
{
  BenchOptions options;
  options.full_well = condition.electrons;
  options.read_noise = condition.read_noise;
  options.gain = condition.gain;
  options.alignment.shift_x = options.alignment.shift_y = condition.shift;
  options.psf_sigma = condition.blur;
  options.black_level = condition.black_level;
  options.seed = condition.seed;
  if (condition.view)
    options.mapping = mapping_of (condition, size);
  return options;
}

Values
read (const std::vector<Picture> &subframes, std::size_t k, Reading reading)
{
  const Picture &shown = subframes[k];
  const auto n = double (subframes.size ());
  Values values (shown.width (), shown.height ());
  for (int j = 0; j < shown.height (); j++) {
    for (int i = 0; i < shown.width (); i++) {
      double v = shown.at (i, j);
      if (reading == Reading::kNormalised)
        v *= n / double (k + 1);
      if (reading == Reading::kDifference)
        v = n * (v - (k > 0 ? subframes[k - 1].at (i, j) : 0));
      values.at (i, j) = float (std::clamp (v, 0.0, 255.0));
    }
  }
  return values;
}

double
cell_mean (const Picture &truth, Extent cell, int i, int j)
{
  double sum = 0.0;
  for (int y = 0; y < cell.height; y++) {
    for (int x = 0; x < cell.width; x++)
      sum += truth.at (i * cell.width + x, j * cell.height + y);
  }
  return sum / (cell.width * cell.height);
}

void
score_subframe (const Values &values, const Picture &truth,
    const SampleGrid &grid, int element, Score &score)
{
  const Extent cell = grid.cell ();
  for (int j = 0; j < values.height (); j++) {
    for (int i = 0; i < values.width (); i++) {
      const Offset at = grid.offset (element, i, j);
      const double v = values.at (i, j);
      score.point.add (
          v, truth.at (i * cell.width + at.x, j * cell.height + at.y));
      score.cell.add (v, cell_mean (truth, cell, i, j));
    }
  }
}

void
score_picture (const Values &values, const Picture &truth, Extent cell,
    const Upsampler &upsampler, PooledError &error)
{
  const int border = upsampler.margin ();
  for (int y = border; y < values.height () * cell.height - border; y++) {
    for (int x = border; x < values.width () * cell.width - border; x++)
      error.add (upsampler.at (values.view (), x, y), truth.at (x, y));
  }
}

void
count_mislabelled (const Picture &coded, const SampleGrid &grid, Score &score)
{
  const Extent size = grid.subframe_size (coded.width (), coded.height ());
  const Extent cell = grid.cell ();
  std::vector<int> elements (std::size_t (grid.elements ()));
  for (int j = 0; j < size.height; j++) {
    for (int i = 0; i < size.width; i++) {
      auto value = [&] (int element) {
        const Offset at = grid.offset (element, i, j);
        return coded.at (i * cell.width + at.x, j * cell.height + at.y);
      };
      std::iota (elements.begin (), elements.end (), 0);
      std::ranges::stable_sort (elements, {}, value);
      std::uint64_t wrong = 0;
      for (int rank = 0; rank < grid.elements (); rank++)
        wrong += elements[std::size_t (rank)] != rank;
      score.mislabelled += wrong;
      score.mislabelled_cells += wrong > 0;
      score.pixels += std::uint64_t (grid.elements ());
      score.cells++;
    }
  }
}

Extractor<std::uint8_t>
extractor_for (const Way &way, const Picture &coded)
{
  return must (
      Extractor<std::uint8_t>::make (way.believed.value_or (way.schedule),
          coded.width (), coded.height (), way.extract));
}

std::vector<Picture>
split (const Picture &coded, const Extractor<std::uint8_t> &extractor)
{
  const Extent size = extractor.subframe_size ();
  std::vector<Picture> subframes (
      std::size_t (extractor.subframes ()), Picture (size.width, size.height));
  std::vector<ImageView<std::uint8_t>> views;
  for (Picture &subframe : subframes)
    views.push_back (subframe.view ());
  must (extractor.run (coded.view (), views));
  return subframes;
}

/* @p slots: the scene during this exposure, from its first slot on. */
Score
score_frame (const Picture &coded, const Picture *slots, const Way &way)
{
  Score score;
  const SampleGrid grid (way.schedule);
  const auto extractor = extractor_for (way, coded);
  const std::vector<Picture> subframes = split (coded, extractor);
  const bool centred =
      extractor.method () == Method::kDecode && way.extract.interpolate &&
      !way.schedule.code ().one_hot () && grid.repeat () == Extent{1, 1};
  for (int k = 0; k < way.schedule.slots (); k++) {
    const Values values = read (subframes, std::size_t (k), way.reading);
    score_subframe (values, slots[k], grid, k, score);
    score_picture (values, slots[k], grid.cell (),
        Upsampler (way.schedule, k, centred), score.full);
  }
  count_mislabelled (coded, grid, score);
  return score;
}

} // namespace

Schedule
schedule_of (std::string_view preset)
{
  return must (Schedule::from_preset (preset));
}

Score &
Score::operator+= (const Score &other)
{
  point += other.point;
  cell += other.cell;
  full += other.full;
  pixels += other.pixels;
  mislabelled += other.mislabelled;
  cells += other.cells;
  mislabelled_cells += other.mislabelled_cells;
  return *this;
}

namespace
{

/* The noise is that which fusion assumes of such a camera. */
Rectifier
rectifier_for (
    Extent size, const Schedule &schedule, const Condition &condition)
{
  constexpr double kTypicalLight = 0.4;
  RectifyOptions options;
  options.keep_unknown = options.correct = condition.second;
  if (condition.electrons > 0.0)
    options.noise = std::sqrt (kTypicalLight / condition.electrons);
  return must (
      Rectifier::make (mapping_of (condition, size), schedule, options));
}

} // namespace

Corrected
corrected (
    const Picture &coded, const Schedule &schedule, const Condition &condition)
{
  const Extent size{coded.width (), coded.height ()};
  const Rectifier rectifier = rectifier_for (size, schedule, condition);
  Corrected made{Picture (size.width, size.height), {size.width, size.height}};
  must (rectifier.run (
      coded.view (), made.frame.view (), 0, made.errors.view ()));
  return made;
}

void
correct_partners (std::vector<Picture> &partners,
    const std::vector<Picture> &coded, const Schedule &schedule,
    const Condition &condition, std::vector<Image<float>> *errors)
{
  const Extent size{coded.front ().width (), coded.front ().height ()};
  const Rectifier rectifier =
      rectifier_for (size, must (schedule.complement ()), condition);
  if (!rectifier.corrects ())
    return;
  FuseOptions options;
  options.noise = {condition.electrons, condition.read_noise};
  auto correction = must (
      PartnerCorrection<std::uint8_t>::make (schedule, rectifier, options));
  for (std::size_t i = 0; i < partners.size (); i++) {
    std::optional<ImageView<float>> known;
    if (errors)
      known = (*errors)[i].view ();
    must (correction.run (
        std::as_const (coded[i]).view (), partners[i].view (), known));
  }
}

std::vector<Picture>
take (const Scene &scene, const Schedule &schedule, const Condition &condition,
    std::vector<Image<float>> *errors)
{
  const int width = scene.frames.front ().width ();
  const int height = scene.frames.front ().height ();
  const auto slots = std::size_t (schedule.slots ());
  auto bench = must (OpticalBench::make (
      width, height, bench_options (condition, {width, height})));

  std::vector<Picture> coded;
  for (std::size_t at = 0; at + slots <= scene.frames.size (); at += slots) {
    bench.begin (schedule);
    for (std::size_t s = 0; s < slots; s++)
      bench.expose (std::as_const (scene.frames[at + s]).view (), int (s), 1.0);
    Picture &frame = coded.emplace_back (width, height);
    bench.read_out (coded.size () - 1, frame.view ());
    if (!condition.mapped)
      continue;
    Corrected seen = corrected (frame, schedule, condition);
    frame = std::move (seen.frame);
    if (errors)
      errors->push_back (std::move (seen.errors));
  }
  return coded;
}

std::vector<Picture>
split (const Picture &coded, const Way &way)
{
  return split (coded, extractor_for (way, coded));
}

std::vector<Score>
score_frames (const Scene &scene, const Way &way, const Condition &condition)
{
  std::vector<Score> scores;
  const Picture *slots = scene.frames.data ();
  for (const Picture &coded : take (scene, way.schedule, condition)) {
    scores.push_back (score_frame (coded, slots, way));
    slots += way.schedule.slots ();
  }
  return scores;
}

Score
score_scene (const Scene &scene, const Way &way, const Condition &condition)
{
  Score sum;
  for (const Score &score : score_frames (scene, way, condition))
    sum += score;
  return sum;
}

} // namespace codedexposure::quality
