/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/switching.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include "base/statistics.h"
#include "base/try.h"
#include "estimate/least_squares.h"

namespace codedexposure
{

namespace
{

/* Frames of light that goes off about when the exposure ends, whose jitter then
 * changes it, and of other light. */
constexpr int kFramesAbout = 20, kFramesElse = 6;
constexpr Nanoseconds kStep = 25'000;   // of the places of a slot
constexpr Nanoseconds kLeast = 110'000; // of a mask, and of darkness
/* Slots by which a run begins earlier than that of the look before. */
constexpr int kEarlier = 3;
/* Of the light that all points have, at least; and as a part of the period,
 * without which rounding makes steps of it. */
constexpr double kBefore = 3.5e6, kBeforePart = 0.09;
/* The earliest moment that must be there: high frame rates have no earlier. */
constexpr Nanoseconds kFirst = -1'500'000;
/* Of the moments at which mirrors go off, from the end of the exposure on. */
constexpr Nanoseconds kMoments[] = {-2'500'000, -1'500'000, -1'000'000,
    -700'000, -500'000, -350'000, -250'000, -175'000, -125'000, -75'000,
    -25'000, 0, 25'000, 75'000, 150'000, 300'000, 600'000, 1'100'000,
    1'600'000};
/* Error of the light of a point, relative: flicker and drift. */
constexpr double kLightError = 0.0002;
/* The same of flicker, relative to it: jitter and its own form. */
constexpr double kFlickerError = 0.02;
/* By how much flicker and a bent response change the slope in a ms. */
constexpr double kCurvature = 0.02;
/* Moments about the end of the exposure. */
constexpr Nanoseconds kAboutFrom = -100'000, kAboutUntil = 100'000;
constexpr double kLongest = 4e-3; // transition that points can show, s

/* Light, in seconds, of mirrors that go off at @time, within @took, seen until
 * the exposure's @end. */
double
light_of (double time, double took, double end)
{
  if (time >= end)
    return end - 0.5 * took;
  const double over = time + took - end;
  return over > 0.0 ? time - 0.5 * over * over / std::max (1e-9, took) : time;
}

/* The same of many exposures, whose end jitters by @jitter, rms. */
double
mean_light_of (double time, double took, double end, double jitter)
{
  if (jitter <= 0.0)
    return light_of (time, took, end);
  const double off = std::sqrt (3.0) * jitter; // Gauss-Hermite
  return (light_of (time, took, end - off) + 4 * light_of (time, took, end) +
             light_of (time, took, end + off)) /
         6;
}

/* Light by ms, before the bend. */
double
slope_of (const std::vector<SwitchPoint> &points)
{
  const auto next = std::ranges::find_if (points,
      [&points] (const SwitchPoint &p) { return p.time > points[0].time; });
  if (next == points.end ())
    return 1e-3;
  const double ms =
      1e3 * (next->time - next->from - points[0].time + points[0].from);
  return std::max (1e-3, (next->light - points[0].light) / ms);
}

/* Chi-square of the best parabola through the points, for a bend: slow flicker
 * and a response that is not quite linear curve the line a little. */
double
misfit (const std::vector<SwitchPoint> &points, double took, double end,
    double jitter)
{
  const Eigen::Index count = Eigen::Index (points.size ());
  const Eigen::Index lines = Eigen::Index (points[0].flicker.size ());
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero (count + 1 + lines, 3 + lines);
  Eigen::VectorXd lights = Eigen::VectorXd::Zero (count + 1 + lines);
  for (Eigen::Index i = 0; i < count; i++) {
    const SwitchPoint &point = points[std::size_t (i)];
    const double ms = 1e3 * (mean_light_of (point.time, took, end, jitter) -
                                point.from - points[0].time + points[0].from);
    rows.row (i).head<3> () << 1.0, ms, ms * ms;
    for (Eigen::Index line = 0; line < lines; line++)
      rows (i, 3 + line) = point.flicker[std::size_t (line)];
    rows.row (i) /= point.sigma;
    lights (i) = point.light / point.sigma;
  }
  rows (count, 2) = 1.0 / (0.5 * kCurvature * slope_of (points));
  for (Eigen::Index line = 0; line < lines; line++)
    rows (count + 1 + line, 3 + line) = 1e-3 / slope_of (points);
  const Eigen::VectorXd curve =
      solve_normal (normal_of (rows), rows.transpose () * lights);
  return (lights - rows * curve).squaredNorm ();
}

/* The least misfit of all moments at which the exposure may end. */
double
best_misfit (const std::vector<SwitchPoint> &points, double took, double jitter)
{
  double from = points.front ().time, to = points.back ().time;
  double best = 0.0, at = 0.0;
  for (int round = 0; round < 4; round++) {
    const double step = (to - from) / 40;
    best = misfit (points, took, at = from, jitter);
    for (double end = from; end <= to; end += step)
      if (const double now = misfit (points, took, end, jitter); now < best) {
        best = now;
        at = end;
      }
    from = at - step;
    to = at + step;
  }
  return best;
}

} // namespace

Measured
fit_switching (const std::vector<SwitchPoint> &points, double jitter)
{
  constexpr int kGrid = 400;
  std::vector<double> values;
  for (int i = 0; i <= kGrid; i++)
    values.push_back (best_misfit (points, kLongest * i / kGrid, jitter));
  const auto least = std::ranges::min_element (values);
  const double freedom = std::max (
      1.0, double (points.size ()) - 5.0 - double (points[0].flicker.size ()));
  const double unit = std::max (1.0, *least / freedom);
  /* Two standard deviations are where chi-square has grown by four; fast
   * mirrors are all alike, so that the least may lie anywhere in between. */
  int low = int (least - values.begin ()), high = low;
  while (low > 0 && values[std::size_t (low)] < *least + 4.0 * unit)
    low--;
  while (high < kGrid && values[std::size_t (high)] < *least + 4.0 * unit)
    high++;
  const double step = kLongest / kGrid;
  return {0.5 * (low + high) * step,
      std::max (0.5 * step, 0.25 * (high - low) * step)};
}

namespace
{

/* Seconds of light that the known lines of the lamp add to runs [@from, @until)
 * of @frames cycles, the mean of whose times is @time; cosine and sine of their
 * depth. */
std::vector<double>
flicker_of (const Examination &examination, double time, double from,
    double until, int frames)
{
  using std::numbers::pi;
  std::vector<double> parts;
  if (!examination.light)
    return parts;
  for (const LightFit::Line &line : examination.light->lines) {
    const double turns = 2.0 * pi * line.frequency.value;
    const double at = turns * (time - examination.light->epoch);
    /* Of one that is not in step with the frames, the mean is less. */
    const double step = 0.5 * turns * examination.rig.parts ().period ();
    const double left =
        std::abs (std::sin (step)) < 1e-6
            ? 1.0
            : std::sin (frames * step) / (frames * std::sin (step));
    const double depth = line.depth.value * left / turns;
    parts.push_back (
        depth * (std::sin (at + turns * until) - std::sin (at + turns * from)));
    parts.push_back (
        depth * (std::cos (at + turns * from) - std::cos (at + turns * until)));
  }
  return parts;
}

/* The mean of @frames whose light goes off with the end of @run. */
Result<SwitchPoint>
see_point (Examination &examination, const Examination::Lit &run, double end,
    int frames, const Image<float> &dark, ImageView<const std::uint8_t> good)
{
  ASSIGN_OR_RETURN (
      const Stack stack, look_at_light (examination, lit (run.first, run.slots),
                             run.of, frames, &dark));
  const StackMeans means = means_of (stack, good);
  /* Rounding is an error of the mean where there is little noise. */
  const double noise =
      std::max (0.0, means.variance - 1.0 / 12.0) + means.spread * means.spread;
  const double rounding = 0.3 * std::exp (-20.0 * noise);
  const double period = double (examination.rig.parts ().rate.period ());
  const double black = mean_of (dark.view ());
  const double grown =
      examination.light
          ? examination.light->drift.value *
                (1e-9 * double (stack.time) - examination.light->epoch)
          : 0.0;
  const double slot = 1e-9 * period / run.of;
  const double from = slot * run.first, off = slot * (run.first + run.slots);
  std::vector<double> flicker = flicker_of (examination,
      1e-9 * double (stack.time), from, std::min (off, 1e-9 * end), frames);
  double changed = 0.0; // s, squared
  for (const double part : flicker)
    changed += part * part;
  const double unlike = kFlickerError * (means.mean - black) *
                        std::sqrt (changed) / std::max (slot, off - from);
  return SwitchPoint{off, black + (means.mean - black) / (1.0 + grown),
      std::hypot (std::hypot (rounding, unlike),
          std::hypot (
              kLightError * means.mean, stack.scatter / std::sqrt (frames))),
      from, std::move (flicker)};
}

/* The points of all moments; @run begins with its slot, and somewhat earlier
 * each time, so that rounding makes other errors. */
Result<void>
see_points (Examination &examination, Examination::Lit run, double end,
    std::vector<SwitchPoint> &points, const Image<float> &dark,
    ImageView<const std::uint8_t> good)
{
  const double period = double (examination.rig.parts ().rate.period ());
  const int earlier = int (points.size () / std::size (kMoments)) * kEarlier;
  if ((run.first - earlier) * period / run.of > double (kLeast))
    run.first -= earlier;
  for (const Nanoseconds moment : kMoments) {
    const double time = end + double (moment);
    run.slots = int (std::lround (time * run.of / period)) - run.first;
    if (moment < kFirst && time < double (kLeast))
      continue;
    if (time > period - double (kLeast))
      break;
    const bool about = moment > kAboutFrom && moment < kAboutUntil;
    ASSIGN_OR_RETURN (const SwitchPoint point,
        see_point (examination, run, end, about ? kFramesAbout : kFramesElse,
            dark, good));
    points.push_back (point);
  }
  std::ranges::stable_sort (points, {}, &SwitchPoint::time);
  return {};
}

} // namespace

Result<Measured>
measure_switching (Examination &examination, const Image<float> &dark,
    ImageView<const std::uint8_t> good, std::vector<SwitchPoint> &points)
{
  const Nanoseconds period = examination.rig.parts ().rate.period ();
  const int slots = int (std::clamp<Nanoseconds> (period / kStep, 8, 8192));
  const auto slot_at = [&] (double time) {
    return int (std::lround (time * slots / double (period)));
  };
  const double delay = value_or (examination.profile.trigger_delay, 0.0);
  const double end = delay + 0.5 * double (period);
  const int least = slot_at (double (kLeast)) + 1;
  int first = slot_at (end - std::max (kBefore, kBeforePart * double (period)));
  if (first < least)
    first = 0;
  if (slot_at (end + double (kFirst)) < first + least)
    return Error{"The frame period is too short to see mirrors move.",
        ErrorCode::unsupported};

  RETURN_IF_ERROR (with_exposure (examination, period / 2, [&] {
    return see_points (examination, {first, 0, slots}, end, points, dark, good);
  }));
  return fit_switching (points, examination.jitter);
}

} // namespace codedexposure
