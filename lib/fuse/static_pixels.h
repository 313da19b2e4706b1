/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Detection of static pixels, by comparing coded frames with each other. */
#pragma once

#include <cstdint>
#include <vector>

#include "estimate/observation.h"
#include "fuse/box_filter.h"
#include "fuse/field.h"

namespace codedexposure::fuse
{

/** Noise of every pixel of a frame: variance = slope * light + offset, in
 * units of the fields (255 for white). */
struct NoiseMap {
  Field slope, offset;
};

/**
 * A pixel sees the same slots of every frame. If neither the pixel nor the
 * pixels around it, which see all other slots, have changed by more than noise
 * explains, the scene is static there, and the coded frame is the picture,
 * whatever its texture. A scene that repeats with the frame rate shows no
 * changes either. There, neighbours of the same slot predict a pixel better
 * than the closest neighbours do, and the pixel does not count as static.
 *
 * If the noise is known, the light of static pixels is averaged over up to
 * kMemory frames, back to the last change between two neighbouring frames. The
 * results depend on the kMemory frames before a frame and on nothing older, so
 * that parts of a recording can be fused separately.
 */
class StaticPixels
{
public:
  /** Frames before a frame on which its results can depend. */
  static constexpr int kMemory = 16;

  /** @p radius   of the surroundings, which contain every slot, px.
   *  @p average  over frames.
   *  @p largest  light of a pixel, 255 for white. */
  StaticPixels (int width, int height, int radius, bool average, float largest);
  int radius () const { return radius_; }
  /** The radius for a tile with this cell. */
  static int radius_of (Extent cell);

  /** Prediction errors of row @p y of the next frame of update (), by which
   * repetition is detected: sums of squared errors around each pixel, under the
   * assumption that the scene is static and that every slot shows a different
   * picture. */
  void set_errors (int y, const float *if_static, const float *if_moving);
  /** Takes the next coded frame, and the frame after it or null. */
  void update (const Kernels &kernels, const Field &coded, const Field *after,
      const NoiseMap &noise);
  /** Forgets all frames. */
  void forget () { frames_ = 0; }

  /** Weight of light (): 0, moving, to 1, static. */
  const float *weight (int y) const { return weight_.row (y); }
  /** The picture of static pixels. */
  const float *light (int y) const
  {
    return average_ ? light_.row (y) : last_.row (y);
  }

private:
  void compare_frames (const Kernels &kernels, const Field &now,
      const Field &other, const Field *count, const NoiseMap &noise,
      Field &rating);
  void rate_row (int y, const float *sum, const float *max, Field &rating);
  void average_row (int y, const float *now);
  std::uint16_t *past_row (std::int64_t frame, int y);

  int radius_;
  bool average_;
  float steps_;             ///< of past_, per grey level
  std::int64_t frames_ = 0; ///< since the last forget ()
  Field last_;              ///< frame
  Field mean_;              ///< of the frames since the last change
  Field count_;             ///< of these frames
  Field light_;  ///< the mean, or the last frame where that differs from it
  Field change_; ///< one row
  BoxFilter sums_, maxima_;
  Field unrepeated_; ///< 1 where no repetition is detected
  Field weight_;
  Field unchanged_;       ///< from the last frame to the next: 1, none changed
  bool compared_ = false; ///< unchanged_ is of the next frame

  /* Whole numbers, so that what is added can be taken away exactly. */
  std::vector<std::uint16_t> past_; ///< the last kMemory frames
  std::vector<std::uint32_t> sum_;  ///< of count_ frames
};

} // namespace codedexposure::fuse
