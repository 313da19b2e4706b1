/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/pulses.h"

#include <cmath>
#include <iterator>
#include <numbers>
#include <vector>

#include "base/statistics.h"
#include "doctor/runs.h"

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
constexpr int kPlaces = 4, kFrames = 4;
constexpr int kSlots = 8; // of a run
/* By how much more, as a part of their light, short runs change than long ones
 * where the light is switched and not only slow. */
constexpr double kFaster = 2.5;
/* The same of runs that are a third as long: pulses give both the same light.
 */
constexpr double kFasterThird = 1.7;
/* Squares that a model leaves of a change that it explains. */
constexpr double kExplained = 0.02;

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
    squares += lights.back () * lights.back ();
  }
  const double count = std::max (1.0, double (lights.size ()));
  const double mean = std::max (sum / count, 1e-3);
  const double high = quantile (lights, 0.95), middle = median (lights);
  return Change{
      std::sqrt (std::max (0.0, squares / count / (mean * mean) - 1.0)),
      high / std::max (middle, 1e-3) - 1.0};
}

/** Squares of what the light of runs differs from what it should be, as parts
 * of it. */
struct Rest {
  double squares = 0.0, count = 0.0;

  double mean () const { return squares / std::max (1.0, count); }
  void add (const Runs &runs, const LightFit &light);
};

void
Rest::add (const Runs &runs, const LightFit &light)
{
  const LightModel &model = light.model;
  const double offset = model.offsets.size () > 1 ? model.offsets[1] : 0.0;
  double seen = 0.0, expected = 0.0, doubt = 0.0;
  std::vector<std::pair<double, double>> pairs;
  for (LightSample sample : runs.samples) {
    sample.time -= light.epoch;
    doubt += sample.doubt * sample.doubt;
    pairs.emplace_back (sample.light - offset, model.light (sample) - offset);
    seen += pairs.back ().first;
    expected += pairs.back ().second;
  }
  const double mean = seen / std::max (1.0, double (pairs.size ()));
  if (!(mean > 0.0) || !(expected > 0.0))
    return;
  /* Controllers count in microseconds: each length has its own factor. Lines
   * that the model has may be what it takes pulses for. */
  double steady = 0.0, modelled = 0.0;
  for (const auto &[is, should] : pairs) {
    steady += std::pow (is / mean - 1.0, 2);
    modelled +=
        std::pow (is / mean - should * double (pairs.size ()) / expected, 2);
  }
  if (modelled > kExplained * steady)
    squares +=
        std::max (0.0, std::min (steady, modelled) - doubt / (mean * mean));
  count += double (pairs.size ());
}

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
  Rest shorter, longer;
  double length = 0.0; // of the shorter ones, s, the mean
  for (const double part : kLengths) {
    Runs runs (examination, int (kSlots * period / (part * longest)));
    RETURN_IF_ERROR (see_runs (runs, light->model, period, kSlots));
    shorter.add (runs, *light);
    length += part * longest / double (std::size (kLengths));
  }
  /* What longer runs have as well is slow, and no pulses. */
  Runs runs (examination, int (kSlots * period / longest));
  RETURN_IF_ERROR (see_runs (runs, light->model, period, runs.grid () / 4));
  longer.add (runs, *light);
  if (shorter.count < 2.0 * kFrames || longer.count < kFrames)
    return kNotMeasured;
  const double rms =
      shorter.mean () > kFasterThird * kFasterThird * longer.mean ()
          ? length * std::sqrt (shorter.mean () - longer.mean ())
          : 0.0;
  return Measured{rms, rms / std::sqrt (2.0 * shorter.count)};
}

} // namespace codedexposure
