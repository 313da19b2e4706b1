/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Check "trigger": when the camera exposes, and which frame that is. */
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "base/statistics.h"
#include "base/text.h"
#include "base/try.h"
#include "doctor/checks.h"
#include "doctor/lag.h"
#include "doctor/light_fit.h"
#include "doctor/pulses.h"
#include "doctor/response.h"
#include "doctor/runs.h"
#include "doctor/statistics.h"

namespace codedexposure
{

namespace
{

/* Stamps may differ from the frame rate by that part: clocks do by less. */
constexpr double kRateError = 0.003;
constexpr int kRateFrames = 25;
/* When the mirrors are parked, fewer frames are on their way than this many and
 * those of this time, s, together. */
constexpr int kFramesInFlight = 10;
constexpr double kTimeInFlight = 0.03;
/* Slots of the walk: runs of one are long enough for a DMD. */
constexpr double kShortestRun = 130e-6;
constexpr int kFinestGrid = 256, kTiles = 8;
constexpr int kCoarseFrames = 4, kFineFrames = 6;
constexpr int kInsideLooks = 20, kInsideFrames = 6;
/* Change of the light of whole frames in which nothing can be measured. */
constexpr double kUnsteady = 0.2;
/* Rows that are exposed later by that part of a period are not by noise. */
constexpr double kRowDelay = 0.02;
/* Mirrors are half way, and clocks tick, within that; s. */
constexpr double kTicks = 1.8e-6, kLengthTicks = 0.4e-6;
/* Steps of pixel values in which nothing can be measured, part of the range. */
constexpr double kCoarsest = 0.03;

constexpr const char *kEnd = "end of the exposure, from that of the frame "
                             "period";
/* An exposure that begins so long before the trigger does so with slow mirrors
 * only, us. */
constexpr double kEarly = 100;
/* An exposure that is longer, or known less well, is none that explains the
 * light; parts of the period. */
constexpr double kLongest = 1.5, kUnclear = 0.02;
/* A line that is that deep and explains little: something else changes the
 * light of runs, and may make the exposure look wrong. */
constexpr double kUnexplained = 0.1;
/* Jitter that is known no better is large, us. */
constexpr double kScattered = 60;
/* Mirrors that are late make the exposure look early, s. */
constexpr double kSlowMirrors = 2e-3;
/* A delay of that part of a period is that of a pulse, not of a setting, where
 * the camera does not say what it is set to. */
constexpr double kEdge = 0.3;
/* After the set delay, us, the exposure begins with the edge of a pulse. */
constexpr double kEdgeDelay = 700;

std::string
us_text (double us)
{
  return fixed (us, 0) + " us";
}

/** Whether @p number is above @p limit, as far as it is known. */
bool
above (const Measured &number, double limit)
{
  return number.value - 2.0 * number.sigma > limit;
}

/** The check, step by step. A bool is false if what comes next makes no sense.
 */
class TriggerCheck
{
public:
  explicit TriggerCheck (Examination &examination)
      : examination_ (examination), rig_ (examination.rig),
        parts_ (rig_.parts ()), period_ (parts_.period ()),
        largest_ (parts_.largest ()),
        runs_ (examination,
            std::clamp (int (period_ / kShortestRun / kTiles) * kTiles, kTiles,
                kFinestGrid)),
        grid_ (runs_.grid ())
  {
  }

  Result<Finding> run ()
  {
    ASSIGN_OR_RETURN (const bool triggered, check_frames ());
    if (!triggered)
      return std::move (finding_);
    RETURN_IF_ERROR (check_response (examination_, finding_));
    if (!finding_.diagnoses.empty ())
      return std::move (finding_);
    ASSIGN_OR_RETURN (
        const bool seen, check_lag (examination_, last_, finding_));
    if (!seen)
      return std::move (finding_);
    RETURN_IF_ERROR (measure_exposure ());
    finding_.sort ();
    return std::move (finding_);
  }

private:
  /** Whether frames come, and how many in a cycle. */
  Result<bool> check_frames ()
  {
    std::vector<double> steps, levels;
    int bits = 0;
    std::optional<Nanoseconds> first;
    RETURN_IF_ERROR (look (examination_, lit (0, 1), 1, 0));
    ASSIGN_OR_RETURN (const int came,
        watch_each (
            examination_.rig, kRateFrames, [&] (const SeenFrame &frame) {
              if (first)
                steps.push_back (1e-9 * double (frame.time - last_));
              first = first.value_or (frame.time);
              last_ = frame.time;
              if (frame.damaged)
                return;
              const Level level = level_of (frame.picture.view (), largest_);
              bits |= level.bits_seen;
              levels.push_back (level.mean);
            }));
    if (came < 2) {
      finding_.add ("frames per cycle", {0.0, 0.0});
      finding_.blame ("no-trigger",
          "the DMD runs, but " + std::string (came == 0
                                                  ? "no frame comes"
                                                  : "only one frame came"));
      return false;
    }
    runs_.bits_seen = bits;
    const int coarseness = bits ? bits & -bits : 1; // DN
    if (coarseness > kCoarsest * largest_) {
      finding_.blame ("missing-bits",
          "all pixel values are multiples of " + std::to_string (coarseness));
      return false;
    }
    const double step = std::max (median (steps), 1e-9);
    double frames = 0.0; // those that are lost included
    for (const double each : steps)
      frames += std::round (each / step);
    const double ratio =
        frames * period_ / std::max (1e-9 * double (last_ - *first), 1e-9);
    finding_.add ("frames per cycle", {ratio, 0.0});
    /* Of stamps that jitter, only the steps tell by how much. */
    double squares = 0.0;
    for (const double each : steps)
      squares += std::pow (std::remainder (each, step), 2);
    const double uneven = std::sqrt (squares / double (steps.size ())) /
                          (step * double (steps.size ()));
    ASSIGN_OR_RETURN (
        const bool triggered, check_parked (ratio, step, 3.0 * uneven));
    return triggered && check_steady (levels);
  }

