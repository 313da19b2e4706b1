/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/engine.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "fuse/kriging.h"

namespace cexp::fuse
{

namespace
{

constexpr double kWhite = 255.0;
/* Light, as a part of white, at which the noise of filters is taken. */
constexpr double kTypicalLight = 0.4;
/* Noise of coded pixels, in units of the scene's variance, below which the
 * equations become ill-conditioned. */
constexpr double kLeastNoise = 1e-3;

/* Two scenes: all slots are alike; or they have less to do with each other than
 * in any scene. */
constexpr SceneClass kStill{0.0, 0.0, 5.0, 1.5, 1.0};
constexpr SceneClass kMoved{0.0, 0.0, 5.0, 1.5, 0.6};

/* Mean squared error, in grey levels, that means nothing. */
constexpr float kErrorFloor = 0.5f;
/* Weight below which a model has no say. */
constexpr float kLeastWeight = 0.01f;

/* Of the taps: far enough to see every slot several times. */
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

} // namespace

Result<std::unique_ptr<Engine>>
Engine::make (const Schedule &schedule, int width, int height,
    const FuseOptions &options, double steps)
{
  const int rows = height - schedule.pilot_rows ();
  const Extent cell = schedule.cell ();
  if (width < cell.width || rows < cell.height)
    return Error{"frames of " + std::to_string (width) + "x" +
                 std::to_string (height) + " pixels hold no cell of " +
                 schedule.text ()};
  if (options.lookahead < 0 || options.lookahead > 1)
    return Error{"lookahead " + std::to_string (options.lookahead) +
                 ": it must be 0 or 1 coded frames"};
  if (!find_kernels (options.target))
    return Error{"target " + in_quotes (options.target) +
                 " does not run on this machine; leave it empty"};
  const auto within = [] (double value, double most) {
    return value >= 0.0 && value <= most;
  };
  if (!within (options.noise.full_well, SensorNoise::kMaxFullWell) ||
      !within (options.noise.read_noise, SensorNoise::kMaxReadNoise))
    return Error{"a full well of " + real_text (options.noise.full_well) +
                 " and a read noise of " +
                 real_text (options.noise.read_noise) +
                 " electrons: they must lie in 0..1e7 and 0..1e5"};
  if (options.quality != FuseQuality::kFast &&
      schedule.slots () > Fuser<std::uint8_t>::kMaxSlots)
    return Error{"quality=" + std::string (quality_name (options.quality)) +
                 " knows motion for " +
                 std::to_string (Fuser<std::uint8_t>::kMaxSlots) +
                 " slots at most, and " + schedule.text () + " has " +
                 std::to_string (schedule.slots ()) + ": take quality=fast"};
  const Phases phases (schedule);
  if (phases.rows () * phases.period () > Fuser<std::uint8_t>::kMaxPhases)
    return Error{"the tile of " + schedule.text () + " has " +
                 std::to_string (phases.rows () * phases.period ()) +
                 " pixels with different neighbours, and fusion is made for " +
                 std::to_string (Fuser<std::uint8_t>::kMaxPhases) +
                 ": take a tile with a smaller period"};
  return std::unique_ptr<Engine> (
      new Engine (schedule, width, rows, options, steps));
}

Engine::Engine (const Schedule &schedule, int width, int height,
    const FuseOptions &options, double steps)
    : width_ (width), height_ (height),
      observation_ (schedule, options.noise, steps), phases_ (schedule),
      kernels_ (*find_kernels (options.target)),
      radius_ (tap_radius (schedule.slots ())),
      stillness_ (width, height, Stillness::radius_of (schedule.cell ()),
          !observation_.noise_free ())
{
  map_noise (schedule);
  find_margin (schedule);
  prepare (schedule, options);
}

void
Engine::map_noise (const Schedule &schedule)
{
  noise_ = {Field (width_, height_), Field (width_, height_)};
  if (observation_.gains ())
    gain_ = Field (width_, height_);
  for (int y = 0; y < height_; y++) {
    for (int x = 0; x < width_; x++) {
      const int element = schedule.element_at (x, y);
      const double dark = observation_.variance (element, 0.0);
      const double white = observation_.variance (element, 1.0);
      noise_.slope.row (y)[x] = float ((white - dark) * kWhite);
      noise_.offset.row (y)[x] = float (dark * kWhite * kWhite);
      if (!gain_.empty ())
        gain_.row (y)[x] = float (observation_.gain (element));
    }
  }
}

/* The margin mirrors the frame. Where elements see several slots, a pixel of it
 * repeats the pixel of its own element that lies closest to its mirror image:
 * weights of both signs add up to a slot only while the code keeps its phase.
 */
void
Engine::find_margin (const Schedule &schedule)
{
  const Field field (width_, height_, radius_);
  const int reach =
      std::max (schedule.tile ().period_x (), schedule.tile ().period_y ());
  const auto closest = [&] (int x, int y, int element) {
    Offset best{x, y};
    int least = 4 * reach * reach;
    for (int dy = -reach; dy <= reach; dy++) {
      if (dy * dy >= least || y + dy < 0 || y + dy >= height_)
        continue;
      for (int dx = -reach; dx <= reach; dx++) {
        const int distance = dx * dx + dy * dy;
        if (distance < least && x + dx >= 0 && x + dx < width_ &&
            schedule.element_at (x + dx, y + dy) == element) {
          least = distance;
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

/* Filters of every phase under the plain model, and under those of motion. */
void
Engine::prepare (const Schedule &schedule, const FuseOptions &options)
{
  const double scene = options.scene.contrast * options.scene.contrast;
  std::vector<double> noise;
  for (int e = 0; e < slots (); e++)
    noise.push_back (std::max (
        observation_.variance (e, kTypicalLight) / scene, kLeastNoise));
  std::vector<SceneClass> models;
  if (options.quality == FuseQuality::kFast)
    models = slots () > Fuser<std::uint8_t>::kMaxSlots
                 ? std::vector{options.scene.plain}
                 : std::vector{options.scene.creeping, options.scene.moving};
  std::vector<SceneClass> predicted{kStill, kMoved};
  if (models.size () > 1) {
    predicted.insert (predicted.end (), models.begin (), models.end ());
    creeping_ = Field (width_, height_);
  }
  predictions_.emplace (phases_, observation_, predicted, radius_ - 2,
      Stillness::radius_of (schedule.cell ()), Extent{width_, height_}, noise);
  for (const SceneClass &model : models)
    prepare_plain (model, noise);
  if (!models.empty ())
    return;
  motion_.emplace (phases_, observation_, motion_classes (), radius_, noise);
  if (options.quality == FuseQuality::kBest)
    likeness_.emplace (schedule, observation_, width_, height_);
  light_.assign (std::size_t (slots ()), Field (width_, height_));
}

void
Engine::prepare_plain (const SceneClass &model, std::span<const double> noise)
{
  const std::vector<Offset> taps = disc (radius_);
  const Covariance covariance (model, observation_, 2 * radius_);
  FilterBank &filters = plain_.emplace_back (phases_, taps, slots ());
  for (int row = 0; row < phases_.rows (); row++)
    for (int x = 0; x < phases_.period (); x++)
      filters.set_all (row, x,
          solve_phase (covariance, observation_, phases_, row, x, taps, noise)
              .slots);
}

Field &
Engine::next ()
{
  if (spare_.empty ())
    spare_ = Field (width_, height_, radius_);
  return spare_;
}

const float *
Engine::gain (int y) const
{
  return gain_.empty () ? nullptr : gain_.row (y);
}

void
Engine::take ()
{
  float *origin = spare_.row (0);
  for (const Repeat &repeat : margin_)
    origin[repeat.to] = origin[repeat.from];
  queue_.push_back (std::exchange (spare_, Field ()));
}

/* And which model of fast fits around each pixel. */
void
Engine::find_stillness (const Field &coded)
{
  predictions_->run (kernels_, coded, [&] (int y, const float *const *errors) {
    stillness_.doubt (y, errors[0], errors[1]);
    if (plain_.size () > 1)
      choose (y, errors[2], errors[3]);
  });
  stillness_.take (
      kernels_, coded, queue_.size () > 1 ? &queue_[1] : nullptr, noise_);
}

/* Weights as the inverse of the models' errors to the power of 8, which stands
 * for the number of independent errors in a square. */
void
Engine::choose (int y, const float *creeping, const float *moving)
{
  const float side = float (2 * stillness_.radius () + 1);
  const float floor = kErrorFloor * side * side;
  float *if_creeping = creeping_.row (y);
  for (int x = 0; x < width_; x++) {
    const float ratio =
        std::min ((creeping[x] + floor) / (moving[x] + floor), 1e3f);
    const float fourth = ratio * ratio * ratio * ratio;
    const float share = 1.0f / (1.0f + fourth * fourth);
    if_creeping[x] = std::clamp (
        (share - kLeastWeight) / (1.0f - 2.0f * kLeastWeight), 0.0f, 1.0f);
  }
}

/* Where the picture stands still it is the same in every slot. */
void
Engine::blend (int y, float *const *rows) const
{
  const float *weight = stillness_.weight (y), *light = stillness_.light (y);
  for (int s = 0; s < slots (); s++)
    for (int x = 0; x < width_; x++)
      rows[s][x] += weight[x] * (light[x] - rows[s][x]);
}

/* shares[model] = how far row @y is to be what the model says; the rest is
 * still. */
void
Engine::share_out (int y, Field &shares) const
{
  const float *still = stillness_.weight (y);
  float *first = shares.row (0);
  for (int x = 0; x < width_; x++)
    first[x] = 1.0f - still[x];
  if (plain_.size () == 1)
    return;
  const float *creeping = creeping_.row (y);
  float *second = shares.row (1);
  for (int x = 0; x < width_; x++) {
    second[x] = first[x] * (1.0f - creeping[x]);
    first[x] *= creeping[x];
  }
}

void
Engine::fuse_plainly (const Field &coded, const RowSink &sink)
{
  const auto offsets = plain_[0].offsets (coded);
  Field rows_of_slots (width_, slots ());
  Field shares (width_, int (plain_.size ()));
  std::vector<float *> rows;
  for (int s = 0; s < slots (); s++)
    rows.push_back (rows_of_slots.row (s));
  for (int y = 0; y < height_; y++) {
    const float *weight = stillness_.weight (y), *light = stillness_.light (y);
    for (int x = 0; x < width_; x++)
      rows[0][x] = weight[x] * light[x];
    for (std::size_t s = 1; s < rows.size (); s++)
      std::copy_n (rows[0], width_, rows[s]);
    share_out (y, shares);
    for (std::size_t model = 0; model < plain_.size (); model++)
      kernels_.filter_add (plain_[model].row (phases_, coded, y, offsets),
          shares.row (int (model)), rows.data ());
    sink (y, rows.data ());
  }
}

bool
Engine::fuse_motion (const Field &coded, const RowSink &sink, Workers &workers,
    std::stop_token stop)
{
  if (!motion_->run (kernels_, coded, light_, workers, stop))
    return false;
  if (likeness_ && !likeness_->run (kernels_, coded, typical_noise (), light_,
                       workers, stop))
    return false;
  std::vector<float *> rows (light_.size ());
  for (int y = 0; y < height_; y++) {
    for (std::size_t s = 0; s < rows.size (); s++)
      rows[s] = light_[s].row (y);
    blend (y, rows.data ());
    sink (y, rows.data ());
  }
  return true;
}

bool
Engine::fuse (const RowSink &sink, Workers &workers, std::stop_token stop)
{
  const Field &coded = queue_.front ();
  find_stillness (coded);
  bool done = true;
  if (!plain_.empty ())
    fuse_plainly (coded, sink);
  else
    done = fuse_motion (coded, sink, workers, std::move (stop));
  spare_ = std::move (queue_.front ());
  queue_.pop_front ();
  return done;
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
  stillness_.forget ();
}

} // namespace cexp::fuse
