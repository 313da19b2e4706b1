/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Check "sensor": photon transfer, with grey levels that mirrors make. */
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>

#include "base/try.h"
#include "doctor/defects.h"
#include "doctor/dither.h"
#include "doctor/off_light.h"
#include "doctor/photon_transfer.h"
#include "doctor/picture.h"
#include "doctor/rounding.h"
#include "doctor/stack.h"
#include "estimate/least_squares.h"

namespace codedexposure
{

namespace
{

constexpr int kFrames = 12;         // of a level
constexpr int kDarkFrames = 24;     // of the dark
constexpr int kReferenceFrames = 6; // of the level that shows drift
constexpr int kLevelsPerReference = 4;
/* Slots are at least that long: masks of DLPC900 take 105 us. */
constexpr Nanoseconds kShortest = 110'000;
/* Levels, as parts of the brightest, in an order in which drift is no bow. */
constexpr std::array kLevels = {
    0.5, 0.03, 0.9, 0.2, 0.7, 0.004, 0.4, 1.0, 0.1, 0.8, 0.3, 0.01, 0.6, 0.06};
/* Part of the values that may be the largest DN at a level that counts. */
constexpr double kFull = 0.001;
/* Errors of levels, relative: light that the model does not know of. */
constexpr double kLightError = 0.00025, kVarianceError = 0.004;
/* Error of a variance where rounding was undone, DN^2. */
constexpr double kUnroundedError = 0.0003;
/* Of the deviation from a line, as a part of the range. */
constexpr double kBowError = 0.0001;
/* Part of the values that may be 0 there; noise is cut off otherwise. */
constexpr double kZeros = 0.005;
/* Error of the dark beside levels with light, DN. */
constexpr double kDarkError = 0.008;
/* Below this variance of the dark, DN squared, rounding changes it. */
constexpr double kRounded = 0.9;
/* Light of mirrors that are off, part of the range, whose own noise tips the
 * rounding. */
constexpr double kMostOff = 0.05;
/* A gain with this relative error is not known. */
constexpr double kUnknown = 0.2;
/* Light below this part of the range is too little to measure noise. */
constexpr double kDim = 0.15;
/* Controllers count in microseconds: error of the time of a level, ns. */
constexpr double kTimeError = 500;
/* A variance below this part of the expected one is that of a full well. */
constexpr double kFullWell = 0.4;

/* Defects that warn and fail, as parts of the pixels; fewer are not told. */
constexpr double kDefectsWarn = 1e-4, kDefectsFail = 0.01;
constexpr double kFewDefects = 40;

struct Level {
  int slots = 0;
  Nanoseconds time = 0;
  double scatter = 0.0; // of the mean of the frames, DN
  std::uint16_t bits_seen = 0;
  StackMeans means;
};

/** The measurement, step by step. */
class PhotonTransferRun
{
public:
  explicit PhotonTransferRun (Examination &examination)
      : examination_ (examination), fine_ (fine_slots (examination, kShortest)),
        largest_ (examination.rig.parts ().largest ())
  {
  }

