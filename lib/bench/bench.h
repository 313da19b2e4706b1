/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The optical bench in software: light, mirrors, lens, sensor. */
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "bench/diamond_view.h"
#include "bench/lens.h"
#include "mapping/mapping.h"
#include "schedule/mask_renderer.h"
#include "setup/bench_profile.h"

namespace codedexposure
{

/** Camera and lens; the default is an ideal, aligned, noise-free bench. */
struct BenchOptions {
  static constexpr double kMaxPsfSigma = 16.0;
  static constexpr double kMaxFullWell = 1e9;
  static constexpr double kMaxReadNoise = 1e5;
  static constexpr double kMaxGain = 1000.0;
  static constexpr double kMaxShift = 10000.0;
  static constexpr double kMinScale = 0.5;
  static constexpr double kMaxScale = 4.0;
  static constexpr double kMaxTilt = 0.3;
  static constexpr double kMaxDistortion = 0.1;

  /** Blur between mirrors and pixels, standard deviation in pixels. */
  double psf_sigma = 0.0;
  /** Full-well capacity, and the electrons of white with the mirror on in every
   * slot; 0: noise-free. The light does not depend on the code: a pixel that is
   * on in one slot of N gets 1/N of it. */
  double full_well = 0.0;
  double read_noise = 0.0; ///< electrons rms; needs a full well
  /** Most electrons that a pixel holds; 0: the full well, which a pixel that is
   * not on in every slot never reaches. */
  double well = 0.0;
  double black_level = 0.0; ///< DN without light
  int bits = 0; ///< significant bits; 0, or too many: all of the pixel's
  /** At 1, white with the mirror on in every slot makes white; 0: the value of
   * OpticalBench::gain (). */
  double gain = 0.0;
  std::uint64_t seed = 0;
  Alignment alignment = {};
  /** Layout of the tile on a diamond array, whose pixels are those of the tile
   * (diamond_view.h); none: an orthogonal array. The lens sees the mean of two
   * pixels between them. */
  std::optional<MirrorLayout> diamond = {};
  /** Of the camera to the mirrors, in place of the alignment. The scene lies on
   * the mirrors in the middle of the array, of which it needs as many as it has
   * pixels. */
  std::optional<Mapping> mapping = {};

  /** A number that was not set: that of a profile. */
  static constexpr double kUnset = -1.0;
  /** These options with what @p profile, if there is one, says of numbers that
   * are kUnset, of @p bits and gain where they are 0, and of an alignment that
   * is the usual one. The light is such that white fills the range of the
   * camera in pixels that are on longest. @p schedule: of the exposures, with
   * its leak. */
  BenchOptions completed (
      const BenchProfile *profile, const Schedule &schedule) const;

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
 * Without blur, misalignment and noise, a pixel that was on for one slot is, at
 * gain 0 and no off-state leakage, exactly the scene's value in that slot.
 *
 * Pixels have 8 or 16 bits (host order), the same in all of an exposure.
 */
class OpticalBench
{
public:
  static constexpr int kAllMirrors = -100;

  /** Fails if an option is out of its range. */
  static Result<OpticalBench> make (
      int width, int height, const BenchOptions &options);

  /** Empties the sensor for an exposure with the masks of @p schedule, and
   * with @p still where expose () gets kStillMask. */
  void begin (const Schedule &schedule,
      std::shared_ptr<const StillMask> still = nullptr);
  /**
   * Adds the light of @p scene through a mask; mirrors that are on pass all of
   * it, those that are off schedule.leak ().
   * @p scene  of the bench's size.
   * @p mask   index as in MaskRenderer::render (), kStillMask, or kAllMirrors,
   *           for which all are on; another negative one is the parked DMD:
   *           every mirror off.
   * @p slots  how long, in active times of a slot.
   */
  template <typename Pixel>
  void expose (ImageView<Pixel> scene, int mask, double slots);
  /**
   * Reads what was collected since begin ().
   * @p frame  number of the frame; it and the seed fix the noise.
   * @p coded  of the bench's size, fully overwritten.
   */
  template <typename Pixel>
  void read_out (std::uint64_t frame, ImageView<Pixel> coded);

  /** The gain in force. If the options leave it at 0, the element that is on
   * longest makes white at white: N / schedule.white_slots (). */
  double gain () const;

private:
  OpticalBench (int width, int height, const BenchOptions &options);
  const MirrorRows<std::uint8_t> &mirrors_of (int mask);

  BenchOptions options_;
  Lens lens_;
  Image<float> light_; // on the mirrors, scene values times slots
  Image<float> seen_;  // by the pixels
  std::optional<MaskRenderer> masks_;
  int shown_ = 0;                    // of the schedule's masks
  MirrorRows<std::uint8_t> mirrors_; // of that mask
  std::shared_ptr<const StillMask> held_;
  MirrorRows<std::uint8_t> still_; // of the mask that is held
  std::optional<DiamondView> diamond_;
  std::vector<float> shares_; // of a row
  double white_ = 0.0;        // of the scene
  bool empty_ = true;         // light is yet to be overwritten
  Offset first_;              // mirror of the scene's first pixel
};

} // namespace codedexposure
