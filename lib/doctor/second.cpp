/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Check "second": a camera in the beam of the mirrors that are off, against the
 * first one: the same exposures, its light, and where it looks. */
#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>

#include "base/statistics.h"
#include "base/try.h"
#include "doctor/picture.h"
#include "doctor/stack.h"

namespace codedexposure
{

namespace
{

constexpr int kSlots = 8;  // of the period, which are lit in turn
constexpr int kFrames = 3; // of a mask
constexpr int kInSlots = 8;
constexpr int kCounted = 20;
/* By which part the light of a lamp that flickers differs from slot to slot, as
 * the exposures of both cameras do not begin together. */
constexpr double kUneven = 0.003;
/* A frame with more than this part of the light is of the new mask. */
constexpr double kNew = 0.5;
/* By which part clocks of cameras differ at most. */
constexpr double kClocks = 2e-3;
/* Diagnoses of how a camera stands, which its mapping takes into account. */
constexpr const char *kPose[] = {"rotation", "scale", "perspective",
    "distortion", "shift", "field", "binning"};

/** What a camera saw. */
struct Look {
  std::vector<double> levels = {};   ///< mean of each frame, DN
  std::vector<double> times = {};    ///< of exposures, by the camera's clock, s
  std::vector<double> arrivals = {}; ///< s after the masks

  Measured level () const
  {
    const double count = std::max (1.0, double (levels.size ()));
    const double mean =
        std::accumulate (levels.begin (), levels.end (), 0.0) / count;
    double squares = 0.0;
    for (const double value : levels)
      squares += (value - mean) * (value - mean);
    return {mean, std::sqrt (squares) / count};
  }
};

struct Both {
  Look first, second;
};

/* Of what was seen before and after, as the lamp drifts. */
Measured
between (const Look &before, const Look &after)
{
  const Measured one = before.level (), other = after.level ();
  const double drift = 0.5 * (other.value - one.value);
  return {0.5 * (one.value + other.value),
      std::hypot (drift, one.sigma, other.sigma)};
}

class SecondRun
{
public:
  explicit SecondRun (Examination &examination)
      : examination_ (examination), rig_ (examination.rig),
        second_ (*examination.rig.second ()),
        other_ ({second_, examination.host})
  {
    other_.lag = examination.lag;
    other_.exhibits = examination.exhibits;
  }

  Result<Finding> run ()
  {
    finding_.notes.emplace_back ("not checked of the second camera",
        "conversion gain, full well, read noise, linearity, clipped black and "
        "defects, as its light cannot be dosed; vignetting; and off-state "
        "leakage, which is in its black level");
    /* What follows from a fault is not judged. */
    for (const auto step : {&SecondRun::look_at_parts, &SecondRun::count_frames,
             &SecondRun::look_for_late_frames, &SecondRun::measure_light,
             &SecondRun::look_at_pixels}) {
      RETURN_IF_ERROR ((this->*step) ());
      if (finding_.verdict () == Verdict::fail) {
        finding_.sort ();
        return std::move (finding_);
      }
    }
    RETURN_IF_ERROR (compare_exposures ());
    ASSIGN_OR_RETURN (Finding optics, check_optics (other_));
    take_over (std::move (optics));
    if (other_.profile.mapping)
      compare_views (*other_.profile.mapping);
    judge_losses ();
    finding_.sort ();
    BenchProfile &profile = other_.profile;
    profile.trigger_delay = examination_.profile.trigger_delay;
    examination_.profile.second = {profile};
    return std::move (finding_);
  }

private:
  /* Those of the mask before included. */
  Result<Look> see (Rig &rig, Nanoseconds begin, int frames)
  {
    Look look;
    ASSIGN_OR_RETURN (const auto seen, rig.watch (frames));
    for (const SeenFrame &frame : seen) {
      if (frame.damaged)
        continue;
      look.levels.push_back (mean_of (frame.picture.view ()));
      look.times.push_back (1e-9 * double (frame.time));
      look.arrivals.push_back (1e-9 * double (frame.arrival - begin));
    }
    return look;
  }

  /* Between new masks the trigger pauses. */
  void count_losses (const std::vector<double> &times)
  {
    seen_ += std::int64_t (times.size ());
    for (std::size_t k = 1; k < times.size (); k++)
      lost_ += std::max<std::int64_t> (
          0, std::llround ((times[k] - times[k - 1]) / period_) - 1);
  }