  /** @p levels: of frames with all mirrors on, the first of which may be of the
   * mask before. */
  bool check_steady (const std::vector<double> &levels)
  {
    if (levels.size () < 4)
      return true;
    const std::vector<double> later (
        levels.begin () + std::ptrdiff_t (levels.size () / 2), levels.end ());
    const double low = quantile (later, 0.2), high = quantile (later, 0.8);
    if (high - low <= kUnsteady * high)
      return true;
    finding_.blame ("flicker",
        "with all mirrors on, whole frames have " + shown (low) + " to " +
            shown (high) + " DN: the light changes from frame to frame");
    return false;
  }

  /** Frames of a camera that waits for the trigger end with it. @p step: from
   * frame to frame, s. @p uneven: error of @p ratio. */
  Result<bool> check_parked (double ratio, double step, double uneven)
  {
    rig_.park ();
    const int in_flight = kFramesInFlight + int (kTimeInFlight / step);
    const double enough = 2.0 * step * in_flight; // s
    ASSIGN_OR_RETURN (const auto parked,
        rig_.watch_until (
            rig_.now () + Nanoseconds (1e9 * enough), in_flight + 2));
    const std::string rate = real_text (
        std::round (ratio * parts_.rate.num / parts_.rate.den * 1e3) / 1e3);
    if (int (parked.size ()) > in_flight)
      finding_.blame ("free-running",
          "frames come at " + rate +
              " frames/s even when the DMD is parked: the camera does not wait "
              "for the trigger");
    else if (std::abs (ratio - 0.5) < 0.1)
      finding_.blame ("half-rate", "one frame comes for two triggers");
    else if (std::abs (ratio - 2.0) < 0.4)
      finding_.blame ("double-rate", "two frames come for each trigger");
    else if (std::abs (ratio - 1.0) > kRateError + uneven)
      finding_.blame ("free-running",
          "the frame rate is " + rate + " frames/s, not that of the trigger");
    return finding_.diagnoses.empty ();
  }

  /** Whether all rows are exposed at the same time, by the tiles. */
  bool judge_rows ()
  {
    std::map<double, std::vector<BorderLight>> tiles; // by the start of each
    for (std::size_t i = 0; i < runs_.samples.size (); i++)
      tiles[runs_.samples[i].from].push_back (runs_.borders[i]);
    const auto delay = row_delay (tiles, period_);
    finding_.add ("last row against the first",
        delay ? scaled (*delay, 1e6) : kNotMeasured);
    if (!delay ||
        std::abs (delay->value) - 2.0 * delay->sigma < kRowDelay * period_)
      return true;
    finding_.blame ("rolling-shutter",
        "the last row is exposed " + us_text (1e6 * std::abs (delay->value)) +
            (delay->value > 0.0 ? " after" : " before") + " the first one");
    return false;
  }

  Result<void> sample_tiles (int exposure)
  {
    const int count = grid_ / kTiles;
    for (int tile = 0; tile < kTiles; tile++)
      RETURN_IF_ERROR (
          runs_.see (lit (tile * count, count), exposure, kCoarseFrames));
    return {};
  }

  /** Runs that begin before and after the exposure does. */
  Result<void> sample_starts (double start, int exposure)
  {
    const int at =
        std::clamp (int (std::floor (start / runs_.slot ())), 0, grid_ - 1);
    const int end = std::min (grid_, at + grid_ / kTiles);
    for (const int aside : {-2, 0, 1, 2, 4})
      if (const int first = std::max (at + aside, 0); first < end)
        RETURN_IF_ERROR (
            runs_.see (lit (first, end - first), exposure, kFineFrames));
    return {};
  }

