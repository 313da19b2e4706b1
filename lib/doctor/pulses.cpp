/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/pulses.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>
#include <vector>

#include "base/statistics.h"
#include "doctor/line_search.h"
#include "doctor/runs.h"
#include "estimate/least_squares.h"

namespace codedexposure
{

namespace
{

/* Lengths of the runs, by that of the longest: no frequency of pulses has whole
 * numbers of them in all three. */
constexpr double kLengths[] = {1.0, 0.9, 0.84};
/* Of the longest run, s, and as a part of the period, within both of which it
 * lies; where it is short, light of some DN is rounded. A DMD shows no mask for
 * a shorter time than the least. */
constexpr double kLongest = 3.6e-3, kLongestPart = 0.09;
constexpr double kLeast = 0.135e-3, kLeastPart = 0.15;
/* Runs of which nothing is known, s. */
constexpr double kMoment = 1.07e-3;
constexpr int kPlaces = 6, kFrames = 2;
constexpr int kSlots = 8;  // of a run
constexpr int kRounds = 4; // of a fit
/* Part of a flicker that is no such line. */
constexpr double kUnlike = 0.04;
/* By how much more, as a part of their light, short runs change than long ones
 * where the light is switched and not only slow. */
constexpr double kFaster = 2.5;
/* The same of runs that are a third as long: pulses give both the same light.
 */
constexpr double kFasterThird = 1.4;

/* Weak flicker: its depth, which no check complains about, and frequencies, Hz;
 * and the part of the squares that a fit with it leaves at most. */
constexpr double kWeak = 0.01, kSlowest = 0.5, kFastest = 1200.0, kLeft = 0.1;

/** In 0..1, evenly spread. */
double
spread (int place)
{
  const double turns = (place + 1) * std::numbers::phi;
  return turns - std::floor (turns);
}

/** How the light of runs differs from place to place, as parts of it. */
struct Change {
  double rms = 0.0;
  double brighter = 0.0; ///< the brightest ones, by the median
};

/** Runs of @p slots slots in the middle half of the period, which any exposure
 * sees. */
Result<Change>
change_of_runs (Examination &examination, int grid, int slots)
{
  Runs runs (examination, grid);
  const int first = grid / 4, room = grid / 2 - slots;
  ASSIGN_OR_RETURN (
      const auto dark, look (examination, no_light (), 1, kFrames));
  double black = 0.0;
  for (const SeenFrame &frame : dark)
    black += mean_of (frame.picture.view ()) / double (dark.size ());
  for (int place = 0; place < 2 * kPlaces; place++)
    RETURN_IF_ERROR (runs.see (
        lit (first + int (spread (place) * room), slots), 0, kFrames));
  double sum = 0.0, squares = 0.0;
  std::vector<double> lights;
  for (const LightSample &sample : runs.samples) {
    lights.push_back (sample.light - black);
    sum += lights.back ();
    squares += lights.back () * lights.back () - sample.doubt * sample.doubt -
               sample.noise * sample.noise;
  }
  const double count = std::max (1.0, double (lights.size ()));
  const double mean = std::max (sum / count, 1e-3);
  const double high = quantile (lights, 0.95), middle = median (lights);
  return Change{
      std::sqrt (std::max (0.0, squares / count / (mean * mean) - 1.0)),
      high / std::max (middle, 1e-3) - 1.0};
}

/** Frequencies, Hz, at which light may flicker without being pulses: those that
 * were seen, and those of the mains, which hide where nothing else was seen. */
std::vector<double>
frequencies_of (const LightFit &light)
{
  std::vector<double> all;
  for (const LightFit::Line &line : light.lines)
    all.push_back (line.frequency.value);
  for (const double mains : {100.0, 120.0})
    if (std::ranges::none_of (all,
            [mains] (double each) { return std::abs (each - mains) < 1.0; }))
      all.push_back (mains);
  return all;
}

/** The light of runs as parts of their mean, fitted with flicker. */
class RunFit
{
public:
  explicit RunFit (const LightFit &light)
      : light_ (light), frequencies_ (frequencies_of (light))
  {
  }