  Result<Finding> run ()
  {
    RETURN_IF_ERROR (find_range ());
    RETURN_IF_ERROR (see_levels ());
    RETURN_IF_ERROR (see_off ());
    if (evaluate ()) {
      report ();
      plot ();
    }
    diagnose ();
    if (examination_.exhibits) {
      finding_.exhibits.push_back (
          {"Dark frames, mean", picture_of (dark_.mean, dark_means_.mean - 2.0,
                                    dark_means_.mean + 0.05 * largest_)});
      finding_.exhibits.push_back (
          {"Bright frames, mean", picture_of (bright_.mean, 0.0, largest_)});
    }
    return std::move (finding_);
  }

private:
  /* Darkness, and the longest light that does not saturate. */
  Result<void> find_range ()
  {
    ASSIGN_OR_RETURN (dark_,
        look_at_light (examination_, no_light (), fine_.of, kDarkFrames));
    start_ = dark_.time;
    for (top_ = fine_.slots;; top_ = std::max (1, top_ * 3 / 4)) {
      ASSIGN_OR_RETURN (
          bright_, look_at_light (examination_, lit (fine_.first, top_),
                       fine_.of, kReferenceFrames, &dark_.mean));
      defects_ = find_defects (dark_.mean, bright_.mean, largest_);
      const StackMeans means = means_of (bright_, defects_.good.view ());
      if (means.full < kFull || top_ < 4)
        break;
      saturates_ = true;
    }
    dark_means_ = means_of (dark_, defects_.good.view ());
    const StackMeans bright = means_of (bright_, defects_.good.view ());
    parts_ = light_parts (dark_.mean, bright_.mean, defects_.good.view ());
    spread_ = bright.spread / std::max (1.0, signal (bright));
    return {};
  }

  Result<void> see_levels ()
  {
    for (std::size_t i = 0; i < kLevels.size (); i++) {
      if (i % kLevelsPerReference == 0)
        RETURN_IF_ERROR (see_reference ());
      const int slots = std::max (1, int (std::lround (kLevels[i] * top_)));
      if (std::ranges::find (levels_, slots, &Level::slots) != levels_.end ())
        continue;
      ASSIGN_OR_RETURN (const Stack stack,
          look_at_light (examination_, lit (fine_.first, slots), fine_.of,
              kFrames, &dark_.mean));
      levels_.push_back (
          {slots, stack.time, stack.scatter / std::sqrt (stack.frames),
              stack.bits_seen, means_of (stack, defects_.good.view ())});
    }
    RETURN_IF_ERROR (see_reference ());
    std::ranges::sort (levels_, {}, &Level::slots);
    const Polynomial line = fit_polynomial (references_, 1);
    double light = 0.0;
    for (const Sample &reference : references_) {
      drift_from_ += reference.x / double (references_.size ());
      light += reference.value / double (references_.size ());
    }
    if (light > 0.0 && line.factors.allFinite ())
      drift_ = line.factors[1] / light;
    return {};
  }

  Result<void> see_reference ()
  {
    ASSIGN_OR_RETURN (
        const Stack stack, look_at_light (examination_, lit (fine_.first, top_),
                               fine_.of, kReferenceFrames, &dark_.mean));
    if (references_.empty ())
      reference_ = stack.mean;
    moved_ = change_between ({std::as_const (reference_).view (), stack.frames},
        {std::as_const (stack.mean).view (), stack.frames}, stack, dark_.mean);
    references_.push_back ({double (stack.time - start_) * 1e-9,
        signal (means_of (stack, defects_.good.view ())), 1.0});
    return {};
  }

  /* Two exposure times separate black from light of mirrors that are off. */
  Result<void> see_off ()
  {
    const auto first = fit_photon_transfer (points ({}));
    if (first && dark_means_.variance < kRounded) {
      ASSIGN_OR_RETURN (const auto sight,
          measure_dither (examination_, fine_, top_, dark_.mean, bright_.mean,
              defects_.good.view (), *first));
      if (sight && sight->dark.off.value < kMostOff * largest_) {
        dithered_ = sight->dark;
        off_.light = sight->dark.off;
        off_.shorter = sight->shorter;
        return {};
      }
    }
    ASSIGN_OR_RETURN (
        off_, measure_off_light (examination_, kDarkFrames, fine_, 0,
                  defects_.good.view (), dark_.mean, parts_, 0.0));
    return {};
  }

