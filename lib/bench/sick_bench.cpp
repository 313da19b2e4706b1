/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/sick_bench.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/pixels.h"
#include "base/statistics.h"
#include "base/try.h"
#include "bench/bench_view.h"
#include "bench/random.h"
#include "bench/sensor.h"

namespace codedexposure
{

namespace
{

/* Masks that frames may still show. */
constexpr std::size_t kRemembered = 8;
constexpr std::size_t kPast = 32;
/* Pictures of masks that are kept: of large ones, so many bytes. */
constexpr std::size_t kPictures = 32, kFewPictures = 4, kKept = 200'000'000;

/* What a number is drawn for. */
enum Purpose : std::uint32_t {
  kPhase,
  kPlace,
  kHeat,
  kSensitivity,
  kDust,
  kJitter,
  kLateness,
  kLoss,
};

/** In 0..1, by the seed and what it is for. */
double
draw (const SickBenchOptions &options, Purpose purpose, std::uint64_t number)
{
  const Philox::Words words = Philox::draw (
      {std::uint32_t (number), std::uint32_t (number >> 32), purpose, 0xBE7C},
      {std::uint32_t (options.seed), std::uint32_t (options.seed >> 32)});
  return (words[0] + 0.5) * 0x1p-32;
}

double
draw_normal (
    const SickBenchOptions &options, Purpose purpose, std::uint64_t number)
{
  const double u = draw (options, purpose, 2 * number);
  const double v = draw (options, purpose, 2 * number + 1);
  return std::sqrt (-2.0 * std::log (u)) *
         std::cos (2.0 * std::numbers::pi * v);
}

} // namespace

Result<SickBench>
SickBench::make (const SickBenchOptions &options)
{
  for (const Extent size : {options.camera, options.mirrors})
    if (size.width < 8 || size.height < 8 || size.width > Mapping::kMaxSize ||
        size.height > Mapping::kMaxSize)
      return Error{"a bench needs cameras and mirrors of 8x8 to 16384x16384"};
  if (options.bits < 8 || options.bits > 16)
    return Error{
        "a bench has 8 to 16 bits, not " + std::to_string (options.bits)};
  ASSIGN_OR_RETURN (Mapping mapping, mapping_of (options));
  SickBench bench (options, std::move (mapping));
  if (bench.longest () <= 0)
    return Error{"nothing is left of the frame period for the exposure; use "
                 "shorter times or a lower rate"};
  if (bench.view_.width < 1 || bench.view_.height < 1)
    return Error{"the camera sees no mirror; use a smaller shift"};
  bench.measure_field ();
  return bench;
}

SickBench::SickBench (const SickBenchOptions &options, Mapping mapping)
    : options_ (options), mapping_ (std::move (mapping)), processing_ (options)
{
  constexpr double kMinute = 60.0;
  light_over_time_ = {options.flicker_rate, options.flicker_depth,
      2.0 * std::numbers::pi * draw (options, kPhase, 0),
      options.drift / kMinute, options.pulse_rate, options.pulse_duty};
  find_view ();
  draw_defects ();
  draw_groups ();
  fill_profile ();
}

/* The mirrors that the border of the frame sees, and what a blur reaches. */
void
SickBench::find_view ()
{
  const int width = options_.camera.width, height = options_.camera.height;
  const Extent mirrors = options_.mirrors;
  const double margin = 16.0 + 6.0 * options_.blur;
  double left = 1e9, top = 1e9, right = -1e9, bottom = -1e9;
  each_pixel (options_.camera, [&] (int x, int y) {
    if (x % (width - 1) != 0 && y % (height - 1) != 0)
      return;
    const Position at = mapping_.mirror_at (x, y);
    left = std::min (left, at.x - margin);
    right = std::max (right, at.x + margin);
    top = std::min (top, at.y - margin);
    bottom = std::max (bottom, at.y + margin);
  });
  const int x = int (std::clamp (left, 0.0, double (mirrors.width)));
  const int y = int (std::clamp (top, 0.0, double (mirrors.height)));
  view_ = {x, y, int (std::clamp (right, 0.0, double (mirrors.width))) - x,
      int (std::clamp (bottom, 0.0, double (mirrors.height))) - y};
  constexpr double kLeastBlur = 0.05; // pictures of other sizes need one
  lens_ =
      std::make_unique<Lens> (Alignment{}, std::max (kLeastBlur, options_.blur),
          width, height, mapping_, Offset{view_.x, view_.y});
}

/** Not at the border, where the picture of the mirrors may end. */
Offset
SickBench::draw_pixel ()
{
  const auto along = [this] (int size) {
    return int (size * (0.08 + 0.84 * draw (options_, kPlace, places_++)));
  };
  const int x = along (options_.camera.width);
  return {x, along (options_.camera.height)};
}

Offset
SickBench::draw_mirror ()
{
  const Offset pixel = draw_pixel ();
  const Position at = mapping_.mirror_at (pixel.x, pixel.y);
  return {int (std::lround (at.x)), int (std::lround (at.y))};
}

void
SickBench::draw_defects ()
{
  for (int i = 0; i < options_.hot_pixels; i++) {
    const double heat = 0.2 + 0.7 * draw (options_, kHeat, std::uint64_t (i));
    hot_.push_back ({draw_pixel (), float (heat)});
    truth_.hot.push_back (hot_.back ().at);
  }
  for (int i = 0; i < options_.dead_pixels; i++)
    truth_.dead.push_back (draw_pixel ());
  for (int i = 0; i < options_.stuck_on; i++)
    truth_.stuck_on.push_back (draw_mirror ());
  for (int i = 0; i < options_.stuck_off; i++)
    truth_.stuck_off.push_back (draw_mirror ());
  for (int i = 0; i < options_.dust; i++)
    truth_.dust.push_back (draw_pixel ());
}

/** Defects of whole rows and of blocks. */
void
SickBench::draw_groups ()
{
  constexpr int kBlock = 16;
  const auto add = [] (std::vector<Offset> &to, const Rect &all) {
    each_pixel (Extent{all.width, all.height}, [&] (int x, int y) {
      to.push_back ({all.x + x, all.y + y});
    });
  };
  const Extent camera = options_.camera;
  for (int i = 0; i < options_.dead_rows; i++)
    add (truth_.dead, {0, draw_pixel ().y, camera.width, 1});
  for (int i = 0; i < options_.dead_blocks; i++) {
    const Offset at = draw_pixel ();
    add (truth_.dead,
        {std::min (at.x, camera.width - kBlock),
            std::min (at.y, camera.height - kBlock), kBlock, kBlock});
  }
  for (int i = 0; i < options_.stuck_rows; i++)
    add (truth_.stuck_off, {0, draw_mirror ().y, options_.mirrors.width, 1});
  for (int i = 0; i < options_.stuck_blocks; i++) {
    const Offset at = draw_mirror ();
    add (truth_.stuck_off, {at.x, at.y, kBlock, kBlock});
  }
}

void
SickBench::fill_profile ()
{
  const SickBenchOptions &o = options_;
  truth_.options = o;
  BenchProfile &profile = truth_.profile;
  profile.measured = std::chrono::sys_seconds{};
  profile.camera.size = o.camera;
  profile.dmd = BenchProfile::Device{.size = o.mirrors};
  profile.bits = o.bits;
  const auto exact = [] (double value) { return Measured{value, 0.0}; };
  profile.conversion_gain =
      exact (o.full_well / (profile.largest () - o.black_level));
  profile.full_well = exact (o.full_well);
  profile.read_noise = exact (o.read_noise);
  profile.black_level = exact (o.black_level);
  profile.linearity_error = exact (std::abs (o.nonlinear));
  profile.leak = exact (o.leak);
  profile.trigger_delay = exact (double (delay ()));
  profile.exposure = exact (double (longest ()));
  profile.psf_sigma = exact (o.blur);
  profile.mapping = mapping_;
}

Nanoseconds
SickBench::delay () const
{
  return options_.delay + options_.edge + options_.late;
}

Nanoseconds
SickBench::longest () const
{
  using Trigger = SickBenchOptions::Trigger;
  const Nanoseconds period = options_.rate.period ();
  if (options_.trigger == Trigger::free_running)
    return Nanoseconds (1e9 / options_.free_rate) - options_.readout;
  if (options_.trigger == Trigger::double_rate)
    return period / 2 - options_.readout;
  if (options_.ends_early)
    return period - *options_.ends_early - delay ();
  return period - options_.readout;
}

/** Of the next shot. A camera that exposes for too long always does. */
Nanoseconds
SickBench::exposed_time () const
{
  const Nanoseconds whole = options_.rate.period () - options_.readout;
  if (options_.auto_exposure > 0.0)
    return Nanoseconds (double (longest ()) * processing_.exposure ());
  const Nanoseconds asked =
      exposure_ ? std::min (*exposure_, whole) : longest ();
  if (exposure_ && options_.ends_early && longest () > whole)
    return asked + longest () - whole;
  return std::min (asked, longest ());
}

/** Mirrors of the view through a mask, those that are stuck included. */
Image<float>
SickBench::mirrors_of (const MirrorProgram::Mask &mask) const
{
  Image<float> mirrors (view_.width, view_.height);
  each_pixel (Extent{view_.width, view_.height}, [&] (int x, int y) {
    const int mx = x + view_.x, my = y + view_.y;
    const bool known = mx < mask->width () && my < mask->height ();
    mirrors.at (x, y) = known && mask->at (mx, my) != 0 ? 1.0f : 0.0f;
  });
  for (const auto *stuck : {&truth_.stuck_on, &truth_.stuck_off})
    for (const Offset at : *stuck)
      if (view_.holds (at.x, at.y))
        mirrors.at (at.x - view_.x, at.y - view_.y) =
            stuck == &truth_.stuck_on ? 1.0f : 0.0f;
  return mirrors;
}

void
SickBench::look (const Image<float> &mirrors, Image<float> &seen)
{
  if (seen.width () == 0)
    seen = Image<float> (options_.camera.width, options_.camera.height);
  lens_->image (mirrors.view (), seen.view ());
  if (options_.focus_tilt > 0.0)
    blur_with_tilt (options_, seen);
}

/** Light that reaches a pixel: vignetting, dust, and its own sensitivity. */
float
SickBench::passed_by (int x, int y, const std::vector<float> &dust) const
{
  const Position c = centre_of (options_.camera);
  const double dx = x - c.x, dy = y - c.y;
  double passed =
      1.0 - options_.vignetting * (dx * dx + dy * dy) / (c.x * c.x + c.y * c.y);
  for (std::size_t i = 0; i < dust.size (); i++) {
    const Offset at = truth_.dust[i];
    const double distance = std::hypot (x - at.x, y - at.y) / dust[i];
    passed *= 1.0 - 0.85 / (1.0 + std::pow (distance, 6.0));
  }
  const auto pixel = std::uint64_t (y) * std::uint64_t (options_.camera.width) +
                     std::uint64_t (x);
  const double own =
      options_.prnu > 0.0
          ? 1.0 + options_.prnu * draw_normal (options_, kSensitivity, pixel)
          : 1.0;
  return float (options_.level * passed * std::max (0.0, own));
}

void
SickBench::measure_field ()
{
  const auto &[width, height] = options_.camera;
  for (Image<float> *image : {&on_, &off_, &leaked_, &field_, &light_})
    *image = Image<float> (width, height);
  std::vector<float> dust; // radii, pixels
  for (std::size_t i = 0; i < truth_.dust.size (); i++)
    dust.push_back (3.0f + 5.0f * float (draw (options_, kDust, i)));

  const Extent size = options_.mirrors;
  const auto none =
      std::make_shared<Image<std::uint8_t>> (size.width, size.height);
  const auto all = std::make_shared<Image<std::uint8_t>> (*none);
  each_pixel (size, [&] (int x, int y) { all->at (x, y) = 1; });
  Image<float> bare (view_.width, view_.height);
  each_pixel (Extent{view_.width, view_.height},
      [&] (int x, int y) { bare.at (x, y) = 1.0f; });
  look (bare, leaked_);
  look (mirrors_of (all), on_);
  look (mirrors_of (none), off_);
  const float leak = float (options_.leak);
  each_pixel (options_.camera, [&] (int x, int y) {
    const float passed = passed_by (x, y, dust);
    field_.at (x, y) = passed * (1.0f - leak);
    leaked_.at (x, y) *= passed * leak;
    for (Image<float> *image : {&on_, &off_})
      image->at (x, y) =
          leaked_.at (x, y) + field_.at (x, y) * image->at (x, y);
  });
}

void
SickBench::show (Nanoseconds time, MirrorProgram program)
{
  park (time);
  Shown shown{.start = time, .program = std::move (program)};
  for (MirrorProgram::Mask &mask : shown.program.masks) {
    const auto rows = mask->view ();
    std::int64_t on = 0;
    for (int y = 0; y < rows.height; y++)
      on +=
          rows.width - std::count (rows.row (y), rows.row (y) + rows.width, 0);
    const auto every = std::int64_t (rows.width) * rows.height;
    using Kind = Shown::Kind;
    shown.kinds.push_back (on == 0       ? Kind::off
                           : on == every ? Kind::on
                                         : Kind::picture);
    if (shown.kinds.back () != Kind::picture)
      mask.reset ();
  }
  shown_.push_back (std::move (shown));
  for (; shown_.size () > kRemembered && at_ > 0; at_--)
    shown_.pop_front ();
}

void
SickBench::park (Nanoseconds time)
{
  if (!shown_.empty ())
    shown_.back ().stop = std::min (shown_.back ().stop, time);
}

std::optional<Nanoseconds>
SickBench::next_trigger (Nanoseconds until)
{
  using Trigger = SickBenchOptions::Trigger;
  if (options_.trigger == Trigger::none)
    return std::nullopt;
  if (options_.trigger == Trigger::free_running) {
    const auto time =
        Nanoseconds (double (triggers_) * 1e9 / options_.free_rate);
    if (time >= until)
      return std::nullopt;
    triggers_++;
    return time;
  }
  for (; at_ < shown_.size (); at_++, triggers_ = 0) {
    const Shown &shown = shown_[at_];
    const Nanoseconds period = shown.program.period;
    const Nanoseconds step = options_.trigger == Trigger::half_rate ? 2 * period
                             : options_.trigger == Trigger::double_rate
                                 ? period / 2
                                 : period;
    const Nanoseconds time = shown.start + triggers_ * step;
    if (time >= until && time < shown.stop)
      return std::nullopt;
    if (time < shown.stop) {
      triggers_++;
      return time;
    }
    if (at_ + 1 == shown_.size ())
      return std::nullopt; // parked; another one may follow
  }
  return std::nullopt;
}

std::optional<Shot>
SickBench::next (Nanoseconds until)
{
  const auto trigger = next_trigger (until);
  if (!trigger)
    return std::nullopt;
  Shot shot{.number = shots_++, .trigger = *trigger};
  const double jitter =
      options_.jitter * draw_normal (options_, kJitter, shot.number);
  const Nanoseconds length = exposed_time ();
  shot.begin =
      *trigger + std::max<Nanoseconds> (0, delay () + Nanoseconds (jitter));
  shot.end = shot.begin + length;
  shot.lost = draw (options_, kLoss, shot.number) < options_.lose;
  past_.push_back (shot);
  if (past_.size () > kPast)
    past_.pop_front ();
  return shot;
}

/** The exposure that is in the frame of @p shot. */
const Shot &
SickBench::exposed_for (const Shot &shot) const
{
  constexpr std::uint64_t kUnchanged = 10; // frames
  std::size_t late = std::size_t (options_.frame_late);
  if (options_.late_varies)
    late += std::size_t (
        3.0 * draw (options_, kLateness, shot.number / kUnchanged));
  const std::uint64_t oldest = past_.front ().number;
  return past_[std::size_t (
      std::max (shot.number, oldest + late) - late - oldest)];
}

void
SickBench::add_light (const Shot &shot, const ExposureLight &exposure,
    const Shown &shown, Passed &passed) const
{
  const MirrorProgram &program = shown.program;
  if (shot.end <= shown.start || shown.stop <= shot.begin - options_.switching)
    return;
  const Nanoseconds cycle = program.period * program.periods;
  /* Slips may bring in the cycle before. */
  const std::int64_t first = std::max<std::int64_t> (
      0, (shot.begin - options_.switching - shown.start) / cycle - 1);
  for (std::int64_t n = first;; n++) {
    const Nanoseconds start = shown.start + n * cycle;
    if (start >= shot.end || start >= shown.stop)
      return;
    const Nanoseconds slips =
        options_.slip_every > 0 ? n * cycle / options_.slip_every : 0;
    const Nanoseconds origin = start + slips * program.slot % cycle;
    for (const MirrorProgram::Stretch &stretch : program.stretches) {
      const Shown::Kind kind = shown.kinds[stretch.mask];
      if (kind == Shown::Kind::off)
        continue;
      const double light =
          exposure.through (std::min (origin + stretch.begin, shown.stop),
              std::min (origin + stretch.end, shown.stop));
      if (light == 0.0)
        continue;
      if (kind == Shown::Kind::on)
        passed.on += light;
      else
        passed.add (program.masks[stretch.mask], light);
    }
  }
}

/** Sets rows of light_ to those of an exposure. */
void
SickBench::collect_rows (const Shot &shot, const Rows &rows)
{
  const ExposureLight exposure (
      light_over_time_, shot.begin, shot.end, options_.switching);
  Passed passed;
  for (const Shown &shown : shown_)
    add_light (shot, exposure, shown, passed);
  const double unit =
      1e-9 * double (options_.rate.period () - options_.readout);
  double dark = exposure.whole () - passed.on;
  for (const auto &[mask, light] : passed.pictures)
    dark -= light;
  const float on = float (passed.on / unit), off = float (dark / unit);
  for (int y = rows.begin; y < rows.end; y++) {
    float *light = light_.view ().row (y);
    const float *a = on_.view ().row (y), *b = off_.view ().row (y);
    for (int x = 0; x < light_.width (); x++)
      light[x] = on * a[x] + off * b[x];
  }
  if (!passed.pictures.empty ())
    add_pictures (passed, unit, rows);
}

/** Sets light_ to that of an exposure. */
void
SickBench::collect (const Shot &shot)
{
  const int height = light_.height ();
  const int bands = options_.rolling > 0 ? std::min (height, 16) : 1;
  for (int i = 0; i < bands; i++) {
    const Nanoseconds late = options_.rolling * i / std::max (1, bands - 1);
    Shot band = shot;
    band.begin += late;
    band.end += late;
    collect_rows (band, {height * i / bands, height * (i + 1) / bands});
  }
  if (options_.texture > 0.0)
    look_at_target (options_, 1e-9 * double (shot.begin), light_.view ());
  if (options_.colour)
    filter_colours (light_.view ());
  const double unit =
      1e-9 * double (options_.rate.period () - options_.readout);
  const float exposed = float (1e-9 * double (shot.end - shot.begin) / unit);
  for (const HotPixel &hot : hot_)
    light_.at (hot.at.x, hot.at.y) += hot.light * exposed;
  for (const Offset dead : truth_.dead)
    light_.at (dead.x, dead.y) = 0.0f;
}

/** The picture of a mask, which is kept while it is shown. */
const Image<float> &
SickBench::picture_of (const MirrorProgram::Mask &mask)
{
  const auto known = std::ranges::find (seen_, mask, &Seen::mask);
  if (known != seen_.end ())
    return known->picture;
  const std::size_t bytes =
      sizeof (float) * std::size_t (view_.width) * std::size_t (view_.height);
  if (seen_.size () >= std::clamp (kKept / bytes, kFewPictures, kPictures))
    seen_.pop_front ();
  seen_.push_back ({mask, {}});
  look (mirrors_of (mask), seen_.back ().picture);
  return seen_.back ().picture;
}

/** One picture in place of those of many masks. */
void
SickBench::add_sum (const Passed &passed, double unit, const Rows &rows)
{
  Image<float> sum (view_.width, view_.height);
  float all = 0.0f;
  for (const auto &[mask, light] : passed.pictures) {
    const Image<float> mirrors = mirrors_of (mask);
    const float part = float (light / unit);
    all += part;
    for (int y = 0; y < sum.height (); y++)
      for (int x = 0; x < sum.width (); x++)
        sum.at (x, y) += part * mirrors.at (x, y);
  }
  Image<float> seen;
  look (sum, seen);
  add_picture (seen, all, 1.0f, rows);
}

/** Adds @p light that leaks, and @p part of what is @p seen. */
void
SickBench::add_picture (
    const Image<float> &seen, float light, float part, const Rows &rows)
{
  for (int y = rows.begin; y < rows.end; y++) {
    float *out = light_.view ().row (y);
    const float *leaked = leaked_.view ().row (y);
    const float *field = field_.view ().row (y);
    const float *in = seen.view ().row (y);
    for (int x = 0; x < light_.width (); x++)
      out[x] += light * leaked[x] + part * field[x] * in[x];
  }
}

void
SickBench::add_pictures (const Passed &passed, double unit, const Rows &rows)
{
  if (passed.pictures.size () > kPictures / 2)
    return add_sum (passed, unit, rows);
  for (const auto &[mask, light] : passed.pictures) {
    const float part = float (light / unit);
    add_picture (picture_of (mask), part, part, rows);
  }
}

void
SickBench::read_out (const Shot &shot, ImageView<std::uint16_t> picture)
{
  const int largest = largest_pixel (options_.bits);
  const double clamped = options_.black_clamp > 0.0
                             ? options_.black_clamp * largest *
                                   mean_of (std::as_const (light_).view ())
                             : 0.0;
  const Sensor sensor{.full_well = options_.full_well,
      .read_noise = options_.read_noise,
      .gain = processing_.gain () * (largest - options_.black_level) / largest,
      .black_level = options_.black_level - clamped,
      .bits = options_.bits,
      .seed = options_.seed,
      .bow = options_.nonlinear};
  sensor.read_out<std::uint16_t> (light_.view (), 1.0, shot.number, picture);
  processing_.apply (picture);
}

void
SickBench::take (const Shot &shot, ImageView<std::uint16_t> picture)
{
  collect (exposed_for (shot));
  read_out (shot, picture);
}

} // namespace codedexposure