  /* No recording of this camera follows, in which a few would be seen. */
  void judge_losses ()
  {
    finding_.readings.push_back ({"second camera: lost frames",
        {double (lost_), 0.0}, "of " + std::to_string (seen_ + lost_)});
    for (const char *name :
        {"second camera: missing frames", "second camera: lost frames"}) {
      const Reading *missing = finding_.reading (name);
      if (!missing || missing->number.value <= 0.0)
        continue;
      finding_.blame ("lose",
          "second camera: " + fixed (missing->number.value, 0) + " " +
              missing->unit + " frames did not come",
          Verdict::warn);
      return;
    }
  }

  /* Both cameras send all the time; what is watched later has waited. */
  Result<Both> look (const StillMask &mask, int slots, int frames)
  {
    RETURN_IF_ERROR (rig_.show (mask, slots));
    const Nanoseconds begin = rig_.now ();
    Both both;
    ASSIGN_OR_RETURN (both.first, see (rig_, begin, examination_.lag + frames));
    ASSIGN_OR_RETURN (
        both.second, see (second_, begin, examination_.lag + frames));
    for (Look *look : {&both.first, &both.second})
      for (auto *numbers : {&look->levels, &look->times, &look->arrivals})
        numbers->erase (numbers->begin (),
            numbers->begin () +
                std::min (int (numbers->size ()), examination_.lag));
    count_losses (both.second.times);
    if (both.first.levels.empty ())
      return Error{"no frame came", ErrorCode::timeout};
    return both;
  }

  Result<void> look_at_parts ()
  {
    other_.host = {}; // was judged with the first
    ASSIGN_OR_RETURN (Finding parts, check_parts (other_));
    std::erase_if (parts.notes, [] (const auto &note) {
      return note.first.find ("DMD") != note.first.npos;
    });
    take_over (std::move (parts));
    return {};
  }

  /* A camera that is not triggered with the first sends more frames, fewer, or
   * none. */
  Result<void> count_frames ()
  {
    RETURN_IF_ERROR (rig_.watch (1));
    RETURN_IF_ERROR (second_.watch (1)); // both send now
    ASSIGN_OR_RETURN (on_, look (lit (0, 1), 1, kCounted));
    const auto step = [] (const Look &look) {
      std::vector<double> steps;
      for (std::size_t k = 1; k < look.times.size (); k++)
        steps.push_back (look.times[k] - look.times[k - 1]);
      return steps.empty () ? 0.0 : median (steps);
    };
    const double first = step (on_.first), second = step (on_.second);
    finding_.readings.push_back ({"frames of the second camera",
        {first > 0 && second > 0 ? first / second : 0.0, 0.0},
        "for each of the first", "1"});
    if (second == 0.0)
      finding_.blame ("second-trigger", "the second camera sends no frames");
    else if (std::abs (first / second - 1.0) > kClocks)
      finding_.blame ("second-trigger", "the second camera sends " +
                                            fixed (first / second, 3) +
                                            " frames for each of the first");
    else
      compare_arrivals ();
    return {};
  }

  /* Frames are paired by times that are found from arrivals. */
  void compare_arrivals ()
  {
    Look later; // parts of a period
    for (std::size_t k = 0;
         k < std::min (on_.first.arrivals.size (), on_.second.arrivals.size ());
         k++) {
      const double by =
          (on_.second.arrivals[k] - on_.first.arrivals[k]) / period_;
      later.levels.push_back (100.0 * (by - std::round (by)));
    }
    finding_.measure ("second-arrival", later.level ());
  }

  /* Frames that are exposed together come together: those of the first light of
   * each camera. The masks before leave no light in frames that are cut short.
   */
  Result<void> look_for_late_frames ()
  {
    ASSIGN_OR_RETURN (off_, look (no_light (), 1, kFrames));
    const auto when = [&] (Rig &rig, const StillMask &mask,
                          const Measured &dark,
                          const Measured &bright) -> Result<double> {
      constexpr double kClear = 5.0; // standard deviations
      if (!(bright.value - dark.value >
              kClear * std::hypot (dark.sigma, bright.sigma)))
        return -1.0;
      RETURN_IF_ERROR (rig_.show (mask, 1));
      const Nanoseconds begin = rig_.now ();
      ASSIGN_OR_RETURN (
          const Look seen, see (rig, begin, examination_.lag + kFrames));
      for (std::size_t k = 0; k < seen.levels.size (); k++)
        if (seen.levels[k] > dark.value + kNew * (bright.value - dark.value))
          return seen.arrivals[k];
      return -1.0;
    };
    ASSIGN_OR_RETURN (const double first,
        when (rig_, lit (0, 1), off_.first.level (), on_.first.level ()));
    ASSIGN_OR_RETURN (const double second,
        when (second_, no_light (), on_.second.level (), off_.second.level ()));
    const bool known = first >= 0.0 && second >= 0.0;
    const double late = std::round ((second - first) / period_) + 0.0; // not -0
    finding_.readings.push_back ({"frames of the second camera are later by",
        known ? Measured{late, 0.0} : kNotMeasured, "frames", "0"});
    if (!known)
      return {};
    if (late != 0.0)
      finding_.blame ("second-frame-late",
          "new masks are in the second camera's frames " +
              fixed (std::abs (late), 0) +
              (late > 0 ? " frames later" : " frames earlier") +
              " than in the first one's");
    return {};
  }

