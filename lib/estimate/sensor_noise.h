/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The noise of a pixel by its electrons. */
#pragma once

namespace codedexposure
{

/** Noise of a camera; the default is a camera without noise. */
struct SensorNoise {
  static constexpr double kMaxFullWell = 1e9;
  static constexpr double kMaxReadNoise = 1e5;

  /** Full well of a pixel, electrons; 0: no noise. */
  double full_well = 0.0;
  double read_noise = 0.0; ///< electrons rms

  /** Variance of a pixel of @p electrons, electrons squared: shot noise, read
   * noise, and rounding to steps of @p step electrons. */
  double variance (double electrons, double step) const
  {
    return electrons + read_noise * read_noise + step * step / 12.0;
  }

  bool operator== (const SensorNoise &) const = default;
};

} // namespace codedexposure
