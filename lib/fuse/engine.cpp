/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/engine.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "base/try.h"

namespace codedexposure::fuse
{

namespace
{

constexpr double kWhite = 255.0;
static_assert (StaticPixels::kMemory == Fuser<std::uint8_t>::kMaxHistory);
/* Light, as a part of white, at which the noise of filters is taken. */
constexpr double kTypicalLight = 0.4;
/* Noise of coded pixels, in units of the scene's variance, below which the
 * equations become ill-conditioned. */
constexpr double kMinNoise = 1e-3;

/* Mean squared errors of this size, in grey levels squared, do not tell models
 * apart. */
constexpr float kErrorFloor = 0.5f;
/* No model has less weight, so that there is always one. */
constexpr float kMinWeight = 1e-6f;

/* Of the taps: large enough to contain every slot several times. */
int
tap_radius (int slots)
{
  return std::clamp (int (std::ceil (1.8 * std::sqrt (slots))), 5, 8);
}

const Kernels *
find_kernels (std::string_view target)
{
  for (const Kernels &kernels : supported_kernels ())
    if (target.empty () || kernels.name == target)
      return &kernels;
  return nullptr;
}

/* Of a pixel, in grey levels times its gain. */
float
largest_light (const Observation &observation)
{
  double gain = 1.0;
  for (int e = 0; e < observation.slots (); e++)
    gain = std::max (gain, observation.gain (e));
  return float (gain * kWhite);
}

MotionFilter::Classes
classes_of_motion (const SceneModel &scene)
{
  MotionFilter::Classes classes{
      motion_classes (), lasting_classes (), passing_classes ()};
  for (const SceneClass &model : {scene.slow, scene.moving})
    classes.of_frame.push_back (model);
  for (const SceneClass &model :
      {scene.slow_over_frames, scene.medium_over_frames})
    classes.over_frames.push_back (model);
  return classes;
}

Result<void>
check (const FuseOptions &options)
{
  if (options.lookahead < 0 || options.lookahead > 1)
    return Error{"lookahead " + std::to_string (options.lookahead) +
                 ": it must be 0 or 1 coded frames"};
  if (!find_kernels (options.target))
    return Error{"target " + in_quotes (options.target) +
                 " does not run on this machine; leave it empty"};
  const auto within = [] (double value, double max) {
    return value >= 0.0 && value <= max;
  };
  if (!within (options.noise.full_well, SensorNoise::kMaxFullWell) ||
      !within (options.noise.read_noise, SensorNoise::kMaxReadNoise))
    return Error{"a full well of " + real_text (options.noise.full_well) +
                 " and a read noise of " +
                 real_text (options.noise.read_noise) +
                 " electrons: they must lie in 0.." +
                 real_text (SensorNoise::kMaxFullWell) + " and 0.." +
                 real_text (SensorNoise::kMaxReadNoise)};
  return {};
}

Result<void>
check (const Schedule &schedule, FuseQuality quality)
{
  constexpr int kMaxSlots = Fuser<std::uint8_t>::kMaxSlots;
  constexpr int kMaxPhases = Fuser<std::uint8_t>::kMaxPhases;
  if (quality != FuseQuality::kFast && schedule.slots () > kMaxSlots)
    return Error{
        schedule.text () + " has " + std::to_string (schedule.slots ()) +
        " slots; quality=" + std::string (quality_name (quality)) + " takes " +
        std::to_string (kMaxSlots) + " at most, use quality=fast"};
  const Phases phases (schedule);
  const int count = phases.rows () * phases.period ();
  if (count > kMaxPhases)
    return Error{"the tile of " + schedule.text () + " has " +
                 std::to_string (count) +
                 " pixels with different neighbours; fusion takes " +
                 std::to_string (kMaxPhases) +
                 " at most, use a tile with a smaller period"};
  return {};
}

} // namespace

Result<std::unique_ptr<Engine>>
Engine::make (const Schedule &schedule, int width, int height,
    const FuseOptions &options, double steps)
{
  const int rows = height - schedule.pilot_rows ();
  const Extent cell = schedule.cell ();
  if (width < cell.width || rows < cell.height)
    return Error{"frames of " + size_text ({width, height}) +
                 " pixels hold no cell of " + schedule.text ()};
  RETURN_IF_ERROR (check (options));
  RETURN_IF_ERROR (check (schedule, options.quality));
  return std::unique_ptr<Engine> (
      new Engine (schedule, width, rows, options, steps));
}

Engine::Engine (const Schedule &schedule, int width, int height,
    const FuseOptions &options, double steps)
    : width_ (width), height_ (height),
      observation_ (schedule, options.noise,
          options.noise.full_well * schedule.white_slots () / schedule.slots (),
          steps),
      phases_ (schedule), kernels_ (*find_kernels (options.target)),
      radius_ (tap_radius (schedule.slots ())),
      steps_ (65535.0f / largest_light (observation_)),
      static_pixels_ (width, height, StaticPixels::radius_of (schedule.cell ()),
          !observation_.noise_free (), largest_light (observation_))
{
  map_noise (schedule);
  find_margin (schedule);
  prepare (schedule, options);
  if (options.refine)
    unrefined_ = Refiner::why_not (schedule, observation_, typical_noise ());
  if (options.refine && unrefined_.empty ())
    refiner_.emplace (
        schedule, width, height, observation_.noise_free (), typical_noise ());
  make_uncertainty_ = [=, this, quality = options.quality,
                          scene = options.scene.moving] {
    const bool learned = refiner_ && quality == FuseQuality::kBest;
    uncertainty_.emplace (schedule, phases_, observation_,
        learned ? FuseQuality::kLearned : quality, scene, Extent{width, height},
        steps);
  };
}

void
Engine::map_noise (const Schedule &schedule)
{
  const int rows = std::min (height_, schedule.tile ().period_y ());
  noise_ = {Field (width_, rows), Field (width_, rows)};
  if (observation_.gains ())
    gain_ = Field (width_, height_);
  for (int y = 0; y < height_; y++) {
    for (int x = 0; x < width_; x++) {
      const int element = schedule.element_at (x, y);
      const double dark = observation_.variance (element, 0.0);
      const double white = observation_.variance (element, 1.0);
      if (y < rows) {
        noise_.slope.row (y)[x] = float ((white - dark) * kWhite);
        noise_.offset.row (y)[x] = float (dark * kWhite * kWhite);
      }
      if (!gain_.empty ())
        gain_.row (y)[x] = float (observation_.gain (element));
    }
  }
}

/* The margin mirrors the frame. If elements see several slots, a pixel of the
 * margin repeats the pixel of its own element that is closest to its mirror
 * image: the weights of a slot have both signs and fit only the code's phase.
 */
void
Engine::find_margin (const Schedule &schedule)
{
  const PairField field (width_, height_, radius_);
  const int reach =
      std::max (schedule.tile ().period_x (), schedule.tile ().period_y ());
  const auto closest = [&] (int x, int y, int element) {
    Offset best{x, y};
    int shortest = 4 * reach * reach;
    for (int dy = -reach; dy <= reach; dy++) {
      if (dy * dy >= shortest || y + dy < 0 || y + dy >= height_)
        continue;
      for (int dx = -reach; dx <= reach; dx++) {
        const int distance = dx * dx + dy * dy;
        if (distance < shortest && x + dx >= 0 && x + dx < width_ &&
            schedule.element_at (x + dx, y + dy) == element) {
          shortest = distance;
          best = {x + dx, y + dy};
        }
      }
    }
    return best;
  };
  for (int y = -radius_; y < height_ + radius_; y++) {
    const bool inside = y >= 0 && y < height_;
    for (int x = -radius_; x < width_ + radius_; x++) {
      if (inside && x == 0)
        x = width_;
      const Offset image{mirrored (x, width_), mirrored (y, height_)};
      const Offset from =
          observation_.exact ()
              ? image
              : closest (image.x, image.y, schedule.element_at (x, y));
      margin_.push_back (
          {y * field.stride () + x, from.y * field.stride () + from.x});
    }
  }
}

void
Engine::prepare (const Schedule &schedule, const FuseOptions &options)
{
  const double scene = options.scene.contrast * options.scene.contrast;
  std::vector<double> noise;
  for (int e = 0; e < slots (); e++)
    noise.push_back (
        std::max (observation_.variance (e, kTypicalLight) / scene, kMinNoise));
  FilterSets::Models models;
  if (options.quality == FuseQuality::kFast) {
    if (slots () > Fuser<std::uint8_t>::kMaxSlots)
      models.of_frame = {options.scene.plain};
    else
      models = {{options.scene.slow, options.scene.moving},
          {options.scene.slow_over_frames, options.scene.medium_over_frames,
              options.scene.moving}};
  }
  filters_.emplace (phases_, observation_, std::move (models), noise,
      FilterSets::Frames{
          width_, radius_, split_period (), steps_, options.lookahead > 0});
  predictions_.emplace (filters_->most_classes (),
      StaticPixels::radius_of (schedule.cell ()), Extent{width_, height_},
      split_period ());
  const Extent blocks = Predictions::blocks ({width_, height_});
  if (filters_->use_neighbours ())
    preferences_.assign (std::size_t (filters_->most_models ()),
        Field (blocks.width, blocks.height));
  if (filters_->estimate ())
    return;
  motion_.emplace (phases_, observation_, classes_of_motion (options.scene),
      radius_, noise, steps_);
  if (options.quality == FuseQuality::kBest)
    collaborative_.emplace (schedule, observation_, width_, height_);
  light_.assign (std::size_t (slots ()), Field (width_, height_));
  if (!observation_.noise_free ())
    static_light_ = Field (width_, height_);
}

/* Parts of rows hold two columns of a block of predictions. */
int
Engine::split_period () const
{
  return phases_.period () * (phases_.period () % 2 + 1);
}

Field &
Engine::next ()
{
  if (spare_.light.empty ())
    spare_ = {Field (width_, height_), PairField (width_, height_, radius_),
        SplitField (width_, height_, radius_, split_period ())};
  return spare_.light;
}

const float *
Engine::gain (int y) const
{
  return gain_.empty () ? nullptr : gain_.row (y);
}

void
Engine::take ()
{
  pair_pixels (spare_);
  queue_.push_back (std::exchange (spare_, Coded ()));
}

void
Engine::pair_pixels (Coded &coded) const
{
  for (int y = 0; y < height_; y++)
    kernels_.to_steps (
        coded.light.row (y), steps_, width_, coded.pairs.row (y));
  std::int32_t *origin = coded.pairs.row (0);
  for (const Repeat &repeat : margin_)
    origin[repeat.to] = origin[repeat.from];
  const Parts parts{
      split_period (), coded.split.stride (), width_ + 2 * radius_};
  for (int y = -radius_; y < height_ + radius_; y++) {
    std::int32_t *row = coded.pairs.row (y) - radius_;
    kernels_.pair (row, parts.count);
    kernels_.split_pairs (parts, row, coded.split.row (y));
  }
}

/* Rows that a thread takes at a time, an even number: all if there is one, as
 * neighbouring parts compute some rows twice. */
int
Engine::part_rows (const Workers &workers) const
{
  constexpr int kPartsPerThread = 2, kMinRows = 16;
  const int parts =
      workers.count () == 1 ? 1 : kPartsPerThread * workers.count ();
  const int rows = std::max ((height_ + parts - 1) / parts, kMinRows);
  return rows + rows % 2;
}

void
Engine::each_part (
    Workers &workers, const std::function<void (StaticPixels::Rows)> &use) const
{
  const int rows = part_rows (workers);
  workers.run ((height_ + rows - 1) / rows, [&] (int part, int worker) {
    const int first = part * rows;
    use ({first, std::min (first + rows, height_), worker});
  });
}

/* The mean squared error of the best model around the pixels of row @row of
 * blocks. */
void
Engine::set_misfit (int row, const float *const *errors, int models)
{
  const float area = float (predictions_->area ());
  const Extent blocks = Predictions::blocks ({width_, height_});
  const int end = row + 1 < blocks.height ? 2 * row + 2 : height_;
  for (int y = 2 * row; y < end; y++) {
    float *to = misfit_->row (y);
    for (int x = 0; x < width_; x++) {
      const int block = std::min (x / 2, blocks.width - 1);
      float least = errors[0][block];
      for (int k = 1; k < models; k++)
        least = std::min (least, errors[k][block]);
      to[x] = least / area + kErrorFloor;
    }
  }
}

/* Models are compared by the sums of their squared errors. Their power of 8
 * stands for the number of independent errors in a square. */
void
Engine::compare_predictions (const FilterSets::Set &filters,
    const SplitFrames &frames, StaticPixels::Rows rows)
{
  const float area = float (predictions_->area ());
  const int classes = filters.predictions.outputs ();
  const Extent blocks = Predictions::blocks ({width_, height_});
  std::vector<float *> to;
  predictions_->run (kernels_, phases_, filters.sources, filters.predictions,
      frames, rows.first / 2, std::min ((rows.end + 1) / 2, blocks.height),
      rows.worker, [&] (int row, const float *const *errors) {
        static_pixels_.set_errors (kernels_, row, predictions_->area (),
            errors[0], errors[classes - 1]);
        if (misfit_ && filters_->estimate ())
          set_misfit (row, errors + 1, classes - 1);
        if (preferences_.empty ())
          return;
        to.clear ();
        for (Field &preference : preferences_)
          to.push_back (preference.row (row));
        kernels_.prefer ({errors + 1, classes - 1, kErrorFloor * area,
                             kMinWeight, blocks.width},
            to.data ());
        for (float *preference : to)
          preference[blocks.width] = preference[blocks.width - 1];
      });
}

/* Static pixels are the same in every slot. */
void
Engine::blend (const float *light, int y, float *const *rows) const
{
  const float *weight = static_pixels_.weight (y);
  for (int s = 0; s < slots (); s++)
    for (int x = 0; x < width_; x++)
      rows[s][x] += weight[x] * (light[x] - rows[s][x]);
}

void
Engine::smooth_static_light (const StaticPixels::Frames &frames)
{
  for (int y = 0; y < height_; y++) {
    float *to = static_light_.row (y);
    std::fill_n (to, width_, 0.0f);
    for (const Field &slot : light_)
      for (int x = 0; x < width_; x++)
        to[x] += slot.row (y)[x] / float (slots ());
  }
  static_pixels_.smooth (kernels_, frames, static_light_);
}

/* The estimates of one row, in parts. */
struct Engine::Estimates {
  Parts parts;
  int blocks;                     ///< of a part, kRunBlock values each
  Field shares;                   ///< of the models, as rows
  Field split;                    ///< the same in parts
  Field light;                    ///< of the slots in parts
  Field rows;                     ///< of the slots
  Field still;                    ///< static light times its weight
  std::vector<std::uint8_t> kept; ///< blocks of each model
  std::vector<Run> runs;          ///< of one model
  std::vector<const std::int32_t *> sources;

