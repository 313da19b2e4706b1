/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Check "whole": a recording with the schedule that the user has chosen. */
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "base/statistics.h"
#include "base/text.h"
#include "base/try.h"
#include "doctor/checks.h"
#include "doctor/stack.h"
#include "doctor/statistics.h"
#include "estimate/least_squares.h"
#include "estimate/mirror_share.h"
#include "schedule/mirror_array.h"

namespace codedexposure
{

namespace
{

/* Frames that take part in the comparison of slots, spread over the recording
 * and put together in some parts, whose differences are noise. */
constexpr int kCompared = 64;
constexpr std::size_t kParts = 4;
/* Fewer frames say nothing of a recording. */
constexpr std::uint64_t kFewest = 10;
/* Error of the light of a slot, as a part of it: mapping, blur, flicker. */
constexpr double kSlotError = 0.003;
/* Delays between frames that a recording can do with, as part of a period. */
constexpr double kJitterWarn = 0.2;
/* Light that changes by that part is of another part of the cycle. */
constexpr double kOtherSlot = 0.3;
constexpr double kLongestWatch = 10.0; // s

/** How often an exposure of half of a period saw another part of the cycle than
 * the first one, in @p seconds at most, where the second quarter is lit. A
 * recording of a still target does not show slips by whole slots. */
Result<std::uint64_t>
count_slips (Examination &examination, double seconds)
{
  constexpr int kFrames = 10;
  const RigParts &parts = examination.rig.parts ();
  const double frames =
      std::min (seconds, kLongestWatch) * parts.rate.num / parts.rate.den;
  std::vector<double> levels;
  const auto watch = [&] () -> Result<void> {
    RETURN_IF_ERROR (look (examination, lit (1, 1), 4, 0));
    for (int came = 1; came > 0 && double (levels.size ()) < frames;) {
      ASSIGN_OR_RETURN (
          came, watch_each (examination.rig, kFrames, [&] (auto &frame) {
            if (!frame.damaged)
              levels.push_back (mean_of (frame.picture.view ()));
          }));
    }
    return {};
  };
  RETURN_IF_ERROR (
      with_exposure (examination, parts.rate.period () / 2, watch));
  if (levels.empty ())
    return std::uint64_t (0);
  const double first = levels.front ();
  const double other =
      kOtherSlot * (first - value_or (examination.profile.black_level, 0.0));
  return std::uint64_t (std::ranges::count_if (
      levels, [&] (double level) { return std::abs (level - first) > other; }));
}

struct Recording {
  std::uint64_t frames = 0, lost = 0, damaged = 0, unsynchronised = 0;
  std::vector<double> delays = {}; ///< arrival after the exposure, ns
  std::optional<Nanoseconds> uncertainty = {};
};

void
diagnose_losses (const Recording &counts, Finding &finding)
{
  const double root = std::sqrt (double (counts.lost));
  finding.readings.push_back ({"lost frames", {double (counts.lost), root},
      "of " + std::to_string (counts.frames + counts.lost), "0"});
  if (counts.frames == 0)
    finding.blame ("no-trigger", "no frame came");
  if (counts.lost + counts.damaged > 0)
    finding.blame ("lose", std::to_string (counts.lost) +
                               " frames were lost and " +
                               std::to_string (counts.damaged) + " damaged");
  if (counts.unsynchronised > 0)
    finding.blame ("slip", "masks and camera were out of step in " +
                               std::to_string (counts.unsynchronised) +
                               " frames");
}

void
diagnose_times (const Recording &counts, FrameRate rate, Finding &finding)
{
  if (counts.delays.size () < 2)
    return;
  /* In whole nanoseconds, as times are. */
  const double jitter = std::round (spread_of (counts.delays).sigma);
  finding.readings.push_back ({"jitter of arrival",
      {jitter / 1e3, jitter / 1e3 / std::sqrt (2.0 * double (counts.frames))},
      "us"});
  if (counts.uncertainty)
    finding.readings.push_back (
        {"time uncertainty", {double (*counts.uncertainty) / 1e3, 0}, "us"});
  if (jitter > kJitterWarn * double (rate.period ()))
    finding.blame ("frame-jitter",
        "frames arrive with delays that differ by " + fixed (jitter / 1e3, 0) +
            " us (rms)",
        Verdict::warn);
}

/**
 * The light of each slot, from pixels that see more or less of the mirrors that
 * are on in it: by least squares, whatever the code and the pose of the camera.
 */
class Slots
{
public:
  explicit Slots (Examination &examination)
      : examination_ (examination), parts_ (examination.rig.parts ()),
        schedule_ (examination.schedule), count_ (schedule_.slots ())
  {
    for (Image<float> &sum : sums_)
      sum = {parts_.camera.size.width, parts_.camera.size.height};
  }

