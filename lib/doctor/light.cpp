/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Check "light": its level, its field, and how steady it is. */
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "base/statistics.h"
#include "base/try.h"
#include "doctor/checks.h"
#include "doctor/field.h"
#include "doctor/light_fit.h"
#include "doctor/runs.h"
#include "doctor/stack.h"

namespace codedexposure
{

namespace
{

constexpr double kShortestRun = 130e-6; // s
constexpr int kFinestGrid = 256, kCoarsestGrid = 16;
constexpr int kLooks = 24, kFramesOfLook = 6;
constexpr int kLevelFrames = 12, kLaterFrames = 6;
/* Without a check of the trigger, runs keep that part of the period away from
 * its borders. */
constexpr double kBorder = 0.05;
/* Of the light to which an amplitude is related. */
constexpr double kGainError = 0.01;
/* Frames that beat with the light more slowly, Hz, seem to be in step. */
constexpr double kSlowBeat = 0.02;
/* The clock of a camera is that wrong, relative. */
constexpr double kClockError = 5e-5;

/** Slots of the check: of how many, and those of all light. */
Examination::Lit
slots_of (const Examination &examination)
{
  const Examination::Lit &inside = examination.inside;
  if (inside.of >= kCoarsestGrid)
    return inside;
  const int grid =
      std::clamp (int (examination.rig.parts ().period () / kShortestRun),
          kCoarsestGrid, kFinestGrid);
  double from = double (inside.first) / inside.of;
  double until = from + double (inside.slots) / inside.of;
  if (inside.of == 1) {
    from = kBorder;
    until = 1.0 - kBorder;
  }
  const int first = int (std::ceil (from * grid));
  return {first, std::max (1, int (until * grid) - first), grid};
}

/** Without what is seen in the dark. */
Image<float>
light_of (const Stack &lit, const Stack &dark)
{
  return dark.frames > 0 ? difference (lit.mean, dark.mean) : lit.mean;
}

class LightCheck
{
public:
  explicit LightCheck (Examination &examination)
      : examination_ (examination), parts_ (examination.rig.parts ()),
        all_ (slots_of (examination)), runs_ (examination, all_.of)
  {
  }

  Result<Finding> run ();

private:
  enum Exposure { kRun, kAll };
  /** Means of frames. */
  struct Seen {
    Stack stack;
    double mean = 0.0, peak = 0.0;
  };
  Seen put_together (const RunFrames &seen) const;
  Result<RunFrames> see_all (int frames)
  {
    return runs_.see (lit (all_.first, all_.slots), kAll, frames);
  }
  Result<RunFrames> walk (double scale);
  bool judge_level (const Seen &all, const Seen &dark);
  void judge_time ();
  void judge_flicker (const LightFit &fit);

