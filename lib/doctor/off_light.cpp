/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/off_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/try.h"
#include "doctor/rounding.h"

namespace codedexposure
{

namespace
{

/* The short exposure is that part of the frame period, or longer: it ends this
 * much time after the light of the pedestal. */
constexpr int kShorter = 5;
constexpr double kAfterPedestal = 50e3; // ns
/* Change of the light from look to look, DN, above which there are several
 * looks; it is 0.02 % of half of what a pixel of 8 bits can hold. */
constexpr double kUnsteady = 0.025;
constexpr int kRounds = 3;
/* Variance of the noise with which rounding can be undone, DN squared. */
constexpr double kEnough = 0.16;
/* Error of a mean that is left where rounding was undone, and where not, DN. */
constexpr double kUnrounded = 0.001, kRounded = 0.25;

Measured
exact_mean (const StackMeans &means, const Offsets &offsets)
{
  const auto exact = unrounded ({means.mean, means.variance}, offsets);
  const double noise =
      std::sqrt (means.variance / std::max (1.0, means.values));
  return exact ? Measured{exact->mean, kUnrounded + noise}
               : Measured{means.mean, kRounded};
}

} // namespace

Offsets
offsets_of (const std::vector<double> &parts, double light)
{
  Offsets offsets;
  for (const double part : parts)
    offsets.push_back ((part - 1.0) * std::max (0.0, light));
  return offsets;
}

int
pedestal_for (
    const Examination::Lit &fine, double slot, double gain, double variance)
{
  if (variance > kEnough || !(slot > 0.0))
    return 0;
  const int most =
      std::max (1, std::min (fine.slots, fine.of / (2 * kShorter)));
  return std::clamp (
      int (std::ceil ((kEnough - variance) * gain / slot)), 1, most);
}

namespace
{

/* By how much the light of two looks at the same slots may differ: flicker in
 * step with the frames has another phase in each. Rms, as a part of it. */
double
steady_flicker (const Examination &examination, int frames)
{
  constexpr double kUnseen = 0.1; // of the faintest line that would be seen
  constexpr double kMostFlicker = 0.01; // that no check complains about
  if (!examination.light)
    return kMostFlicker;
  const double period = examination.rig.parts ().period ();
  double squares = std::pow (kUnseen * examination.light->faintest, 2);
  for (const LightFit::Line &line : examination.light->lines) {
    const double cycles = line.frequency.value * period;
    const double turn =
        std::numbers::pi * (cycles - std::round (cycles)); // of half a frame
    /* The mean of so many frames. */
    const double left = std::abs (turn) < 1e-6 ? 1.0
                                               : std::sin (frames * turn) /
                                                     (frames * std::sin (turn));
    squares += std::pow (line.depth.value * left, 2);
  }
  return std::sqrt (squares);
}

} // namespace

Result<OffLight>
measure_off_light (Examination &examination, int frames,
    const Examination::Lit &fine, int pedestal,
    ImageView<const std::uint8_t> good, const Image<float> &dark,
    const std::vector<double> &parts, double pedestal_light)
{
  const StillMask mask =
      pedestal > 0 ? lit (fine.first, pedestal) : no_light ();
  const Image<float> *weights = pedestal > 0 ? &dark : nullptr;
  const Nanoseconds period = examination.rig.parts ().rate.period ();
  const double delay = value_or (examination.profile.trigger_delay, 0.0);
  const double lit_until = double (period) * (fine.first + pedestal) / fine.of;
  const double enough = pedestal > 0 ? lit_until - delay + kAfterPedestal : 0.0;
  const auto shorter =
      std::max (period / kShorter, Nanoseconds (std::llround (enough)));
  const double longest =
      value_or (examination.profile.exposure, double (period));
  /* Of flicker that is in step with the frames, each look sees another phase.
   */
  const double unsteady = pedestal_light * steady_flicker (examination, frames);
  const int rounds = unsteady > kUnsteady ? kRounds : 1;
  OffLight found;
  std::vector<double> more; // light of the longer exposure, DN
  double errors = 0.0;      // squares
  for (int round = 0; round < rounds; round++) {
    ASSIGN_OR_RETURN (const Stack first,
        look_at_light (examination, mask, fine.of, frames, weights));
    ASSIGN_OR_RETURN (
        const Stack second, with_exposure (examination, shorter, [&] {
          return look_at_light (examination, mask, fine.of, frames, weights);
        }));
    found.longest = means_of (first, good);
    found.shorter = means_of (second, good);
    const Offsets offsets = offsets_of (parts, pedestal_light);
    const Measured a = exact_mean (found.longest, offsets);
    const Measured b = exact_mean (found.shorter, offsets);
    more.push_back (a.value - b.value);
    errors = a.sigma * a.sigma + b.sigma * b.sigma;
  }
  found.part = double (shorter) / longest;
  const double scale = 1.0 / (1.0 - found.part);
  double mean = 0.0;
  for (const double each : more)
    mean += each / rounds;
  found.light = {scale * mean,
      scale * std::sqrt (errors + unsteady * unsteady / double (rounds))};
  return found;
}

} // namespace codedexposure
