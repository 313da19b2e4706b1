/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Where nothing moves: found by comparing coded frames with each other. */
#pragma once

#include "fuse/around.h"
#include "fuse/field.h"
#include "fuse/observation.h"

namespace cexp::fuse
{

/** Noise of every pixel of a frame: variance = slope * light + offset, in
 * units of the fields (255 for white). */
struct NoiseMap {
  Field slope, offset;
};

/**
 * A pixel sees the same slots of every frame. Where it and all pixels around
 * it, of every other slot, have not changed by more than noise explains, the
 * picture stands still, and the coded frame is the picture, whatever its
 * texture. What repeats itself with the frame rate looks just so; there,
 * neighbours that saw the same slot predict a pixel better than those that are
 * close, and what they predict must not be.
 *
 * The light of still pixels is averaged over frames, as far back as they stood
 * still, where the noise is known.
 */
class Stillness
{
public:
  /** @p radius  of the surroundings, which hold every slot. */
  Stillness (int width, int height, int radius, bool average);
  int radius () const { return radius_; }
  /** The radius of a tile's surroundings. */
  static int radius_of (Extent cell);

  /** What speaks for repetition in row @p y of the frame that take () gets
   * next: sums of squared errors of the predictions of the pixels around each,
   * if the picture stands still and if every slot shows another. */
  void doubt (int y, const float *still, const float *moved);
  /** Takes the next coded frame; a frame after it, or null, as well. */
  void take (const Kernels &kernels, const Field &coded, const Field *after,
      const NoiseMap &noise);
  /** Forgets all frames. */
  void forget () { begun_ = false; }

  /** How far to believe in light (): 0 to 1. */
  const float *weight (int y) const { return weight_.row (y); }
  /** The picture where it stands still. */
  const float *light (int y) const { return mean_.row (y); }

private:
  void judge (const Kernels &kernels, const Field &now, const Field &other,
      const Field *count, const NoiseMap &noise, bool raise);
  void weigh (int y, const float *sum, const float *most, bool raise);

  int radius_;
  bool average_;
  bool begun_ = false;
  Field mean_;   ///< of the frames in which a pixel stood still
  Field count_;  ///< of these frames
  Field change_; ///< a row, while judging
  Around sums_, mosts_;
  Field credible_; ///< 1 where nothing speaks for repetition
  Field weight_;
};

} // namespace cexp::fuse