  Examination &examination_;
  const RigParts &parts_;
  Examination::Lit all_;
  Runs runs_;
  Finding finding_{"light",
      "all mirrors on, and then in one short part of the exposure after the "
      "other"};
  bool saturated_ = false;
};

LightCheck::Seen
LightCheck::put_together (const RunFrames &seen) const
{
  return {stack_of (seen.frames, parts_.largest ()), seen.mean, seen.peak};
}

/** A short run here and there; the frames of the first one. */
Result<RunFrames>
LightCheck::walk (double scale)
{
  RunFrames first;
  for (int i = 0; i < kLooks; i++) {
    ASSIGN_OR_RETURN (RunFrames seen,
        runs_.see_one (i, all_.first, all_.slots, scale, kRun, kFramesOfLook));
    if (first.frames.empty ())
      first = std::move (seen);
    if (i == kLooks / 2)
      RETURN_IF_ERROR (see_all (kLaterFrames));
  }
  return first;
}

/** Whether there is enough light to look at it. */
bool
LightCheck::judge_level (const Seen &all, const Seen &dark)
{
  const double range = std::max (1.0, parts_.largest () - dark.mean);
  const Measured level{100.0 * (all.peak - dark.mean) / range, 0.0};
  /* Pixels that are bright without light are hot. */
  double full = 0.0;
  each_pixel (all.stack.mean, [&] (int x, int y) {
    full += all.stack.mean.at (x, y) > float (parts_.largest ()) - 0.5f &&
            (dark.stack.frames == 0 ||
                dark.stack.mean.at (x, y) < 0.2f * float (parts_.largest ()));
  });
  finding_.add ("level", level);
  saturated_ =
      finding_.measure ("saturated pixels",
          {100.0 * full / all.stack.mean.width () / all.stack.mean.height (),
              0.0}) != Verdict::pass;
  if (!saturated_)
    finding_.judge ("level", level);
  return verdict_of ("level", level) < Verdict::fail;
}

void
LightCheck::judge_flicker (const LightFit &fit)
{
  finding_.plots.push_back ({"Flicker of the light", "frequency, Hz",
      "part of the changes of the light that it explains", fit.spectrum});
  if (fit.lines.empty ())
    return finding_.add ("flicker", {0.0, 100.0 * fit.faintest});
  const auto &[ticks, seen] = fit.lines.front ();
  const Measured frequency{
      ticks.value, std::hypot (ticks.sigma, kClockError * ticks.value)};
  const Measured depth{
      seen.value, std::hypot (seen.sigma, kGainError * seen.value)};
  const auto &exposure = examination_.profile.exposure;
  const double seconds = exposure ? 1e-9 * exposure->value : parts_.period ();
  const double turn = std::numbers::pi * frequency.value * seconds;
  const double whole = std::abs (std::sin (turn) / turn);
  const double cycles = frequency.value * parts_.period ();
  const double beat =
      std::abs (cycles - std::round (cycles)) / parts_.period ();
  const std::string cause =
      "the light flickers by +-" + fixed (100.0 * depth.value, 1) + " % at " +
      fixed (frequency.value, 2) + " Hz" +
      (beat < kSlowBeat
              ? ", in step with the frames: all of them get the same light, "
                "but slots do not"
              : "; whole frames change by +-" +
                    fixed (100.0 * whole * depth.value, 1) + " % at " +
                    fixed (beat, 2) + " Hz");
  finding_.measure ("flicker", scaled (depth, 100.0), cause);
  finding_.readings.push_back ({"frequency of the flicker", frequency, "Hz"});
  finding_.readings.push_back (
      {"flicker of whole frames", scaled (depth, 100.0 * whole), "%"});
}

void
LightCheck::judge_time ()
{
  const BenchProfile &profile = examination_.profile;
  const auto seconds = [] (const std::optional<Measured> &time, double other) {
    return time ? 1e-9 * time->value : other;
  };
  const double length = seconds (profile.exposure, parts_.period ());
  const LightModel known{.period = parts_.period (),
      .start = seconds (profile.trigger_delay, 0.0),
      .lengths = {length, length}};
  if (saturated_)
    std::erase_if (runs_.samples,
        [] (const LightSample &sample) { return sample.exposure == kAll; });
  if (runs_.samples.size () < 30)
    return;
  const LightFit fit = fit_light (runs_.samples, known, {.window = false});
  judge_flicker (fit);
  const Measured drift = scaled (fit.drift, 6000.0); // % a minute
  // Light that grows saturates in the end.
  if (finding_.measure ("drift", drift) == Verdict::fail && saturated_ &&
      drift.value > 0.0)
    std::ranges::rotate (finding_.diagnoses, finding_.diagnoses.end () - 1);
}

Result<Finding>
LightCheck::run ()
{
  StillMask off = no_light ();
  off.first = all_.first;
  ASSIGN_OR_RETURN (const auto dark, runs_.see (off, kRun, kLaterFrames));
  runs_.samples.clear ();
  ASSIGN_OR_RETURN (auto all, see_all (kLevelFrames));
  if (all.frames.empty ()) {
    finding_.blame ("no-trigger", "no frame comes");
    return std::move (finding_);
  }
  const Seen without = put_together (dark), with = put_together (all);
  const bool enough = judge_level (with, without);
  if (examination_.exhibits)
    finding_.exhibits.push_back (
        {"All mirrors on", picture_of (light_of (with.stack, without.stack),
                               0.0, std::max (1.0, with.peak))});
  if (!enough)
    return std::move (finding_);
  const double level = (with.mean - without.mean) / parts_.largest ();
  ASSIGN_OR_RETURN (const auto run, walk (std::clamp (0.5 / level, 1.0, 4.0)));
  RETURN_IF_ERROR (see_all (kLaterFrames));
  judge_time ();
  const Image<float> field =
      saturated_ ? light_of (put_together (run).stack, without.stack)
                 : light_of (with.stack, without.stack);
  const Measured loss = corner_loss (field.view ());
  finding_.measure ("light lost in a corner", scaled (loss, 100.0));
  finding_.sort ();
  return std::move (finding_);
}

} // namespace

Result<Finding>
check_light (Examination &examination)
{
  return LightCheck (examination).run ();
}

} // namespace codedexposure
