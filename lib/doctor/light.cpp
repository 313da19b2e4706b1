/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Check "light": its level, its field, and how steady it is. */
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include "base/text.h"
#include "base/try.h"
#include "doctor/checks.h"
#include "doctor/field.h"
#include "doctor/level.h"
#include "doctor/light_fit.h"

namespace codedexposure
{

namespace
{

constexpr double kShortestRun = 130e-6; // s
constexpr int kFinestGrid = 256, kCoarsestGrid = 16;
/* The walk of a short run. Its places and lengths are spread evenly, and their
 * order is not that of time, so that no frequency hides. */
constexpr int kLooks = 24, kFramesOfLook = 6;
constexpr int kLevelFrames = 12, kLaterFrames = 6;
/* Without a check of the trigger, runs keep that part of the period away from
 * its borders. */
constexpr double kBorder = 0.05;

/* Parts: of the range, of pixels, of the light. */
constexpr double kDarkWarn = 0.4, kDarkFail = 0.15;
constexpr double kBrightWarn = 0.01, kBrightFail = 0.05;
constexpr double kFieldWarn = 0.25, kFieldFail = 0.4;
constexpr double kFlickerWarn = 0.01, kFlickerFail = 0.02;
constexpr double kDriftWarn = 0.02, kDriftFail = 0.05; // a minute

/* Of the light to which an amplitude is related. */
constexpr double kGainError = 0.01;
/* Frames that beat with the light more slowly, Hz, seem to be in step. */
constexpr double kSlowBeat = 0.02;
/* The clock of a camera is that wrong, relative. */
constexpr double kClockError = 5e-5;

std::string
percent (double part)
{
  char text[32];
  std::snprintf (text, sizeof text, "%.3g %%", 100.0 * part);
  return text;
}

double
fraction (double number)
{
  return number - std::floor (number);
}

bool
above (const Measured &number, double limit)
{
  return number.value - 2.0 * number.sigma > limit;
}

/** A mean of pictures. */
class Mean
{
public:
  void add (ImageView<const std::uint16_t> picture)
  {
    if (count_++ == 0)
      sum_ = Image<float> (picture.width, picture.height);
    for (int y = 0; y < picture.height; y++)
      for (int x = 0; x < picture.width; x++)
        sum_.at (x, y) += float (picture.at (x, y));
  }

  int count () const { return count_; }

  /** This mean less another one. */
  Image<float> less (const Mean &dark) const
  {
    Image<float> light = sum_;
    for (int y = 0; y < light.height (); y++)
      for (int x = 0; x < light.width (); x++) {
        light.at (x, y) /= float (count_);
        if (dark.count_ > 0)
          light.at (x, y) -= dark.sum_.at (x, y) / float (dark.count_);
      }
    return light;
  }

  /** Part of the pixels at @p largest that are far from it in @p dark: the
   * others are hot. */
  double saturated (const Mean &dark, int largest) const
  {
    double saturated = 0.0;
    for (int y = 0; y < sum_.height (); y++)
      for (int x = 0; x < sum_.width (); x++) {
        const float off =
            dark.count_ > 0 ? dark.sum_.at (x, y) / float (dark.count_) : 0.0f;
        saturated +=
            sum_.at (x, y) > (float (largest) - 0.5f) * float (count_) &&
            off < 0.2f * float (largest);
      }
    return saturated / std::max (1.0, double (sum_.width ()) * sum_.height ());
  }

private:
  Image<float> sum_;
  int count_ = 0;
};

class LightCheck
{
public:
  explicit LightCheck (Examination &examination);
  Result<Finding> run ();

private:
  enum Exposure { kRun, kAll };
  struct Seen {
    Mean picture;
    Level level; // mean of the levels
    int frames = 0;
  };
  void diagnose (
      const char *id, bool bad, std::string cause, std::string remedy);
  Result<Seen> see (const StillMask &mask, int frames);
  Result<Seen> see_all (int frames);
  Result<Seen> walk (double scale);
  bool judge_level (const Seen &all, const Seen &dark);
  void judge_field (const Seen &lit, const Seen &dark);
  void judge_time ();
  void judge_flicker (const LightFit &fit);
  void show_picture (const Seen &lit, const Seen &dark);