  /* Light is counted in slots; mirrors that are off add @leak, if it is known.
   */
  std::vector<TransferPoint> points (std::optional<double> leak) const
  {
    const double leak_slots = leak.value_or (0.0);
    std::vector<TransferPoint> all;
    const auto add = [&] (const StackMeans &means, double slots,
                         double scatter) {
      if (means.full < kFull && means.zeros < kZeros)
        all.push_back (point_of (means, slots, scatter));
    };
    if (!dithered_)
      add (dark_means_, leak_slots, 0.0);
    for (const Level &level : levels_)
      if (!plateau_ || level.means.mean < 0.9 * *plateau_) {
        const double time = double (level.time - start_) * 1e-9 - drift_from_;
        add (level.means, level.slots * (1.0 + drift_ * time) + leak_slots,
            level.scatter);
      }
    if (dithered_)
      all.push_back ({0.0, {dithered_->black.value, kDarkError}});
    else if (leak)
      add (off_.shorter, off_.part * leak_slots, 0.02);
    return all;
  }

  TransferPoint point_of (
      const StackMeans &means, double slots, double scatter) const
  {
    const double light = std::max (0.0, signal (means));
    const double gain = transfer_ ? transfer_->conversion_gain.value : 0.0;
    const auto exact = unrounded ({means.mean, means.variance},
        offsets_of (parts_, light), gain > 0.0 ? light / (gain * gain) : 0.0);
    TransferPoint point = {slots, {means.mean, 0.0}};
    double rounding = spread_ * light > 0.5 ? 0.02 : 0.25;
    if (exact) {
      point.mean.value = exact->mean;
      rounding = 0.004;
      const double relative =
          std::hypot (kVarianceError * (0.3 + light / largest_),
              std::sqrt (2.0 / means.values));
      point.variance = Measured{exact->variance,
          std::hypot (kUnroundedError, relative * means.variance)};
    }
    const double slot = transfer_ ? transfer_->slope : 0.0;
    const double times = slot * kTimeError * fine_.of /
                         double (examination_.rig.parts ().rate.period ());
    point.mean.sigma = std::hypot (std::hypot (rounding, times),
        std::hypot (kLightError * light, scatter));
    return point;
  }

  double signal (const StackMeans &means) const
  {
    return means.mean - dark_means_.mean;
  }

  bool evaluate ()
  {
    auto first = fit_photon_transfer (points ({}));
    if (!first)
      return false;
    const Level &top = levels_.back ();
    const double expected = signal (top.means) / first->conversion_gain.value;
    if (top.means.full < kFull && top.means.variance < kFullWell * expected) {
      plateau_ = top.means.mean;
      first = fit_photon_transfer (points ({}));
      if (!first)
        return false;
    }
    transfer_ = first;
    transfer_ = fit_photon_transfer (points (off_.light.value / first->slope));
    if (!transfer_)
      return false;
    if (dithered_) {
      transfer_->set_floor (dithered_->variance);
      black_ = dithered_->black;
      return true;
    }
    black_ = {transfer_->dark.value,
        std::hypot (transfer_->dark.sigma, off_.light.sigma)};
    const double electrons_per_number = transfer_->conversion_gain.value;
    transfer_->read_variance.sigma = std::hypot (transfer_->read_variance.sigma,
        electrons_per_number * off_.light.sigma);
    return true;
  }

