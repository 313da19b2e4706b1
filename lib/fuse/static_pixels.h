/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Detection of static pixels, by comparing coded frames with each other. */
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "estimate/observation.h"
#include "fuse/bands.h"
#include "fuse/box_filter.h"
#include "fuse/coded_stream.h"

namespace codedexposure::fuse
{

/** Noise of every pixel of a frame: variance = slope * light + offset, in
 * units of the fields (255 for white). Rows repeat with the tile. */
struct NoiseMap {
  Field slope, offset;

  NoiseMap (
      const Schedule &schedule, const Observation &observation, Extent size);
  const float *slopes (int y) const { return slope.row (y % slope.height ()); }
  const float *offsets (int y) const
  {
    return offset.row (y % slope.height ());
  }
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

  /** @p noise    outlives this.
   *  @p radius   of the surroundings, which contain every slot, px.
   *  @p average  over frames.
   *  @p largest  light of a pixel, 255 for white. */
  StaticPixels (const Kernels &kernels, const NoiseMap &noise, Extent size,
      int radius, bool average, float largest);
  /** Of a coded frame. */
  struct Found {
    const Field &weight; ///< of light: 0, moving, to 1, static
    const Field &light;  ///< the picture of static pixels
    const Field *mean, *count;

    /** Frames of which light is the mean. */
    float frames (int x, int y) const
    {
      return mean && light.row (y)[x] == mean->row (y)[x] ? count->row (y)[x]
                                                          : 1.0f;
    }
  };
  /** Takes the next coded frame, and finds its static pixels.
   * @p unrepeated  see Predictions::Found.
   * Valid until the next one is taken. */
  Found take (
      const CodedFrames &frames, const Field &unrepeated, const Task &task);
  /**
   * With noise, static pixels of a smooth picture are truer if they are also
   * averaged over their surroundings.
   * @p light  the estimates of a static pixel. Becomes its light, moved
   *           towards them by the part of the squared differences around it
   *           that noise explains: a local Wiener filter.
   */
  void smooth (const Found &found, Field &light);

  /** Found::weight of the last frame. */
  const Field &weight () const { return weight_; }
  /** Forgets all frames. */
  void forget () { frames_ = 0; }

private:
  /** Two coded frames and what their differences are compared with. */
  struct Pair {
    const Field &now, &other;
    const Field *count; ///< frames of which other is the mean; null: one
    const Field &unrepeated;
  };
  void compare (const Pair &pair, const Band &band, Field &rating);
  void average_row (int y, const float *now);

  const Kernels &kernels_;
  const NoiseMap &noise_;
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
  Field weight_;
  Field unchanged_;       ///< from the last frame to the next: 1, none changed
  bool compared_ = false; ///< unchanged_ is of the next frame

  /* Whole numbers, so that what is added can be taken away exactly. */
  std::vector<std::uint16_t> past_; ///< the last kMemory frames
  std::vector<std::uint32_t> sum_;  ///< of count_ frames
};

} // namespace codedexposure::fuse