  Examination &examination_;
  int largest_;
  double period_;            // s
  int grid_, first_, slots_; // slots in the period, and those of all light
  Finding finding_{"light",
      "all mirrors on, and then in one short part of the exposure after the "
      "other"};
  std::vector<LightSample> samples_;
  bool saturated_ = false;
  int bits_seen_ = 0; // in any pixel value
};

LightCheck::LightCheck (Examination &examination)
    : examination_ (examination),
      largest_ ((1 << examination.rig.parts ().bits) - 1),
      period_ (
          1e-9 * double (examination.rig.parts ().rate.time_of (1000)) / 1000.0)
{
  const Examination::Lit &inside = examination.inside;
  if (inside.of >= kCoarsestGrid) {
    grid_ = inside.of;
    first_ = inside.first;
    slots_ = inside.slots;
    return;
  }
  grid_ = std::clamp (int (period_ / kShortestRun), kCoarsestGrid, kFinestGrid);
  double from = double (inside.first) / inside.of;
  double until = from + double (inside.slots) / inside.of;
  if (inside.of == 1) {
    from = kBorder;
    until = 1.0 - kBorder;
  }
  first_ = int (std::ceil (from * grid_));
  slots_ = std::max (1, int (until * grid_) - first_);
}

void
LightCheck::diagnose (
    const char *id, bool bad, std::string cause, std::string remedy)
{
  finding_.diagnoses.push_back ({id, bad ? Verdict::fail : Verdict::warn,
      std::move (cause), std::move (remedy)});
}

/** Frames of @p mask, which are samples if it is lit. */
Result<LightCheck::Seen>
LightCheck::see (const StillMask &mask, int frames)
{
  Seen seen;
  ASSIGN_OR_RETURN (const auto came, look (examination_, mask, grid_, frames));
  for (const SeenFrame &frame : came) {
    if (frame.damaged)
      continue;
    const Level level = level_of (frame.picture.view (), largest_);
    bits_seen_ |= level.bits_seen;
    const int step = bits_seen_ ? bits_seen_ & -bits_seen_ : 1; // DN
    seen.picture.add (frame.picture.view ());
    seen.frames++;
    seen.level.mean += level.mean;
    seen.level.peak += level.peak;
    samples_.push_back (
        {1e-9 * double (frame.time), period_ * mask.first / grid_,
            period_ * (mask.first + mask.slots) / grid_, level.mean,
            rounding_doubt (level.noise, step),
            mask.slots == slots_ ? kAll : kRun});
  }
  const double count = std::max (1, seen.frames);
  seen.level.mean /= count;
  seen.level.peak /= count;
  return seen;
}

Result<LightCheck::Seen>
LightCheck::see_all (int frames)
{
  return see (lit (first_, slots_), frames);
}

/** A short run here and there. @p scale: of its length. */
Result<LightCheck::Seen>
LightCheck::walk (double scale)
{
  using std::numbers::phi, std::numbers::sqrt2;
  Seen sum;
  for (int i = 0; i < kLooks; i++) {
    const double part = scale * (1.0 + fraction (i * sqrt2)) / 16.0;
    const int count = std::clamp (int (part * grid_), 1, slots_ - 1);
    const int room = slots_ - count;
    const int place = int (fraction ((i + 1) * phi) * (room + 1));
    ASSIGN_OR_RETURN (const Seen seen,
        see (lit (first_ + std::min (place, room), count), kFramesOfLook));
    if (sum.frames == 0)
      sum = seen;
    if (i == kLooks / 2)
      RETURN_IF_ERROR (see_all (kLaterFrames));
  }
  return sum;
}

/** Whether there is enough light to look at it. */
bool
LightCheck::judge_level (const Seen &all, const Seen &dark)
{
  const double range = std::max (1.0, largest_ - dark.level.mean);
  const double level = (all.level.peak - dark.level.mean) / range;
  finding_.readings.push_back (
      {"level", {100.0 * level, 0.0}, "%", "40 to 95"});
  const double saturated = all.picture.saturated (dark.picture, largest_);
  finding_.readings.push_back (
      {"saturated pixels", {100.0 * saturated, 0.0}, "%", "at most 1"});
  saturated_ = saturated > kBrightWarn;
  if (saturated_)
    diagnose ("bright", saturated > kBrightFail,
        "with all mirrors on, " + percent (saturated) +
            " of the pixels are saturated",
        "reduce the light or the iris until the brightest pixels are at 80 % "
        "of the range");
  else if (level < kDarkWarn)
    diagnose ("dark", level < kDarkFail,
        "with all mirrors on, the brightest pixels reach " + percent (level) +
            " of the range",
        "increase the light, open the iris, or increase the gain of the "
        "camera");
  return level >= kDarkFail;
}

void
LightCheck::judge_field (const Seen &lit, const Seen &dark)
{
  const Image<float> light = lit.picture.less (dark.picture);
  const Measured loss = corner_loss (light.view ());
  finding_.readings.push_back ({"light lost in a corner",
      {100.0 * loss.value, 100.0 * loss.sigma}, "%", "at most 25"});
  if (above (loss, kFieldWarn))
    diagnose ("vignetting", above (loss, kFieldFail),
        "the darkest corner has " + percent (loss.value) +
            " less light than the centre",
        "centre the light on the DMD, and check that no iris or mount cuts the "
        "beam");
}

void
LightCheck::judge_flicker (const LightFit &fit)
{
  finding_.plots.push_back ({"Flicker of the light", "frequency, Hz",
      "part of the changes of the light that it explains", fit.spectrum});
  if (fit.lines.empty ()) {
    finding_.readings.push_back (
        {"flicker", {0.0, 100.0 * fit.faintest}, "%", "at most 1"});
    return;
  }
  const auto &[ticks, seen] = fit.lines.front ();
  const Measured frequency{
      ticks.value, std::hypot (ticks.sigma, kClockError * ticks.value)};
  const Measured depth{
      seen.value, std::hypot (seen.sigma, kGainError * seen.value)};
  finding_.readings.push_back ({"flicker",
      {100.0 * depth.value, 100.0 * depth.sigma}, "%", "at most 1"});
  finding_.readings.push_back ({"frequency of the flicker", frequency, "Hz"});
  const auto &exposure = examination_.profile.exposure;
  const double seconds = exposure ? 1e-9 * exposure->value : period_;
  const double turn = std::numbers::pi * frequency.value * seconds;
  const double whole = depth.value * std::abs (std::sin (turn) / turn);
  const double cycles = frequency.value * period_;
  const double beat = std::abs (cycles - std::round (cycles)) / period_;
  finding_.readings.push_back ({"flicker of whole frames",
      {100.0 * whole, 100.0 * whole * depth.sigma / depth.value}, "%"});
  if (!above (depth, kFlickerWarn))
    return;
  char text[160];
  std::snprintf (text, sizeof text,
      "the light flickers by +-%.2g %% at %.2f Hz", 100.0 * depth.value,
      frequency.value);
  std::string cause = text;
  if (beat < kSlowBeat)
    cause += ", in step with the frames: all of them get the same light, but "
             "slots do not";
  else {
    std::snprintf (text, sizeof text,
        "; whole frames change by +-%.2g %% at %.2f Hz", 100.0 * whole, beat);
    cause += text;
  }
  diagnose ("flicker", above (depth, kFlickerFail), cause,
      "drive the light with a constant current, without mains ripple or PWM");
}

void
LightCheck::judge_time ()
{
  const BenchProfile &profile = examination_.profile;
  const auto seconds = [] (const std::optional<Measured> &time, double other) {
    return time ? 1e-9 * time->value : other;
  };
  const double length = seconds (profile.exposure, period_);
  const LightModel known{.period = period_,
      .start = seconds (profile.trigger_delay, 0.0),
      .lengths = {length, length}};
  if (saturated_)
    std::erase_if (samples_,
        [] (const LightSample &sample) { return sample.exposure == kAll; });
  if (samples_.size () < 30)
    return;
  const LightFit fit = fit_light (samples_, known, {.window = false});
  judge_flicker (fit);
  const Measured drift{60.0 * fit.drift.value, 60.0 * fit.drift.sigma};
  finding_.readings.push_back ({"drift",
      {100.0 * drift.value, 100.0 * drift.sigma}, "%/min", "-2 to 2"});
  const Measured size{std::abs (drift.value), drift.sigma};
  if (above (size, kDriftWarn))
    diagnose ("drift", above (size, kDriftFail),
        "the light changes by " + percent (drift.value) + " a minute",
        "wait until the light is warm, and drive it with a constant current");
  // Light that grows saturates in the end.
  if (saturated_ && above (drift, kDriftFail))
    std::ranges::rotate (finding_.diagnoses, finding_.diagnoses.end () - 1);
}

void
LightCheck::show_picture (const Seen &lit, const Seen &dark)
{
  if (!examination_.exhibits || lit.frames == 0)
    return;
  const Image<float> light = lit.picture.less (dark.picture);
  Exhibit exhibit{
      "All mirrors on", Image<std::uint8_t> (light.width (), light.height ())};
  const double scale = 255.0 / std::max (1.0, lit.level.peak);
  for (int y = 0; y < light.height (); y++)
    for (int x = 0; x < light.width (); x++)
      exhibit.picture.at (x, y) = std::uint8_t (
          std::clamp (scale * double (light.at (x, y)), 0.0, 255.0));
  finding_.exhibits.push_back (std::move (exhibit));
}

Result<Finding>
LightCheck::run ()
{
  StillMask off = lit (first_, 1);
  off.on = [] (int, int) { return false; };
  ASSIGN_OR_RETURN (const Seen dark, see (off, kLaterFrames));
  samples_.clear ();
  ASSIGN_OR_RETURN (const Seen all, see_all (kLevelFrames));
  if (all.frames == 0) {
    diagnose (
        "no-trigger", true, "no frame comes", "run the check of the trigger");
    return std::move (finding_);
  }
  const bool enough = judge_level (all, dark);
  show_picture (all, dark);
  if (!enough)
    return std::move (finding_);
  const double level = (all.level.mean - dark.level.mean) / largest_;
  ASSIGN_OR_RETURN (const Seen run, walk (std::clamp (0.5 / level, 1.0, 4.0)));
  RETURN_IF_ERROR (see_all (kLaterFrames));
  judge_time ();
  judge_field (saturated_ ? run : all, dark);
  std::ranges::stable_sort (
      finding_.diagnoses, std::ranges::greater (), &Diagnosis::severity);
  return std::move (finding_);
}

} // namespace

Result<Finding>
check_light (Examination &examination)
{
  return LightCheck (examination).run ();
}

} // namespace codedexposure