  void report ()
  {
    BenchProfile &profile = examination_.profile;
    const double range = largest_ - black_.value;
    const double top = plateau_.value_or (largest_);
    const Measured electrons = transfer_->electrons_of (top);
    const double numbers = top - black_.value;
    const Measured gain = {
        electrons.value / numbers, electrons.sigma / numbers};
    const Measured full_well = {electrons.value,
        std::hypot (electrons.sigma, gain.value * black_.sigma)};
    const Measured bow = transfer_->deviation (
        points (off_.light.value / transfer_->slope), largest_);
    /* Flicker makes a bow, too. */
    const Measured linearity = {
        bow.value / range, std::hypot (kBowError, bow.sigma / range)};
    const bool known =
        std::isfinite (gain.value) && gain.sigma < kUnknown * gain.value;
    const bool floor =
        known && off_.shorter.zeros <= kZeros && missing_bits () == 0;
    const auto keep = [] (bool is_known, const Measured &number) {
      return is_known && is_finite (number) ? std::optional (number)
                                            : std::nullopt;
    };
    profile.conversion_gain = keep (known, gain);
    profile.full_well = keep (known, full_well);
    profile.read_noise = keep (floor, transfer_->read_noise);
    profile.black_level = keep (floor, black_);
    profile.linearity_error = keep (true, linearity);
    finding_.readings = {
        {"conversion gain", gain, "e-/DN"}, {"full well", full_well, "e-"}};
    finding_.add ("read noise", transfer_->read_noise);
    finding_.readings.push_back ({"black level", black_, "DN"});
    linearity_ = scaled (linearity, 100.0);
    finding_.add ("linearity error", linearity_);
    finding_.notes.push_back ({"saturation",
        plateau_ ? "The well is full at " + fixed (*plateau_, 0) + " DN."
        : saturates_
            ? "Pixels reach the largest DN."
            : "The light does not saturate pixels: the full well is taken as "
              "that of the largest DN."});
  }

  void diagnose ()
  {
    finding_.measure (kChange, moved_);
    const int bits = examination_.rig.parts ().bits;
    finding_.judge_bits (missing_bits (), bits);
    diagnose_black ();
    const bool known = !finding_.is_ill ();
    const double light = signal (levels_.back ().means) / largest_;
    if (transfer_ && known) {
      finding_.judge ("linearity error", linearity_);
      finding_.judge ("read noise", transfer_->read_noise);
    } else if (known && light < kDim) {
      finding_.blame (
          "dark", "the brightest level has " + fixed (100 * light, 0) +
                      " % of the range, too little to measure noise");
    } else if (known) {
      const Level &top = levels_.back ();
      double bend = 0.0;
      for (const Level &level : levels_)
        bend = std::max (
            bend, std::abs (signal (level.means) / signal (top.means) -
                            double (level.slots) / top.slots));
      if (finding_.measure ("linearity error", {100.0 * bend, 0.2}) ==
          Verdict::pass)
        finding_.blame (
            "noise", "noise does not grow with light as that of photons does");
    }
    diagnose_pixels ();
    diagnose_defects ("dead-pixels", "do not see light", defects_.dead);
    diagnose_defects (
        "hot-pixels", "have a signal without light", defects_.hot);
  }

  /* Light of mirrors that are off may lift all pixels from 0; without it, noise
   * is cut off all the same. */
  void diagnose_black ()
  {
    constexpr const char *kId = "black-clipped";
    constexpr double kQuiet = 0.05; // noise, DN
    const double zeros = std::max (off_.shorter.zeros, dark_means_.zeros);
    const Measured seen = {100.0 * zeros, 0.0};
    if (transfer_ && missing_bits () == 0 &&
        verdict_of (kId, seen) < Verdict::warn) {
      const double gain = transfer_->conversion_gain.value;
      const Measured noise = scaled (transfer_->read_noise, 1.0 / gain);
      const double sigma = std::max (kQuiet, noise.value);
      const double below = (0.5 - black_.value) / sigma;
      const double density =
          std::exp (-0.5 * below * below) / std::sqrt (2.0 * std::numbers::pi);
      const Measured part = {0.5 * std::erfc (-below / std::numbers::sqrt2),
          density * std::hypot (black_.sigma, below * noise.sigma) / sigma};
      if (verdict_of (kId, scaled (part, 100.0)) >= Verdict::warn) {
        finding_.judge (kId, scaled (part, 100.0),
            "the black level is " + fixed (black_.value, 1) +
                " DN: without light that leaks past the mirrors, " +
                fixed (100.0 * part.value, 0) +
                " % of the dark pixel values are 0, where noise is cut off");
        return;
      }
    }
    finding_.judge (kId, seen);
  }

