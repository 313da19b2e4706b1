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
 * units of the fields (255 for white). Rows repeat with the tile. */
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

  /** Room for threads of number 0 .. @p count - 1. */
  void make_room (int count);

  /** The next coded frame, and those before and after it or null. */
  struct Frames {
    const Field &coded;
    const Field *before, *after;
    const NoiseMap &noise;
  };
  /** Some rows, and the thread that computes them. */
  struct Rows {
    int first, end;
    int worker;
  };
  /* The frame is taken in these steps: each for all rows, the first one for a
   * row before the second one, which is for all rows before the third one. */
  /** Prediction errors of row @p row of blocks of 2x2 pixels, by which
   * repetition is detected: sums of squared errors over @p area pixels around
   * each block, if the scene is static and if every slot shows a different
   * picture. */
  void set_errors (const Kernels &kernels, int row, int area,
      const float *if_static, const float *if_moving);
  void compare (const Kernels &kernels, const Frames &frames, Rows rows);
  /** After it, weight () and light () of these rows are those of the frame. */
  void average (const Kernels &kernels, const Frames &frames, Rows rows);
  /** After these steps. */
  void finish (const Frames &frames);

  /**
   * With noise, static pixels of a smooth picture are truer if they are also
   * averaged over their surroundings.
   * @p light  the estimates of a static pixel. Becomes its light (), moved
   *           towards them by the part of the squared differences around it
   *           that noise explains: a local Wiener filter.
   */
  void smooth (const Kernels &kernels, const Frames &frames, Field &light);

  /** Forgets all frames. */
  void forget () { frames_ = 0; }

  /** Weight of light (): 0, moving, to 1, static. */
  const float *weight (int y) const { return weight_.row (y); }
  /** The picture of static pixels of @p coded. */
  const float *light (const Field &coded, int y) const
  {
    return average_ ? light_.row (y) : coded.row (y);
  }
  /** Frames of which light () is the mean. */
  float frames (int x, int y) const
  {
    return average_ && light_.row (y)[x] == mean_.row (y)[x]
               ? count_.row (y)[x]
               : 1.0f;
  }

private:
  void compare_frames (const Kernels &kernels, const Field &now,
      const Field &other, const Field *count, const NoiseMap &noise, Rows rows,
      Field &rating);
  void average_row (int y, const float *now);
  std::uint16_t *past_row (std::int64_t frame, int y);

  int radius_;
  bool average_;
  float steps_;             ///< of past_, per grey level
  std::int64_t frames_ = 0; ///< since the last forget ()
  Field mean_;              ///< of the frames since the last change
  Field count_;             ///< of these frames
  Field light_; ///< the mean, or the last frame where that differs from it
  /** Of a thread. */
  struct Room {
    Field change; ///< one row
    BoxFilter sums, maxima;
  };
  std::vector<Room> rooms_; ///< one at least
  Field unrepeated_;        ///< of blocks: 1 where no repetition is detected
  Field weight_;
  Field unchanged_;       ///< from the last frame to the next: 1, none changed
  bool compared_ = false; ///< unchanged_ is of the next frame

  /* Whole numbers, so that what is added can be taken away exactly. */
  std::vector<std::uint16_t> past_; ///< the last kMemory frames
  std::vector<std::uint32_t> sum_;  ///< of count_ frames
};

} // namespace codedexposure::fuse
