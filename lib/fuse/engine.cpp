/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/engine.h"

#include <algorithm>
#include <cmath>

#include "base/targets.h"
#include "base/text.h"
#include "base/try.h"

namespace codedexposure
{

CODEDEXPOSURE_SUPPORTED (fuse::supported_kernels, fuse, fuse::Kernels, baseline)

} // namespace codedexposure

namespace codedexposure::fuse
{

namespace
{

constexpr double kWhite = 255.0;
static_assert (kMaxSparseSlots == Fuser<std::uint8_t>::kMaxSlots);
/* Light, as a part of white, at which the noise of filters is taken. */
constexpr double kTypicalLight = 0.4;
/* Standard deviation of a scene as a part of white; the ratio of noise to scene
 * follows from it. */
constexpr double kContrast = 0.25;
/* Noise of coded pixels, in units of the scene's variance, below which the
 * equations become ill-conditioned. */
constexpr double kMinNoise = 1e-3;

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

/* Of the surroundings of a pixel, which contain every slot. */
int
radius_around (Extent cell)
{
  return std::max (3, std::max (cell.width, cell.height) / 2 + 1);
}

Observation
observation_of (
    const Schedule &schedule, const SensorNoise &noise, double steps)
{
  const double white =
      noise.full_well * schedule.white_slots () / schedule.slots ();
  return {schedule, noise, white, steps};
}

std::vector<double>
relative_noise (const Observation &observation)
{
  std::vector<double> noise;
  for (int e = 0; e < observation.slots (); e++)
    noise.push_back (std::max (
        observation.variance (e, kTypicalLight) / (kContrast * kContrast),
        kMinNoise));
  return noise;
}

Result<void>
check (const FuseOptions &options)
{
  if (options.lookahead < 0 || options.lookahead > 1)
    return Error{"lookahead " + std::to_string (options.lookahead) +
                 ": it must be 0 or 1 coded frames"};
  constexpr int kMaxOverlap = Fuser<std::uint8_t>::kMaxOverlap;
  if (options.overlap < 1 || options.overlap > kMaxOverlap)
    return Error{"overlap " + std::to_string (options.overlap) + ": 1 to " +
                 std::to_string (kMaxOverlap) +
                 " exposures are fused for each coded frame"};
  if (options.overlap > 1 && options.lookahead == 0)
    return Error{"overlap needs the coded frame after the one that is fused; "
                 "set lookahead to 1"};
  constexpr int kMaxRange = Fuser<std::uint8_t>::kMaxRange;
  if (options.range < 1 || options.range > kMaxRange)
    return Error{"range " + std::to_string (options.range) +
                 ": white of fused frames must be 1 to " +
                 std::to_string (kMaxRange) + " times that of coded ones"};
  if (!find_kernels (options.target))
    return Error{"target " + in_quotes (options.target) +
                 " does not run on this machine; leave it empty"};
  const auto within = [] (double value, double max) {
    return value >= 0.0 && value <= max;
  };
  for (const SensorNoise &noise :
      {options.noise, options.partner_noise.value_or (options.noise)})
    if (!within (noise.full_well, SensorNoise::kMaxFullWell) ||
        !within (noise.read_noise, SensorNoise::kMaxReadNoise))
      return Error{"a full well of " + real_text (noise.full_well) +
                   " and a read noise of " + real_text (noise.read_noise) +
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
Engine::make (const Schedule &schedule, const Schedule *partner, int width,
    int height, const FuseOptions &options, double steps, std::stop_token stop)
{
  const int rows = height - schedule.pilot_rows ();
  const Extent cell = schedule.cell ();
  if (width < cell.width || rows < cell.height)
    return Error{"frames of " + size_text ({width, height}) +
                 " pixels hold no cell of " + schedule.text ()};
  RETURN_IF_ERROR (check (options));
  RETURN_IF_ERROR (check (schedule, options.quality));
  return std::unique_ptr<Engine> (new Engine (
      schedule, partner, {width, rows}, options, steps, std::move (stop)));
}

Engine::Engine (const Schedule &schedule, const Schedule *partner, Extent size,
    const FuseOptions &options, double steps, std::stop_token stop)
    : schedule_ (schedule), size_ (size), quality_ (options.quality),
      depth_ (steps),
      observation_ (observation_of (schedule, options.noise, steps)),
      partner_ (
          partner ? std::optional (observation_of (*partner,
                        options.partner_noise.value_or (options.noise), steps))
                  : std::nullopt),
      phases_ (schedule), kernels_ (*find_kernels (options.target)),
      noise_ (schedule, observation_, size)
{
  const int radius = tap_radius (slots ());
  const int around = radius_around (schedule.cell ());
  /* Parts of rows hold two columns of a block of predictions. */
  const int period = phases_.period () * (phases_.period () % 2 + 1);
  const Observation *of_partner = partner_ ? &*partner_ : nullptr;
  const float largest = float (options.range) *
                        std::max (largest_light (observation_),
                            of_partner ? largest_light (*of_partner) : 0.0f);
  const float pixel_steps = 65535.0f / largest;
  /* Only `balanced` and above follow motion into other coded frames. */
  sources_.emplace (SplitField (size.width, 0, radius, period),
      quality_ == FuseQuality::kFast ? int (kNeighbourRadius) : radius);
  plan_.emplace (FilterPlan{kernels_, phases_, observation_, *sources_,
      relative_noise (observation_), of_partner,
      of_partner ? relative_noise (*of_partner) : std::vector<double> (),
      radius, pixel_steps, options.lookahead > 0, std::move (stop)});
  stream_.emplace (kernels_, schedule, observation_, of_partner, size, radius,
      period, pixel_steps);
  static_pixels_.emplace (
      kernels_, noise_, size, around, !observation_.noise_free (), largest);
  if (partner)
    partner_fit_.emplace (kernels_, schedule, *partner_, size);
  Models models;
  if (quality_ == FuseQuality::kFast) {
    models = fast_models (slots ());
    linear_.emplace (*plan_, models, partner_fit_ ? &*partner_fit_ : nullptr);
  } else {
    motion_.emplace (*plan_);
    misfit_ = Field ((size.width + 1) / 2, (size.height + 1) / 2);
    if (!observation_.noise_free ())
      static_light_ = Field (size.width, size.height);
  }
  predictions_.emplace (*plan_, models, size, around);
  if (quality_ == FuseQuality::kBest) {
    collaborative_.emplace (
        kernels_, schedule, observation_, of_partner, size.width, size.height);
    if (partner)
      made_in_partner_ = Field (size.width, size.height);
  }
  if (options.refine)
    unrefined_ =
        options.range > 1
            ? "range " + std::to_string (options.range) +
                  ": the refinement was trained for light up to white"
            : Refiner::why_not (schedule, observation_, typical_noise ());
  if (options.refine && unrefined_.empty ())
    refiner_.emplace (kernels_, schedule, observation_, size.width, size.height,
        typical_noise ());
}

/* Static pixels are the same in every slot. */
void
Engine::blend_static (const StaticPixels::Found &still)
{
  const bool smooth = !static_light_.empty ();
  for (int y = 0; smooth && y < size_.height; y++) {
    float *to = static_light_.row (y);
    std::fill_n (to, size_.width, 0.0f);
    for (const Field &slot : light_)
      for (int x = 0; x < size_.width; x++)
        to[x] += slot.row (y)[x] / float (slots ());
  }
  if (smooth)
    static_pixels_->smooth (still, static_light_);
  for (Field &slot : light_)
    for (int y = 0; y < size_.height; y++) {
      const float *weight = still.weight.row (y);
      const float *light = (smooth ? static_light_ : still.light).row (y);
      float *to = slot.row (y);
      for (int x = 0; x < size_.width; x++)
        to[x] += weight[x] * (light[x] - to[x]);
    }
}

/* Whole frames, for the stages that look around. */
void
Engine::fill_light (
    const CodedFrames &frames, const Seen &seen, const Task &task)
{
  if (light_.empty ())
    light_.assign (std::size_t (slots ()), Field (size_.width, size_.height));
  const RowSink keep = [this] (int y, const float *const *rows) {
    for (std::size_t s = 0; s < light_.size (); s++)
      std::copy_n (rows[s], size_.width, light_[s].row (y));
  };
  if (linear_)
    return linear_->run (frames, seen.predicted, seen.still, keep, task);
  motion_->run (frames, light_, misfit_, task);
  if (collaborative_) {
    fit_partner (frames, task, &made_in_partner_);
    collaborative_->run (frames.now->light,
        frames.has_partner () ? &made_in_partner_ : nullptr, typical_noise (),
        light_, task);
  }
  blend_static (seen.still);
  fit_partner (frames, task);
}

/* What the network makes does not add up to what the partner saw. */
void
Engine::fill (const CodedFrames &frames, const Seen &seen, bool deviations,
    const Task &task)
{
  fill_light (frames, seen, task);
  if (!refiner_)
    return;
  refiner_->run (frames, seen.still.weight, light_,
      deviations ? &deviations_ : nullptr, task);
  fit_partner (frames, task);
}

/* Where the partner is not known, the first camera is all that there is. */
void
Engine::fill_clipped (const CodedFrames &frames, const Seen &seen,
    bool deviations, const Task &task)
{
  fill (frames.of_first (), seen, deviations, task);
  std::swap (light_, alone_);
  std::swap (deviations_, alone_deviations_);
  fill (
      frames, {predictions_->run (frames, task), seen.still}, deviations, task);
  const auto restore = [&] (std::vector<Field> &to,
                           const std::vector<Field> &from) {
    for (std::size_t s = 0; s < to.size (); s++)
      for (int y = 0; y < size_.height; y++) {
        const std::uint8_t *clipped =
            frames.now->clipped.data () + std::ptrdiff_t (y) * size_.width;
        for (int x = 0; x < size_.width; x++)
          if (clipped[x])
            to[s].row (y)[x] = from[s].row (y)[x];
      }
  };
  restore (light_, alone_);
  restore (deviations_, alone_deviations_);
}

void
Engine::fit_partner (const CodedFrames &frames, const Task &task, Field *made)
{
  if (!frames.has_partner ())
    return;
  constexpr int kMinRows = 16;
  run_bands (task, size_.height, kMinRows, [&] (const Band &band) {
    PartnerFit::Room room (*partner_fit_);
    std::vector<float *> rows (light_.size ());
    for (int y = band.first; y < band.end; y++) {
      for (std::size_t s = 0; s < rows.size (); s++)
        rows[s] = light_[s].row (y);
      partner_fit_->run (
          y, frames.now->partner.light.row (y), rows.data (), room);
      if (made)
        partner_fit_->make (y, rows.data (), made->row (y));
    }
  });
}

Engine::Seen
Engine::look (const CodedFrames &frames, const Task &task)
{
  plan_->stop = task.stop;
  const auto &predicted =
      predictions_->run (frames.clipped () ? frames.of_first () : frames, task);
  return {predicted, static_pixels_->take (frames, predicted.unrepeated, task)};
}

void
Engine::fuse_frame (const CodedFrames &frames, const RowSink &sink,
    const Task &task, const Uncertainty::Sink &deviations)
{
  const Seen seen = look (frames, task);
  const bool clipped = frames.clipped ();
  if (linear_ && !refiner_ && !deviations && !clipped)
    return linear_->run (frames, seen.predicted, seen.still, sink, task);
  const bool wanted = bool (deviations);
  if (clipped)
    fill_clipped (frames, seen, wanted, task);
  else
    fill (frames, seen, wanted, task);
  std::vector<const float *> rows (light_.size ());
  for (int y = 0; y < size_.height; y++) {
    for (std::size_t s = 0; s < rows.size (); s++)
      rows[s] = light_[s].row (y);
    sink (y, rows.data ());
  }
  if (!deviations)
    return;
  if (!uncertainty_)
    uncertainty_.emplace (schedule_, *plan_, quality_, size_, depth_);
  const Field &misfit = motion_ ? misfit_ : seen.predicted.misfit;
  uncertainty_->run (
      {frames, partner_fit_ ? &*partner_fit_ : nullptr, noise_, seen.still,
          misfit, light_, refiner_ ? &deviations_ : nullptr},
      deviations, task);
}

void
Engine::fuse (
    const RowSink &sink, const Task &task, const Uncertainty::Sink &deviations)
{
  fuse_frame (stream_->frames (), sink, task, deviations);
  stream_->advance ();
}

void
Engine::pass (Workers &workers)
{
  look (stream_->frames (), {workers, {}});
  stream_->advance ();
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
  stream_->forget ();
  static_pixels_->forget ();
}

} // namespace codedexposure::fuse