  /* By how much the pixels' sensitivity differs, beyond the noise of means. */
  void diagnose_pixels ()
  {
    constexpr double kError = 0.02; // relative
    const StackMeans bright = means_of (bright_, defects_.good.view ());
    const double noise = (bright.variance / bright_.frames +
                             dark_means_.variance / dark_.frames) /
                         std::pow (std::max (1.0, signal (bright)), 2);
    const double part =
        std::sqrt (std::max (0.0, std::pow (defects_.spread, 2) - noise));
    finding_.measure ("prnu", scaled ({part, kError * part}, 100.0));
  }

  void diagnose_defects (
      const char *id, const char *what, const std::vector<Offset> &pixels)
  {
    const double count = double (pixels.size ());
    const std::string name =
        std::string (id, std::strchr (id, '-')) + " pixels";
    finding_.readings.push_back ({name, {count, 0.0}, ""});
    std::vector<Position> places;
    for (const Offset &at : pixels)
      places.push_back ({double (at.x), double (at.y)});
    if (!places.empty ())
      finding_.notes.push_back ({name, places_text (places)});
    const double all = double (dark_.mean.width ()) * dark_.mean.height ();
    if (count > std::max (kFewDefects, kDefectsWarn * all))
      finding_.blame (id, fixed (count, 0) + " pixels " + what,
          count > kDefectsFail * all ? Verdict::fail : Verdict::warn);
  }

  void plot ()
  {
    Plot response{"Response", "light, slots", "mean, DN"};
    Plot noise{"Photon transfer", "mean, DN", "variance, DN²"};
    for (const TransferPoint &p :
        points (off_.light.value / transfer_->slope)) {
      response.points.push_back ({p.light, p.mean.value});
      response.model.push_back ({p.light, transfer_->number_of (p.light)});
      if (!p.variance)
        continue;
      noise.points.push_back ({p.mean.value, p.variance->value});
      const double gain = transfer_->conversion_gain.value;
      const double steep =
          1.0 + 2.0 * transfer_->bow * p.light / transfer_->slope;
      noise.model.push_back ({p.mean.value,
          steep * steep *
              (transfer_->slope * p.light / gain +
                  transfer_->read_variance.value / (gain * gain))});
    }
    for (Plot *each : {&response, &noise}) {
      std::ranges::sort (each->points, {}, &Position::x);
      std::ranges::sort (each->model, {}, &Position::x);
      finding_.plots.push_back (std::move (*each));
    }
  }

  int missing_bits () const
  {
    std::uint16_t seen = dark_.bits_seen;
    for (const Level &level : levels_)
      seen = std::uint16_t (seen | level.bits_seen);
    return seen == 0 ? 0 : std::countr_zero (seen);
  }

  Examination &examination_;
  Examination::Lit fine_;
  int largest_;
  Finding finding_ = {"sensor",
      "all mirrors, on for parts of the exposure of different lengths"};

  Stack dark_, bright_;
  StackMeans dark_means_;
  Defects defects_;
  int top_ = 0;            // slots of the brightest level
  bool saturates_ = false; // with all slots
  std::vector<Level> levels_;
  std::vector<Sample> references_;        // signals over times, s
  Image<float> reference_;                // the first one
  Measured moved_ = kNotMeasured;         // of the last one against it
  double drift_ = 0.0, drift_from_ = 0.0; // 1/s, s
  Nanoseconds start_ = 0;
  double spread_ = 0.0;       // of the pixels' light, as a part of it
  std::vector<double> parts_; // of the light that pixels get
  OffLight off_;
  std::optional<Dark> dithered_; // where rounding hides the dark
  std::optional<PhotonTransfer> transfer_;
  Measured black_;
  Measured linearity_;            // % of the range
  std::optional<double> plateau_; // DN of a full well below the largest DN
};

} // namespace

Result<Finding>
check_sensor (Examination &examination)
{
  return or_no_frames (PhotonTransferRun (examination).run (), "sensor");
}

} // namespace codedexposure