  /** Runs that end before and after the exposure does. */
  Result<void> sample_ends (double end, int exposure)
  {
    int at = int (std::lround (end / runs_.slot ())) % grid_;
    if (at < grid_ / 16)
      at = grid_; // a run that short has little light
    const int first = std::max (at - grid_ / kTiles, 0);
    for (const int aside : {-4, -2, -1, 0, 2})
      if (const int until = std::min (at + aside, grid_); until > first)
        RETURN_IF_ERROR (
            runs_.see (lit (first, until - first), exposure, kFineFrames));
    return {};
  }

  /** Runs here and there in the exposure, by which flicker shows. */
  Result<void> sample_inside (const LightModel &guess)
  {
    // The period after the start of the exposure, as far as a run can have it.
    const int first = int (std::ceil (guess.start / runs_.slot ())) + 1;
    const bool wraps = first > grid_ / 2;
    const int from = wraps ? 0 : first;
    const int room = (wraps ? first - 4 : grid_) - from;
    for (int i = 0; i < kInsideLooks; i++)
      RETURN_IF_ERROR (runs_.see_one (i, from, room - 1, 1, kInsideFrames));
    return {};
  }

  /**
   * Half of the period leaves its start alone in the dark; of the longest
   * exposure, only the length is to be found. Both start with the same delay.
   */
  Result<void> measure_exposure ()
  {
    const auto half = Nanoseconds (std::llround (0.5e9 * period_));
    RETURN_IF_ERROR (rig_.expose (half));
    RETURN_IF_ERROR (sample_tiles (0));
    if (!judge_rows ())
      return rig_.expose ({});
    LightModel guess = guess_window (runs_.samples, period_);
    RETURN_IF_ERROR (sample_starts (guess.start, 0));
    RETURN_IF_ERROR (rig_.expose ({}));
    RETURN_IF_ERROR (sample_tiles (1));
    guess.lengths.push_back (guess_length (runs_.samples, guess));
    RETURN_IF_ERROR (sample_starts (guess.start, 1));
    RETURN_IF_ERROR (sample_ends (guess.start + guess.lengths[1], 1));
    RETURN_IF_ERROR (sample_inside (guess));
    if (runs_.samples.size () < 40)
      return {};
    examination_.light = fit_light (runs_.samples, guess);
    return diagnose_exposure (*examination_.light);
  }

  Result<void> diagnose_exposure (const LightFit &fit)
  {
    Measured start = fit.start, length = fit.lengths[1];
    start.sigma = std::hypot (start.sigma, kTicks);
    length.sigma = std::hypot (length.sigma, kLengthTicks);
    start.value = possible_start (start.value);
    const Measured jitter = scaled (fit.jitter, 1e6);
    const bool possible =
        length.value > 0.0 && length.value < kLongest * period_;
    const bool known = start.sigma + length.sigma < kUnclear * period_;
    if (!possible ||
        (!known && verdict_of ("jitter", jitter) != Verdict::fail)) {
      ASSIGN_OR_RETURN (const bool blamed, blame_light ());
      if (!blamed)
        finding_.blame ("jitter", "the light is steady, but the exposure "
                                  "begins at such varying times "
                                  "that it cannot be found");
      return {};
    }
    remember (fit, start, length);
    start = scaled (start, 1e6);
    length = scaled (length, 1e6);
    Measured end{start.value + length.value - 1e6 * period_,
        std::hypot (start.sigma, length.sigma)};
    finding_.add ("delay", start);
    finding_.add ("exposure", length);
    finding_.add (kEnd, end);
    finding_.add ("jitter", jitter);
    const bool wrong = std::max (verdict_of ("delay", start),
                           verdict_of (kEnd, end)) >= Verdict::warn;
    if (verdict_of ("jitter", jitter) >= Verdict::warn ||
        (wrong && fit.faintest > kUnexplained && jitter.sigma < kScattered)) {
      ASSIGN_OR_RETURN (const bool blamed, blame_light ());
      if (blamed)
        return {};
    }
    /* Where all frames scatter, nothing else can be told, not even by how much.
     */
    if (jitter.sigma >= kScattered) {
      if (verdict_of ("jitter", jitter) >= Verdict::warn)
        finding_.judge ("jitter", jitter);
      else
        finding_.blame ("jitter",
            "from frame to frame, the exposure begins earlier or later by a "
            "large part of the frame period");
      return {};
    }
    /* What jitters as much is no setting. */
    start.sigma = std::hypot (start.sigma, jitter.value);
    end.sigma = std::hypot (end.sigma, jitter.value);
    diagnose_delay (start);
    diagnose_end (end, length);
    finding_.judge ("jitter", jitter);
    return {};
  }