  /** Looks at the target without a code. */
  Result<void> see_target ()
  {
    constexpr int kFrames = 8;
    const auto &[first, slots, of] = examination_.inside;
    ASSIGN_OR_RETURN (
        Stack dark, look_at_light (examination_, no_light (), of, kFrames));
    ASSIGN_OR_RETURN (
        Stack white, look_at_light (examination_,
                         lit (first, std::max (1, slots / 2)), of, kFrames));
    dark_ = std::move (dark.mean);
    white_ = std::move (white.mean);
    return {};
  }

  void add (ImageView<const std::uint16_t> frame)
  {
    const std::size_t part = std::size_t (added_++) % kParts;
    frames_[part]++;
    each_pixel (frame, [&] (int x, int y) {
      sums_[part].at (x, y) += float (frame.at (x, y));
    });
  }

  void diagnose (Finding &finding) const
  {
    if (const auto light = solve ())
      return judge (*light, finding);
    else
      finding.notes.push_back ({"slots",
          "Slots were not compared: " + light.error ().message + "."});
    finding.add ("largest difference of a slot", kNotMeasured);
  }

private:
  /** Light of the slots, a row each, of the parts of the recording. */
  Result<Eigen::MatrixXd> solve () const
  {
    constexpr int kPixels = 30'000; // are enough
    constexpr double kLit = 0.02, kFull = 0.98;
    if (added_ < int (kParts))
      return Error{"there are too few frames"};
    if (!examination_.profile.mapping || !examination_.profile.psf_sigma)
      return Error{
          "the mapping is not known; run the check of the optics, too"};
    const int largest = parts_.largest ();
    const int all = dark_.width () * dark_.height ();
    const int step = std::max (1, all / kPixels) | 1; // no period of a tile
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero (count_, count_);
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero (count_, kParts);
    Eigen::VectorXd shares, seen (kParts);
    for (int i = 0; i < all; i += step) {
      const int x = i % dark_.width (), y = i / dark_.width ();
      const double dark = double (dark_.at (x, y));
      const double light = double (white_.at (x, y)) - dark;
      if (light < kLit * largest || light + dark > kFull * largest ||
          !find_shares ({double (x), double (y)}, shares))
        continue;
      for (std::size_t part = 0; part < kParts; part++)
        seen[Eigen::Index (part)] =
            (double (sums_[part].at (x, y)) / frames_[part] - dark) / light;
      normal += shares * shares.transpose ();
      right += shares * seen.transpose ();
    }
    const Eigen::MatrixXd light = inverse_of (normal) * right;
    if (!light.allFinite () || !(light.sum () > 0.0))
      return Error{"the pixels do not tell them apart"};
    return light;
  }

  /** Which part of a pixel's light comes from mirrors that are on in each slot;
   * false beyond the mirrors of the code. */
  bool find_shares (Position pixel, Eigen::VectorXd &shares) const
  {
    const Mapping &mapping = *examination_.profile.mapping;
    const Position at = mapping.mirror_at (pixel.x, pixel.y);
    const double side = 1.0 / mapping.pose ().magnification;
    const double sigma = side * examination_.profile.psf_sigma->value;
    const double reach = 0.5 * side + 4.0 * sigma + 0.5;
    const Extent mirrors = mapping.mirrors ();
    const int bottom =
        pilot_top (schedule_, MirrorLayout::address, mirrors.height);
    if (!(at.x >= reach && at.y >= reach && at.x < mirrors.width - 1 - reach &&
            at.y < bottom - 1 - reach))
      return false;
    shares.setZero (count_);
    for (int y = int (at.y - reach); y <= int (at.y + reach) + 1; y++)
      for (int x = int (at.x - reach); x <= int (at.x + reach) + 1; x++) {
        const double share = mirror_share (at.x - x, side, sigma) *
                             mirror_share (at.y - y, side, sigma);
        for (Eigen::Index slot = 0; slot < count_; slot++)
          shares[slot] += schedule_.on (x, y, int (slot)) ? share : 0.0;
      }
    return true;
  }

  /** The part of the time of each slot in which the camera exposes. */
  std::vector<double> exposed_parts () const
  {
    std::vector<double> exposed (std::size_t (count_), 1.0);
    const BenchProfile &profile = examination_.profile;
    const auto plan =
        SlotPlan::fit (schedule_.timing (), schedule_.slots (), parts_.rate);
    if (!plan || !profile.trigger_delay || !profile.exposure)
      return exposed;
    for (std::size_t slot = 0; slot < exposed.size (); slot++) {
      double open = 0.0;
      for (const int cycle : {-1, 0, 1}) {
        const double begin = double (plan->start (int (slot))) +
                             cycle * double (plan->frame_period ());
        const double from = std::max (begin, profile.trigger_delay->value);
        const double until = std::min (begin + double (plan->active ()),
            profile.trigger_delay->value + profile.exposure->value);
        open += std::max (0.0, until - from);
      }
      exposed[slot] = std::min (1.0, open / double (plan->active ()));
    }
    return exposed;
  }

