/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Light of frames in which the mirrors are on for a part of the cycle. */
#pragma once

#include <span>
#include <vector>

#include "base/geometry.h"
#include "setup/bench_profile.h"

namespace codedexposure
{

/** The mean of one frame. Times are in seconds. */
struct LightSample {
  double time = 0.0; ///< of the trigger of its cycle, from any epoch
  /** After the trigger of every cycle, mirrors are on in [from, until). */
  double from = 0.0, until = 0.0;
  double light = 0.0; ///< DN
  /** Standard deviation of an error that all frames with this run share, DN. */
  double doubt = 0.0;
  /** Samples with another exposure time, or of another part of the range, have
   * another number: 0, 1, ... */
  int exposure = 0;
  /** Standard deviation of the mean that the noise of its pixels makes, DN. */
  double noise = 0.0;
};

/** A periodic part of the light. */
struct LightLine {
  double frequency = 0.0;          ///< Hz
  double cosine = 0.0, sine = 0.0; ///< parts of the mean light

  double depth () const; ///< amplitude, as a part of the mean
};

/** Light and exposures as they are thought to be. */
struct LightModel {
  double period = 0.0; ///< from trigger to trigger, s
  double gain = 0.0;   ///< DN for a second of light
  double drift = 0.0;  ///< growth of the light a second, as a part of it
  double start = 0.0;  ///< of every exposure, s after its trigger
  /** Light of mirrors that are off, as a part of what they add when on. Its
   * mean is in the offsets. */
  double leak = 0.0;
  std::vector<double> lengths = {}; ///< of the exposures, s
  std::vector<double> offsets = {}; ///< DN without light in them
  std::vector<LightLine> lines = {};

  /** DN of a frame; its time counts from the epoch of the lines and of the
   * drift. */
  double light (const LightSample &sample) const;
  /** Seconds of the mean light in [@p from, @p until), after the epoch. */
  double seconds_of (double from, double until) const;
  /**
   * Sets the gain and the offsets that explain @p samples best, and returns the
   * squares that remain.
   *
   * @p weights  of the samples; 0: left out. None: all count.
   */
  double match (std::span<const LightSample> samples,
      std::span<const double> weights = {});
};

/** Times of a frame's light, for use (from, until), s after the trigger: an
 * exposure sees the runs of some cycles. */
template <typename Use>
void
each_lit_time (const LightModel &model, const LightSample &sample, Use use)
{
  const double end = model.start + model.lengths[std::size_t (sample.exposure)];
  for (int cycle = -1; cycle <= 2; cycle++) {
    const double from =
        std::max (sample.from + cycle * model.period, model.start);
    const double until = std::min (sample.until + cycle * model.period, end);
    if (until > from)
      use (from, until);
  }
}

/** The window of exposure 0, of which all @p samples are, to a hundredth of
 * @p period (s). */
LightModel guess_window (std::span<const LightSample> samples, double period);

/**
 * The length of exposure 1, s, where all else of @p model is known, but for the
 * light of mirrors that are off: it grows with the exposure, by as much as the
 * offset at most.
 */
double guess_length (std::span<const LightSample> samples, LightModel model);

} // namespace codedexposure