  /** Whether it is the light that hides the exposure, or that looks like
   * jitter; it is blamed then. */
  Result<bool> blame_light ()
  {
    ASSIGN_OR_RETURN (const Steadiness light, steadiness_of (examination_));
    if (light == Steadiness::steady)
      return false;
    const bool pulsed = light == Steadiness::pulsed;
    finding_.blame (pulsed ? "pulsed" : "flicker",
        std::string (pulsed ? "the lamp is switched on and off so fast"
                            : "the light changes so much") +
            " within the frame period that the exposure cannot be found");
    return true;
  }

  /** @p end: from that of the frame period, us. */
  void diagnose_end (const Measured &end, const Measured &length)
  {
    /* What is late ends late, and is not short. */
    const Measured missing{length.value - 1e6 * period_, length.sigma};
    const Verdict verdict = verdict_of (kEnd, end);
    const Verdict both = std::min (verdict, verdict_of (kEnd, missing));
    if (end.value < 0.0 && both > Verdict::pass)
      finding_.blame ("exposure-short",
          "the exposure ends " + us_text (-end.value) +
              " before the frame period does" +
              (both == Verdict::unknown ? ", within " + us_text (2 * end.sigma)
                                        : ""),
          both,
          "set a longer ExposureTime, or give the schedule a readout time of " +
              us_text (-end.value));
    else if (end.value >= 0.0 && verdict > Verdict::pass && !finding_.is_ill ())
      finding_.blame ("exposure-long",
          "the exposure runs " + us_text (end.value) +
              " into the next frame period",
          verdict);
  }

  /** TriggerDelay of the camera, s, if it says. */
  std::optional<double> set_delay () const
  {
    const auto feature = parts_.features.find ("TriggerDelay");
    if (feature == parts_.features.end ())
      return std::nullopt;
    return 1e-6 * parse_real (feature->second).value_or (0.0);
  }

  /** Of the times a period apart at which an exposure may begin as seen, the
   * one that is not before the set delay, but for slow mirrors. */
  double possible_start (double start) const
  {
    const double first =
        set_delay ().value_or (0.0) - std::min (kSlowMirrors, 0.05 * period_);
    return start - period_ * std::floor ((start - first) / period_);
  }

  /** A delay that is not set is the length of a pulse. @p start: us. */
  void diagnose_delay (const Measured &start)
  {
    const bool told = set_delay ().has_value ();
    const double set = 1e6 * set_delay ().value_or (0.0);
    const std::string late =
        "the exposure begins " + us_text (start.value) + " after the trigger";
    if (above (start, told ? set + kEdgeDelay : 1e6 * kEdge * period_))
      return finding_.blame (
          "trigger-edge", late + ", which is the length of a pulse");
    if (above (scaled (start, -1.0), kEarly))
      return finding_.blame ("trigger-edge",
          "the exposure seems to begin " + us_text (-start.value) +
              " before the trigger: mirrors are slow, or it begins with the "
              "end "
              "of a pulse in the period before",
          Verdict::unknown);
    finding_.judge ("delay", start,
        late + (set > 0.0 ? ", and TriggerDelay is " + us_text (set) : ""));
  }

  /** Slots that lie in the exposure as a whole, and the profile. */
  void remember (
      const LightFit &fit, const Measured &start, const Measured &length)
  {
    BenchProfile &profile = examination_.profile;
    profile.trigger_delay = {start.value * 1e9, start.sigma * 1e9};
    profile.exposure = {length.value * 1e9, length.sigma * 1e9};
    examination_.jitter = fit.jitter.value;
    const double margin = 3.0 * (fit.jitter.value + start.sigma) + 10e-6;
    const double end = start.value + length.value;
    const double next = std::max (0.0, end - period_); // of the exposure before
    int first = int (std::ceil ((start.value + margin) / runs_.slot ()));
    int until = int (std::floor ((end - margin) / runs_.slot ()));
    if (start.value < margin && start.value + margin < 0.1 * runs_.slot ())
      first = 0;
    until = std::min (until, grid_);
    if (const int before = int (std::floor ((next - margin) / runs_.slot ()));
        before > until - first) {
      first = 0;
      until = before;
    }
    if (until > first)
      examination_.inside = {first, until - first, grid_};
  }

  Examination &examination_;
  Rig &rig_;
  const RigParts &parts_;
  double period_; // s
  int largest_;
  Runs runs_;
  int grid_; // slots in a period
  Finding finding_{"trigger",
      "all mirrors on in one part of the frame period after the other"};
  Nanoseconds last_ = 0; // stamp of the last frame that came
};

} // namespace

Result<Finding>
check_trigger (Examination &examination)
{
  return TriggerCheck (examination).run ();
}

} // namespace codedexposure