  Estimates (int width, int period, int models, int slots)
      : parts{period, SplitField::split_length (width, period), width},
        blocks (int (parts.stride) / kRunBlock), shares (width, models),
        split (int (parts.stride) * period, models),
        light (int (parts.stride) * period, slots), rows (width, slots),
        still (width, 1), kept (std::size_t (models * blocks))
  {
  }

  void find_runs (int model)
  {
    runs.clear ();
    for (int b = 0; b < blocks; b++) {
      if (!kept[std::size_t (model * blocks + b)])
        continue;
      const int first = b * kRunBlock;
      if (!runs.empty () && runs.back ().first + runs.back ().count == first)
        runs.back ().count += kRunBlock;
      else
        runs.push_back ({first, kRunBlock});
    }
  }
};

void
Engine::share (const Field &coded, int y, Estimates &to) const
{
  std::vector<const float *> preferences;
  for (const Field &preference : preferences_)
    preferences.push_back (
        preference.row (std::min (y / 2, preference.height () - 1)));
  std::vector<float *> shares;
  for (int model = 0; model < to.shares.height (); model++)
    shares.push_back (to.shares.row (model));
  kernels_.share (
      {static_pixels_.weight (y), static_pixels_.light (coded, y),
          preferences.empty () ? nullptr : preferences.data (),
          int (shares.size ()), kRunBlock * to.parts.period, width_},
      to.still.row (0), shares.data (), to.kept.data ());
  for (int model = 0; model < to.shares.height (); model++)
    kernels_.split (to.parts, to.shares.row (model), to.split.row (model));
}

void
Engine::estimate (const FilterSets::Set &filters, const SplitFrames &frames,
    int y, Estimates &to) const
{
  const auto sources = filters.sources.row (frames, y, to.sources);
  for (int s = 0; s < slots (); s++)
    std::fill_n (to.light.row (s), to.light.width (), 0.0f);
  for (std::size_t model = 0; model < filters.estimates.size (); model++) {
    to.find_runs (int (model));
    for (int column = 0; column < to.parts.period; column++) {
      const auto at = column * to.parts.stride;
      for (int s = 0; s < slots (); s++)
        kernels_.filter_sparse_add (filters.estimates[model].row (phases_, y,
                                        column, s, sources, to.runs),
            to.split.row (int (model)) + at, to.light.row (s) + at);
    }
  }
  for (int s = 0; s < slots (); s++)
    kernels_.join (
        to.parts, to.light.row (s), to.still.row (0), to.rows.row (s));
}

void
Engine::fuse_linear (const FilterSets::Set &filters, const Field &coded,
    const SplitFrames &frames, const RowSink &sink,
    StaticPixels::Rows part) const
{
  Estimates estimates (
      width_, split_period (), int (filters.estimates.size ()), slots ());
  std::vector<const float *> rows;
  for (int s = 0; s < slots (); s++)
    rows.push_back (estimates.rows.row (s));
  for (int y = part.first; y < part.end; y++) {
    share (coded, y, estimates);
    estimate (filters, frames, y, estimates);
    sink (y, rows.data ());
  }
}

bool
Engine::fuse_motion (const StaticPixels::Frames &frames,
    const PairFrames &pairs, const RowSink &sink, Workers &workers,
    std::stop_token stop)
{
  const Field &coded = frames.coded;
  if (!motion_->run (kernels_, pairs, light_, misfit_, workers, stop))
    return false;
  if (collaborative_ && !collaborative_->run (kernels_, coded, typical_noise (),
                            light_, workers, stop))
    return false;
  const bool smooth = !static_light_.empty ();
  if (smooth)
    smooth_static_light (frames);
  std::vector<float *> rows (light_.size ());
  for (int y = 0; y < height_; y++) {
    for (std::size_t s = 0; s < rows.size (); s++)
      rows[s] = light_[s].row (y);
    blend (smooth ? static_light_.row (y) : static_pixels_.light (coded, y), y,
        rows.data ());
    sink (y, rows.data ());
  }
  return true;
}

bool
Engine::fuse (const RowSink &wanted, Workers &workers, std::stop_token stop,
    const Uncertainty::Sink &deviations)
{
  const Coded &coded = queue_.front ();
  if (deviations && !uncertainty_)
    make_uncertainty_ ();
  misfit_ = deviations ? &uncertainty_->misfit () : nullptr;
  const RowSink measured = [&] (int y, const float *const *slots) {
    uncertainty_->set_row (y, slots);
    wanted (y, slots);
  };
  const RowSink &sink = deviations ? measured : wanted;
  const RowSink estimated = [this] (int y, const float *const *slots) {
    refiner_->set_row (y, slots);
  };
  const RowSink &out = refiner_ ? estimated : sink;
  const StaticPixels::Frames frames{coded.light,
      previous_.light.empty () ? nullptr : &previous_.light,
      queue_.size () > 1 ? &queue_[1].light : nullptr, noise_};
  SplitFrames neighbours{nullptr, &coded.split, nullptr};
  if (filters_->use_neighbours ()) {
    if (!previous_.light.empty ())
      neighbours[0] = &previous_.split;
    if (queue_.size () > 1)
      neighbours[2] = &queue_[1].split;
  }
  const PairFrames all{previous_.light.empty () ? nullptr : &previous_.pairs,
      &coded.pairs, queue_.size () > 1 ? &queue_[1].pairs : nullptr};
  const FilterSets::Set &filters = filters_->for_frames (neighbours);
  predictions_->make_room (workers.count ());
  static_pixels_.make_room (workers.count ());
  each_part (workers, [&] (StaticPixels::Rows rows) {
    compare_predictions (filters, neighbours, rows);
    static_pixels_.compare (kernels_, frames, rows);
  });
  each_part (workers, [&] (StaticPixels::Rows rows) {
    static_pixels_.average (kernels_, frames, rows);
    if (filters_->estimate ())
      fuse_linear (filters, coded.light, neighbours, out, rows);
  });
  static_pixels_.finish (frames);
  bool done =
      filters_->estimate () || fuse_motion (frames, all, out, workers, stop);
  if (done && refiner_)
    done = refiner_->run (
        kernels_, coded.light,
        [this] (int y) { return static_pixels_.weight (y); }, sink, workers,
        stop);
  if (done && deviations)
    done = uncertainty_->run (kernels_, {coded.light, noise_, static_pixels_},
        deviations, workers, stop);
  spare_ = std::exchange (previous_, std::move (queue_.front ()));
  queue_.pop_front ();
  return done;
}

void
Engine::each_uncertain_row (const UseUncertain &use, Workers &workers) const
{
  uncertainty_->each_row (kernels_, {previous_.light, noise_, static_pixels_},
      [&] (int slot, int y, const Uncertainty::Pixel *pixels) {
        use (slot, y, pixels, static_pixels_.weight (y));
      },
      workers, {});
}

double
Engine::typical_noise () const
{
  return observation_.noise_free ()
             ? 0.0
             : kWhite * std::sqrt (observation_.variance (0, kTypicalLight));
}

void
Engine::forget ()
{
  queue_.clear ();
  previous_ = {};
  static_pixels_.forget ();
}

} // namespace codedexposure::fuse
