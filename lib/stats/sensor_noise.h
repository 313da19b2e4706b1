/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How noisy a pixel is, by the electrons in it. */
#pragma once

namespace cexp
{

/** Noise of a camera; the zero value is a noise-free one. */
struct SensorNoise {
  static constexpr double kMaxFullWell = 1e7;
  static constexpr double kMaxReadNoise = 1e5;

  /** Electrons that a pixel holds; 0: noise-free. */
  double full_well = 0.0;
  double read_noise = 0.0; ///< electrons rms

  /** Variance, electrons squared, of a number that stands for @p electrons: of
   * photons, of reading, and of rounding to steps of @p step electrons. */
  double variance (double electrons, double step) const
  {
    return electrons + read_noise * read_noise + step * step / 12.0;
  }

  bool operator== (const SensorNoise &) const = default;
};

} // namespace cexp