  /** Light of a slot to the first camera, missing in the second, DN. */
  struct Slot {
    double first, second, sigma;
  };

  /* Light in each eighth of the period alone: what comes to the first camera is
   * missing in the other, of what that sees without it, before and after. */
  Result<std::vector<Slot>> light_of_slots ()
  {
    ASSIGN_OR_RETURN (const Both before, look (no_light (), 1, kInSlots));
    std::vector<Both> seen;
    for (int slot = 0; slot < kSlots; slot++) {
      ASSIGN_OR_RETURN (Both both, look (lit (slot, 1), kSlots, kInSlots));
      seen.push_back (std::move (both));
    }
    ASSIGN_OR_RETURN (const Both after, look (no_light (), 1, kInSlots));
    std::vector<Slot> slots;
    for (int k = 0; k < kSlots; k++) {
      const auto at = [&] (const Look &of, const Look &later) {
        const Measured one = of.level (), other = later.level ();
        return one.value + (other.value - one.value) * (k + 1) / (kSlots + 1);
      };
      const auto &[first, second] = seen[std::size_t (k)];
      const double light =
          first.level ().value - at (before.first, after.first);
      const double missing =
          at (before.second, after.second) - second.level ().value;
      slots.push_back ({light, missing,
          std::hypot (before.second.level ().sigma, second.level ().sigma)});
    }
    return slots;
  }

  /* By how much longer the first camera sees @slots than the second, us. The
   * ratio of light is that of most of them; a lamp that flickers does so for
   * both. */
  Measured lacking (std::span<const Slot> slots) const
  {
    std::vector<double> ratios;
    double whole = 1e-3;
    for (const Slot &slot : slots) {
      ratios.push_back (slot.second / std::max (slot.first, 1e-3));
      whole = std::max (whole, slot.first);
    }
    const double of_frames = other_.profile.light_ratio->value;
    double ratio = median (ratios);
    if (!(ratio > 0.5 * of_frames && ratio < 2.0 * of_frames))
      ratio = of_frames;
    double part = 0.0, variance = double (slots.size ()) * kUneven * kUneven;
    for (const Slot &slot : slots) {
      part += (slot.first - slot.second / ratio) / whole;
      variance += std::pow (slot.sigma / ratio / whole, 2);
    }
    const double us = 1e6 * period_ / kSlots;
    return {us * part, us * std::sqrt (variance)};
  }

  /* In the next period, an exposure that is late sees what it missed: its start
   * is seen in short ones. */
  Result<void> compare_exposures ()
  {
    if (!other_.profile.light_ratio) {
      finding_.add ("second-late", kNotMeasured);
      finding_.add ("second-short", kNotMeasured);
      return {};
    }
    const auto half = Nanoseconds (1e9 * period_ / 2);
    const auto begins = [&] { return light_of_slots (); };
    ASSIGN_OR_RETURN (const auto halves,
        with_exposure (examination_, half,
            [&] { return with_exposure (other_, half, begins); }));
    finding_.measure (
        "second-late", lacking (std::span (halves).first (kSlots / 2)));
    ASSIGN_OR_RETURN (const auto whole, light_of_slots ());
    finding_.measure ("second-short", lacking (whole));
    return {};
  }

  Result<void> measure_light ()
  {
    const double largest = double (second_.parts ().largest ());
    ASSIGN_OR_RETURN (const Both on, look (lit (0, 1), 1, kFrames));
    ASSIGN_OR_RETURN (
        const Stack bright, look_at_light (other_, lit (0, 1), 1, kFrames));
    const auto full = bright.full.pixels (); // frames, of each pixel
    const auto pixels = double (full.size ());
    finding_.measure ("second-bright",
        {100 * (pixels - double (std::ranges::count (full, 0))) / pixels, 0.0});
    const auto light_of = [] (const Measured &light, const Measured &dark) {
      return Measured{
          light.value - dark.value, std::hypot (light.sigma, dark.sigma)};
    };
    /* Dark pixels may all be rounded alike. */
    const auto rounded = [] (Measured dark) {
      dark.sigma = std::hypot (dark.sigma, 1.0 / std::sqrt (12.0));
      return dark;
    };
    const Measured dark = rounded (between (on_.second, on.second));
    const Measured of_second = light_of (off_.second.level (), dark);
    const Measured of_first =
        light_of (between (on_.first, on.first), rounded (off_.first.level ()));
    finding_.measure (
        "second-dark", scaled (of_second, 100 / (largest - dark.value)));
    if (!(of_first.value > 0.0) || !(of_second.value > 0.0))
      return {};
    const double ratio = of_second.value / of_first.value;
    other_.profile.light_ratio = {
        ratio, ratio * std::hypot (of_second.sigma / of_second.value,
                           of_first.sigma / of_first.value)};
    finding_.readings.push_back ({"light of the second camera",
        *other_.profile.light_ratio, "times that of the first"});
    other_.profile.black_level = dark;
    return {};
  }

