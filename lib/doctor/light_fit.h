/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Light of frames in which the mirrors are on for a part of the cycle: what it
 * says of the exposure and of the lamp. */
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
  std::vector<double> lengths = {}; ///< of the exposures, s
  std::vector<double> offsets = {}; ///< DN without light in them
  std::vector<LightLine> lines = {};

  /** DN of a frame; its time counts from the epoch of the lines and of the
   * drift. */
  double light (const LightSample &sample) const;
};

/** What to find. */
struct LightQuestion {
  /** Find start and lengths, too; else they are known. */
  bool window = true;
  int lines = 3;                          ///< at most
  double slowest = 0.5, fastest = 1200.0; ///< lines, Hz
  /** Weaker lines are those of noise, as a part of the light. */
  double faintest = 5e-4;
};

/** A model and how well it is known. */
struct LightFit {
  LightModel model = {};
  double epoch = 0.0; ///< of the model, in times of the samples
  Measured drift = {}, start = {};
  std::vector<Measured> lengths = {};
  struct Line {
    Measured frequency, depth;
  };
  std::vector<Line> lines = {}; ///< the strongest first
  double faintest = 0.0;        ///< depth of a line that would not be seen
  /** Of the trigger to the exposure, from frame to frame: standard deviation,
   * s. */
  Measured jitter = {};
  double residual = 0.0; ///< standard deviation, s of light
  int rejected = 0;      ///< samples that no model explains
  /** Which part of the changes of the light a frequency explains, before any
   * line was taken away: the largest in each of some stretches. */
  std::vector<Position> spectrum = {};
};

/**
 * Fits by least squares over all samples: for runs that the exposure cuts,
 * light is lost; lines show in runs at different times of the cycle, because
 * the frames alone see each frequency as one below half of their rate.
 *
 * @p guess  period; start and lengths to a tenth of a period. gain, drift,
 *           offsets and lines are not read.
 */
LightFit fit_light (std::span<const LightSample> samples,
    const LightModel &guess, const LightQuestion &question = {});

} // namespace codedexposure
