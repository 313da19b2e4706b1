/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The optical bench in software: light, mirrors, lens, sensor. */
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "base/image.h"
#include "base/result.h"
#include "bench/lens.h"
#include "schedule/mirror_array.h"
#include "schedule/schedule.h"
#include "schedule/still_mask.h"

namespace codedexposure
{

/** Camera and lens; the zero value is an ideal, aligned, noise-free bench. */
struct BenchOptions {
  static constexpr double kMaxPsfSigma = 16.0;
  static constexpr double kMaxFullWell = 1e7;
  static constexpr double kMaxReadNoise = 1e5;
  static constexpr double kMaxGain = 1000.0;
  static constexpr double kMaxShift = 10000.0;
  static constexpr double kMinScale = 0.5;
  static constexpr double kMaxScale = 4.0;
  static constexpr double kMaxTilt = 0.3;
  static constexpr double kMaxDistortion = 0.1;

  /** Blur between mirrors and pixels, standard deviation in pixels. */
  double psf_sigma = 0.0;
  /** Electrons that white makes when every slot is open, and the most that a
   * pixel holds; 0: noise-free. The light does not depend on the code: a pixel
   * that is open in one slot of N gets an Nth of it. */
  double full_well = 0.0;
  double read_noise = 0.0; ///< electrons rms; needs a full well
  int bits = 0; ///< significant bits; 0, or too many: all of the pixel's
  /** At 1, white makes white when every slot is open; 0: OpticalBench::gain ()
   */
  double gain = 0.0;
  std::uint64_t seed = 0;
  Alignment alignment;
  /** The mirrors stand on their corners, the tile lies on them so, and the
   * camera's pixels are the tile's (diamond_view.h); none: an orthogonal array.
   * The lens, alignment and all, sees what lies between two pixels averaged. */
  std::optional<MirrorLayout> diamond = {};

  bool operator== (const BenchOptions &) const = default;
};

/**
 * Forward model of a coded exposure (paper, Eqs. 1-7), one frame at a time:
 * begin (), expose () for every stretch of light, read_out ().
 *
 * One mirror of the tile to one scene pixel; the camera sees the mirrors
 * through the lens (lens.h) and counts light with its sensor (sensor.h). Light
 * is linear in the scene's values, and white is the largest value of the pixel
 * type.
 *
 * With no blur, no misalignment and no noise, a pixel that was on for one
 * slot is, at gain 0 and no leak, the scene's value in that slot exactly.
 *
 * Pixels have 8 or 16 bits (host order), the same in all of an exposure.
 */
class OpticalBench
{
public:
  /** Error when an option is out of its range. */
  static Result<OpticalBench> make (
      int width, int height, const BenchOptions &options);
  OpticalBench (OpticalBench &&) noexcept;
  OpticalBench &operator= (OpticalBench &&) noexcept;
  ~OpticalBench ();

  /** Empties the sensor for an exposure with the masks of @p schedule, and
   * with @p still where expose () is told kStillMask. */
  void begin (const Schedule &schedule,
      std::shared_ptr<const StillMask> still = nullptr);
  /**
   * Adds the light of @p scene through a mask; mirrors that are on pass all of
   * it, those that are off schedule.leak ().
   * @p scene  of the bench's size.
   * @p mask   index as in MaskRenderer::render (), or kStillMask; a negative
   *           one is the parked DMD: every mirror off.
   * @p slots  how long, in active times of a slot.
   */
  void expose (ImageView<const std::uint8_t> scene, int mask, double slots);
  void expose (ImageView<const std::uint16_t> scene, int mask, double slots);
  /**
   * Reads what was collected since begin ().
   * @p frame  number of the frame; it and the seed fix the noise.
   * @p coded  of the bench's size, fully overwritten.
   */
  void read_out (std::uint64_t frame, ImageView<std::uint8_t> coded);
  void read_out (std::uint64_t frame, ImageView<std::uint16_t> coded);

  /**
   * The gain in force. Where the options leave it at 0, white makes white for
   * the element that is on longest: N / schedule.white_slots ().
   */
  double gain () const;

private:
  struct State;
  explicit OpticalBench (std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

} // namespace codedexposure
