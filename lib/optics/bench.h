/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The optical bench in software: light, mirrors, lens, sensor. */
#pragma once

#include <cstdint>
#include <memory>

#include "base/image.h"
#include "base/result.h"
#include "schedule/schedule.h"

namespace cexp
{

/** Camera and lens; the zero value is an ideal, aligned, noise-free bench. */
struct BenchOptions {
  double psf_sigma = 0.0;  ///< Gaussian blur from mirror to pixel, px; 0..16
  double full_well = 0.0;  ///< electrons at white; 0: noise-free
  double read_noise = 0.0; ///< electrons rms; needs a full well
  int bits = 0;            ///< significant bits; 0: all that the type has
  double gain = 0.0;       ///< 0: white in a fully used slot budget is white
  std::uint64_t seed = 0;
  double shift_x = 0.0, shift_y = 0.0; ///< mirrors against pixels, px
  double rotation = 0.0;               ///< degrees about the centre
  double scale = 1.0;                  ///< pixels a mirror; 0.5..2
};

/**
 * Forward model of a coded exposure (paper, Eqs. 1-7), one frame at a time:
 * begin (), expose () for every stretch of light, read_out ().
 *
 * One mirror to one scene pixel; the camera sees the mirrors through the
 * misalignment and the point spread function. Light is linear in the scene's
 * values; white is the largest value of the pixel type.
 */
class OpticalBench
{
public:
  static Result<OpticalBench> make (
      int width, int height, const BenchOptions &options);
  OpticalBench (OpticalBench &&) noexcept;
  OpticalBench &operator= (OpticalBench &&) noexcept;
  ~OpticalBench ();

  /** Empties the sensor. */
  void begin ();
  /**
   * Adds the light of @p scene through mask @p mask of @p schedule (render_mask
   * ()) for @p slots slot times; open mirrors pass all of it, shut ones
   * schedule.leak ().
   * @p mask  a negative value is the parked DMD: every mirror shut.
   */
  template <typename Pixel>
  void expose (ImageView<const Pixel> scene, const Schedule &schedule, int mask,
      double slots);
  /**
   * Lens, sensor and converter: shot and read noise, gain, rounding, clamp.
   * @p frame  number of the frame; it and the seed fix the noise, whatever the
   *           thread that computes it.
   * @p slots_to_white  slot times of full light that make white at gain 0.
   */
  template <typename Pixel>
  void read_out (
      std::uint64_t frame, double slots_to_white, ImageView<Pixel> coded) const;

private:
  struct State;
  explicit OpticalBench (std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

} // namespace cexp