  void add (const Runs &runs)
  {
    const LightModel &model = light_.model;
    const double offset = model.offsets.size () > 1 ? model.offsets[1] : 0.0;
    double mean = 0.0;
    for (const LightSample &sample : runs.samples)
      mean += (sample.light - offset) / double (runs.samples.size ());
    for (const LightSample &sample : runs.samples)
      if (mean > 0.0)
        parts_.push_back ({added_, sample, (sample.light - offset) / mean,
            sample.doubt / mean, sample.noise / mean});
    added_++;
  }

  /** Squares that are left of those of add () number @p first to @p last, the
   * mean, without what rounding and noise explain; the sigma is that of the
   * noise. None if there are too few. */
  std::optional<Measured> rest (int first, int last) const
  {
    const Eigen::MatrixXd rows = this->rows ();
    const double looks = double (parts_.size ()) / kFrames;
    const double free = looks - double (rows.cols ());
    if (free < 3.0)
      return std::nullopt;
    const auto [rest, flicker] = solve (rows);
    /* Frames of a look have their own noise, of which the fit takes less away
     * than of what they share. */
    const double unshared =
        (1.0 - double (rows.cols ()) / double (parts_.size ())) * looks / free;
    double squares = 0.0, noises = 0.0, count = 0.0;
    for (std::size_t i = 0; i < parts_.size (); i++) {
      const auto &[runs, sample, value, doubt, noise] = parts_[i];
      if (runs < first || runs > last)
        continue;
      const double left = rest[Eigen::Index (i)];
      squares += left * left * looks / free - doubt * doubt -
                 std::pow (kUnlike * flicker[Eigen::Index (i)], 2);
      noises += unshared * noise * noise;
      count++;
    }
    count = std::max (1.0, count);
    return Measured{std::max (0.0, (squares - noises) / count),
        noises / count * std::sqrt (2.0 / count)};
  }

  /** Adds weak flicker that the check of the trigger has not seen; a line that
   * is found by chance leaves much of the light of pulses. */
  void find_flicker ()
  {
    const auto before = rest (0, added_ - 1);
    if (!before)
      return;
    LineSearch search;
    search.others = rows ();
    search.residual = solve (search.others).rest;
    for (std::size_t i = 0; i < parts_.size (); i++) {
      const LightSample &sample = parts_[i].sample;
      const double time = sample.time - light_.epoch;
      search.lit.push_back ({int (i), 1.0 / (sample.until - sample.from),
          time + sample.from, time + sample.until});
    }
    const LightLine line = search.strongest (kSlowest, kFastest);
    if (line.depth () > kWeak)
      return;
    frequencies_.push_back (line.frequency);
    const auto after = rest (0, added_ - 1);
    if (!after || after->value > kLeft * before->value)
      frequencies_.pop_back ();
  }

private:
  struct Part {
    int runs = 0; // number of its add ()
    LightSample sample;
    double light = 0.0, doubt = 0.0, noise = 0.0; // by the mean
  };
  /** What the fit leaves of each part, and what is flicker in it. */
  struct Fitted {
    Eigen::VectorXd rest, flicker;
  };

  /* A factor for each length, since controllers count in microseconds; cosine
   * and sine of each frequency, as the mean over a run. */
  Eigen::MatrixXd rows () const
  {
    using std::numbers::pi;
    const auto columns = Eigen::Index (frequencies_.size ());
    /* Mirrors that are off pass light in all of the exposure. */
    const LightModel &model = light_.model;
    const double length = model.lengths.back ();
    const double leaks = model.leak * length;
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero (
        Eigen::Index (parts_.size ()), added_ + 2 * columns);
    for (std::size_t i = 0; i < parts_.size (); i++) {
      const auto &[runs, sample, light, doubt, noise] = parts_[i];
      const auto row = Eigen::Index (i);
      rows (row, runs) = 1.0;
      for (Eigen::Index k = 0; k < columns; k++) {
        const double turns = 2.0 * pi * frequencies_[std::size_t (k)];
        const auto add = [&] (double part, double from, double until) {
          const double half = 0.5 * turns * (until - from);
          const double middle =
              turns * (sample.time - light_.epoch + 0.5 * (from + until));
          rows (row, added_ + 2 * k) +=
              part * std::cos (middle) * std::sin (half) / half;
          rows (row, added_ + 2 * k + 1) +=
              part * std::sin (middle) * std::sin (half) / half;
        };
        add (1.0, sample.from, sample.until);
        add (leaks / (sample.until - sample.from), model.start,
            model.start + length);
      }
    }
    return rows;
  }

