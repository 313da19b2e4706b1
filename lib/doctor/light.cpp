/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Check "light": its level, its field, and how steady it is. */
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "base/statistics.h"
#include "base/try.h"
#include "doctor/checks.h"
#include "doctor/picture.h"
#include "doctor/pulses.h"
#include "doctor/stack.h"
#include "doctor/statistics.h"

namespace codedexposure
{

namespace
{

constexpr int kFrames = 12, kFewFrames = 6;
/* Part of the pixels that are not above the level. */
constexpr double kPeak = 0.995;
/* Errors of an amplitude: of the light to which it is related, and of the means
 * of frames, as a part of the light. */
constexpr double kGainError = 0.003, kMeanError = 1e-4;
/* Depth and frequency, Hz, that no ripple of a supply has. */
constexpr double kPulses = 0.4, kFast = 400;
/* Frames that beat with the light more slowly, Hz, seem to be in step. */
constexpr double kSlowBeat = 0.02;
/* The clock of a camera is that wrong, relative. */
constexpr double kClockError = 2.5e-5;

class LightCheck
{
public:
  explicit LightCheck (Examination &examination)
      : examination_ (examination), parts_ (examination.rig.parts ())
  {
  }

  Result<Finding> run ()
  {
    const auto &[first, slots, of] = examination_.inside;
    ASSIGN_OR_RETURN (const Stack dark,
        look_at_light (examination_, no_light (), of, kFewFrames));
    StackSum sum (parts_.largest ());
    PictureCheck pictures (kFrames);
    RETURN_IF_ERROR (look_for_whole_frames (examination_, lit (first, slots),
        of, kFrames, [&] (const SeenFrame &frame) {
          sum.add (frame);
          pictures.add (frame);
        }));
    ASSIGN_OR_RETURN (const Stack all, std::move (sum).stack (&dark.mean));
    if (!judge_level (all, dark))
      return std::move (finding_);
    ASSIGN_OR_RETURN (const Measured pulse, measure_pulses (examination_));
    /* Pulses make lines where there are none. */
    if (finding_.measure ("light of a pulse", scaled (pulse, 1e6)) <
        Verdict::warn)
      judge_time ();
    const bool ill = finding_.is_ill ();
    /* Light that falls off steeply looks like texture in small pictures. */
    RETURN_IF_ERROR (judge_field (all, dark));
    if (!ill)
      pictures.judge (all, dark.mean, parts_.largest (), finding_);
    RETURN_IF_ERROR (judge_target (all, dark));
    finding_.sort ();
    return std::move (finding_);
  }

private:
  /** Whether there is enough light to look at it. */
  bool judge_level (const Stack &all, const Stack &dark)
  {
    const int largest = parts_.largest ();
    double full = 0.0; // pixels of a frame
    each_pixel (all.mean, [&] (int x, int y) {
      /* Pixels that are bright without light are hot. In those that are full in
       * some frames only, the light changes. */
      if (dark.mean.at (x, y) < 0.2f * float (largest) &&
          all.mean.at (x, y) > 0.99f * float (largest))
        full += double (all.full.at (x, y)) / all.frames;
    });
    const double pixels = double (all.mean.pixels ().size ());
    const double peak = double (quantile (all.mean, kPeak));
    const double black = mean_of (dark.mean.view ());
    const Measured level{
        100.0 * (peak - black) / std::max (1.0, largest - black), 0.0};
    finding_.add ("level", level);
    saturated_ = finding_.measure ("saturated pixels",
                     {100.0 * full / pixels, 0.0}) != Verdict::pass;
    if (!saturated_)
      finding_.judge ("level", level);
    if (examination_.exhibits)
      finding_.exhibits.push_back (
          {"All mirrors on", picture_of (difference (all.mean, dark.mean), 0.0,
                                 std::max (1.0, peak))});
    return verdict_of ("level", level) < Verdict::fail;
  }

  /** From the short runs of the check of the trigger. */
  void judge_time ()
  {
    if (!examination_.light)
      return finding_.add ("flicker", kNotMeasured);
    judge_flicker (*examination_.light);
    const Measured drift =
        scaled (examination_.light->drift, 6000.0); // % a minute
    // Light that grows saturates in the end.
    if (finding_.measure ("drift", drift) == Verdict::fail && saturated_ &&
        drift.value > 0.0)
      std::ranges::rotate (finding_.diagnoses, finding_.diagnoses.end () - 1);
  }

  void judge_flicker (const LightFit &fit)
  {
    finding_.plots.push_back ({"Flicker of the light", "frequency, Hz",
        "part of the changes of the light that it explains", fit.spectrum});
    if (fit.lines.empty ())
      return void (finding_.measure ("flicker", {0.0, 100.0 * fit.faintest}));
    const auto &[ticks, seen] = fit.lines.front ();
    const Measured frequency{
        ticks.value, std::hypot (ticks.sigma, kClockError * ticks.value)};
    const Measured depth{seen.value,
        std::hypot (seen.sigma, kGainError * seen.value, kMeanError)};
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
    if (depth.value > kPulses && frequency.value > kFast) {
      finding_.add ("flicker", scaled (depth, 100.0));
      finding_.blame ("pulsed", cause);
    } else {
      finding_.measure ("flicker", scaled (depth, 100.0), cause);
    }
    finding_.readings.push_back ({"frequency of the flicker", frequency, "Hz"});
    finding_.readings.push_back (
        {"flicker of whole frames", scaled (depth, 100.0 * whole), "%"});
  }

  /** What is not even may also move, slowly. */
  Result<void> judge_target (const Stack &all, const Stack &dark)
  {
    if (finding_.diagnoses.empty () ||
        finding_.diagnoses.back ().id != "texture")
      return {};
    const auto &[first, slots, of] = examination_.inside;
    ASSIGN_OR_RETURN (
        const Stack later, look_at_light (examination_, lit (first, slots), of,
                               kFrames, &dark.mean));
    const std::size_t known = finding_.diagnoses.size ();
    finding_.judge (
        kChange, change_between ({std::as_const (all.mean).view (), all.frames},
                     {std::as_const (later.mean).view (), later.frames}, later,
                     dark.mean));
    if (finding_.diagnoses.size () > known)
      std::ranges::rotate (finding_.diagnoses, finding_.diagnoses.end () - 1);
    return {};
  }

  /** Of a part of the exposure, where the whole saturates. */
  Result<void> judge_field (const Stack &all, const Stack &dark)
  {
    const auto &[first, slots, of] = examination_.inside;
    Image<float> bright = all.mean;
    if (saturated_) {
      ASSIGN_OR_RETURN (Stack part,
          look_at_light (examination_, lit (first, std::max (1, slots / 8)), of,
              kFewFrames));
      bright = std::move (part.mean);
    }
    const Image<float> field = difference (std::move (bright), dark.mean);
    finding_.measure (
        "light lost in a corner", scaled (corner_loss (field.view ()), 100.0));
    return {};
  }

  Examination &examination_;
  const RigParts &parts_;
  Finding finding_{"light", "all mirrors on in the exposure"};
  bool saturated_ = false;
};

} // namespace

Result<Finding>
check_light (Examination &examination)
{
  return or_no_frames (LightCheck (examination).run (), "light");
}

} // namespace codedexposure