  /** Error of the light of a slot, and of those with which it is compared, as a
   * part of it: pixels with little noise are all rounded alike. @p part: its
   * light, as a part of that without a code. */
  double rounding_of (double part) const
  {
    constexpr int kTerms = 20; // of the Fourier series of the error
    const double light =
        part * (mean_of (white_.view ()) - mean_of (dark_.view ())); // DN
    const auto &gain = examination_.profile.conversion_gain;
    const double noise = value_or (examination_.profile.read_noise, 0.0);
    const double variance =
        gain ? light / gain->value + std::pow (noise / gain->value, 2) : 0.0;
    double squares = 0.0;
    for (int k = 1; k <= kTerms; k++) {
      const double turn = std::numbers::pi * k;
      squares += std::exp (-4.0 * turn * turn * variance) / (2.0 * turn * turn);
    }
    return std::sqrt (2.0 * squares) / light;
  }

  void judge (const Eigen::MatrixXd &light, Finding &finding) const
  {
    const std::vector<double> exposed = exposed_parts ();
    double sum = 0.0;
    for (const double part : exposed)
      sum += part;
    const double unit = light.sum () / kParts / sum; // of a whole slot
    const double error = std::hypot (kSlotError, rounding_of (unit));
    Measured worst; // of the differences
    std::size_t differs = 0, cut = 0;
    Plot plot{"Light of the slots", "slot", "part of a whole slot"};
    for (std::size_t slot = 0; slot < exposed.size (); slot++) {
      const auto row = light.row (Eigen::Index (slot));
      const Measured seen = spread_of ({row.begin (), row.end ()});
      plot.points.push_back ({double (slot), seen.value / unit});
      plot.model.push_back ({double (slot), exposed[slot]});
      const Measured off = {seen.value / unit - exposed[slot],
          std::hypot (error, seen.sigma / unit / std::sqrt (kParts))};
      if (std::abs (off.value) > std::abs (worst.value)) {
        worst = off;
        differs = slot;
      }
      if (exposed[slot] < exposed[cut])
        cut = slot;
    }
    finding.plots.push_back (std::move (plot));
    finding.measure ("largest difference of a slot", worst,
        "slot " + std::to_string (differs) + " of a still target is " +
            fixed (100 * std::abs (worst.value), 1) + " % " +
            (worst.value < 0 ? "darker" : "brighter") + " than it should be");
    const double lost = 100.0 * (1.0 - exposed[cut]);
    finding.measure ("light that a slot loses", {lost, 0.0},
        "the exposure is over, or has not begun, in " + fixed (lost, 0) +
            " % of slot " + std::to_string (cut));
  }

  Examination &examination_;
  const RigParts &parts_;
  const Schedule &schedule_;
  Eigen::Index count_;
  Image<float> dark_, white_;
  std::array<Image<float>, kParts> sums_;
  std::array<int, kParts> frames_ = {};
  int added_ = 0;
};

} // namespace

Result<Finding>
check_whole (Examination &examination)
{
  const RigParts &parts = examination.rig.parts ();
  const double seconds = examination.recording;
  Finding finding{"whole", "the schedule " + examination.schedule.text () +
                               ", for " + real_text (seconds) + " s"};
  Slots slots (examination);
  if (const auto seen = slots.see_target (); !seen)
    return or_no_frames (seen.error (), "whole");
  Recording counts;
  ASSIGN_OR_RETURN (counts.unsynchronised, count_slips (examination, seconds));
  const double expected = seconds * parts.rate.num / parts.rate.den;
  const auto every = std::uint64_t (std::max (1.0, expected / kCompared));
  RETURN_IF_ERROR (examination.rig.record (
      examination.schedule, seconds, [&] (const RecordedFrame &frame) {
        if (!frame.damaged && frame.synchronised != false &&
            counts.frames % every == every / 2)
          slots.add (frame.picture);
        counts.frames++;
        counts.lost += frame.lost_before;
        counts.damaged += frame.damaged;
        counts.unsynchronised += frame.synchronised == false;
        counts.delays.push_back (double (frame.arrival - frame.time));
        if (frame.uncertainty)
          counts.uncertainty = frame.uncertainty;
      }));
  diagnose_losses (counts, finding);
  if (counts.frames < kFewest) {
    finding.readings.push_back ({"frames", {double (counts.frames), INFINITY},
        "", "at least " + std::to_string (kFewest)});
    return finding;
  }
  diagnose_times (counts, parts.rate, finding);
  slots.diagnose (finding);
  finding.sort ();
  return finding;
}

} // namespace codedexposure