  Fitted solve (const Eigen::MatrixXd &rows) const
  {
    Fitted fitted;
    Eigen::VectorXd light (rows.rows ());
    for (std::size_t i = 0; i < parts_.size (); i++)
      light[Eigen::Index (i)] = parts_[i].light;
    /* Few runs under strong flicker have another mean than all light has. */
    for (int round = 0; round < kRounds; round++) {
      const Eigen::VectorXd found =
          solve_normal (normal_of (rows), rows.transpose () * light);
      fitted.rest = light - rows * found;
      fitted.flicker = rows.rightCols (rows.cols () - added_) *
                       found.tail (rows.cols () - added_);
      for (std::size_t i = 0; i < parts_.size (); i++)
        light[Eigen::Index (i)] /= found[parts_[i].runs];
    }
    return fitted;
  }

  const LightFit &light_;
  std::vector<double> frequencies_;
  std::vector<Part> parts_;
  int added_ = 0;
};

/** Adds runs of @p slots slots at some places that lie in the exposure. */
Result<void>
see_runs (Runs &runs, const LightModel &model, double period, int slots)
{
  const double start = std::max (0.0, model.start);
  const double end = std::min (period, model.start + model.lengths[1]);
  const int first = int (start / runs.slot ()) + 2;
  const int room = int (end / runs.slot ()) - 2 - slots - first;
  if (room < 1)
    return {};
  for (int place = 0; place < kPlaces; place++)
    RETURN_IF_ERROR (runs.see (
        lit (first + int (spread (place) * room), slots), 1, kFrames));
  return {};
}

} // namespace

Result<Steadiness>
steadiness_of (Examination &examination)
{
  /* Jitter of the exposure takes light away, but gives none. */
  constexpr double kPulsed = 0.05, kBrighter = 0.2;
  const int grid = int (kSlots * examination.rig.parts ().period () / kMoment);
  if (grid < 8 * kSlots)
    return Steadiness::steady;
  ASSIGN_OR_RETURN (
      const Change shorter, change_of_runs (examination, grid, kSlots));
  ASSIGN_OR_RETURN (
      const Change longer, change_of_runs (examination, grid, grid / 8));
  if (shorter.rms > kPulsed && shorter.rms > kFaster * longer.rms)
    return Steadiness::pulsed;
  return shorter.brighter > kBrighter ? Steadiness::flickers
                                      : Steadiness::steady;
}

Result<Measured>
measure_pulses (Examination &examination)
{
  const auto &light = examination.light;
  const double period = examination.rig.parts ().period ();
  const double longest =
      std::max (kLeast, std::min (kLongest, kLongestPart * period));
  if (!light || light->model.lengths.size () < 2 ||
      longest > kLeastPart * period)
    return kNotMeasured;
  RunFit fit (*light);
  double length = 0.0; // of the shorter ones, s, the mean
  for (const double part : kLengths) {
    Runs runs (examination, int (kSlots * period / (part * longest)));
    RETURN_IF_ERROR (see_runs (runs, light->model, period, kSlots));
    fit.add (runs);
    length += part * longest / double (std::size (kLengths));
  }
  /* What longer runs have as well is slow, and no pulses. */
  Runs runs (examination, int (kSlots * period / longest));
  RETURN_IF_ERROR (see_runs (runs, light->model, period, runs.grid () / 4));
  fit.add (runs);
  fit.find_flicker ();
  constexpr int kShorter = int (std::size (kLengths));
  const auto shorter = fit.rest (0, kShorter - 1);
  const auto longer = fit.rest (kShorter, kShorter);
  if (!shorter || !longer)
    return kNotMeasured;
  const double faster = shorter->value - longer->value;
  const double square =
      shorter->value > kFasterThird * kFasterThird * longer->value ? faster
                                                                   : 0.0;
  const double looks = kShorter * kPlaces;
  const double doubt = std::hypot (
      square * std::sqrt (2.0 / looks), shorter->sigma, longer->sigma);
  const double rms = std::sqrt (square);
  return scaled (
      {rms, std::min (std::sqrt (doubt), doubt / std::max (2.0 * rms, 1e-12))},
      length);
}

} // namespace codedexposure