  /* What the camera does not say of them. */
  Result<void> look_at_pixels ()
  {
    constexpr int kPictures = 12;
    ASSIGN_OR_RETURN (
        const Stack dark, look_at_light (other_, no_light (), 1, kPictures));
    StackSum sum (second_.parts ().largest ());
    PictureCheck pictures (kPictures);
    RETURN_IF_ERROR (look_for_whole_frames (
        other_, lit (0, 1), 1, kPictures, [&] (const SeenFrame &frame) {
          sum.add (frame);
          pictures.add (frame);
        }));
    ASSIGN_OR_RETURN (const Stack all, std::move (sum).stack (&dark.mean));
    Finding finding;
    pictures.judge (all, dark.mean, second_.parts ().largest (), finding);
    finding.judge_bits (
        std::countr_zero (unsigned (dark.bits_seen | all.bits_seen)),
        second_.parts ().bits);
    take_over (std::move (finding));
    return {};
  }

  /* Its pose against the mirrors, in words, and what both cameras see. */
  void compare_views (const Mapping &of_second)
  {
    const auto [xx, xy, yx, yy] = of_second.slope_at (
        0.5 * of_second.camera ().width, 0.5 * of_second.camera ().height);
    const double angle = std::atan2 (yx, xx) * 180.0 / std::numbers::pi;
    finding_.notes.emplace_back ("orientation of the second camera",
        std::string (xx * yy < xy * yx ? "mirror image" : "no mirror image") +
            " of the mirrors, its rows turned by " + fixed (angle, 1) +
            " degrees");
    const auto &of_first = examination_.profile.mapping;
    if (!of_first)
      return finding_.add ("second-shift", kNotMeasured);
    constexpr int kStep = 4;
    double first = 0.0, both = 0.0;
    std::vector<Position> row (std::size_t (of_second.mirrors ().width));
    std::vector<Position> row_of_first = row;
    for (int y = 0; y < of_second.mirrors ().height; y += kStep) {
      of_first->camera_row (y, row_of_first);
      of_second.camera_row (y, row);
      for (std::size_t x = 0; x < row.size (); x += kStep) {
        if (!of_first->in_frame (row_of_first[x]))
          continue;
        first++;
        both += of_second.in_frame (row[x]);
      }
    }
    finding_.measure (
        "second-shift", {100 * both / std::max (1.0, first), 0.0});
  }

  void take_over (Finding finding)
  {
    const auto named = [] (std::string &name) {
      name = "second camera: " + name;
    };
    std::erase_if (finding.diagnoses, [] (const Diagnosis &diagnosis) {
      return std::ranges::find (kPose, diagnosis.id) != std::end (kPose);
    });
    for (Reading &reading : finding.readings) {
      named (reading.name);
      reading.rule.clear ();
      finding_.readings.push_back (std::move (reading));
    }
    for (auto &[name, text] : finding.notes) {
      named (name);
      finding_.notes.emplace_back (std::move (name), std::move (text));
    }
    for (Diagnosis &diagnosis : finding.diagnoses) {
      named (diagnosis.cause);
      finding_.diagnoses.push_back (std::move (diagnosis));
    }
    for (Exhibit &exhibit : finding.exhibits) {
      named (exhibit.title);
      finding_.exhibits.push_back (std::move (exhibit));
    }
  }

  Examination &examination_;
  Rig &rig_, &second_;
  Examination other_;
  const double period_ = examination_.rig.parts ().period ();
  Both on_, off_;                    // all mirrors
  std::int64_t seen_ = 0, lost_ = 0; // frames of the second camera
  Finding finding_ = {"second",
      "all mirrors on and off, light in each eighth of the period, and the "
      "complements of Gray codes and gratings"};
};

} // namespace

Result<Finding>
check_second (Examination &examination)
{
  if (!examination.rig.second ())
    return Finding{.check = "second", .shown = {}, .skipped = true};
  return or_no_frames (SecondRun (examination).run (), "second");
}

} // namespace codedexposure
