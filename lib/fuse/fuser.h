/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Coded frames in, full-resolution frames for every slot out. */
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>
#include <string_view>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "fuse/observation.h"
#include "fuse/scene_model.h"
#include "schedule/schedule.h"

namespace cexp
{

/** How much work a frame is worth. */
enum class FuseQuality {
  kFast,     ///< one linear filter a pixel, for live pictures
  kBalanced, ///< the filter of the motion that fits around each pixel
  kBest,     ///< more motions, and what is alike in space and time made alike
};

struct FuseOptions {
  FuseQuality quality = FuseQuality::kFast;
  /** Coded frames that are waited for before one is fused: 0 or 1. */
  int lookahead = 0;
  /** Significant bits of a pixel, 1..8 or 1..16; 0: all that the type has. */
  int bits = 0;
  SensorNoise noise;
  SceneModel scene;
  /** That balanced and best work on, 1..64; 0: one for each processor. The
   * pixels do not depend on it. */
  int threads = 0;
  /** One of fuse_targets (), which all give the same pixels; empty: the
   * fastest. */
  std::string_view target = {};
};

/** "fast", "balanced" or "best". */
std::string_view quality_name (FuseQuality quality);
Result<FuseQuality> parse_quality (std::string_view name);

/** The instruction sets that fusion can use on this machine, fastest first; the
 * last one is always "scalar", the readable reference. */
std::vector<std::string_view> fuse_targets ();

/**
 * Reconstructs the picture of every slot at the size of the coded frame, from
 * a stream of coded frames of one size and depth.
 *
 * Where nothing moves, the coded frame is the picture. Elsewhere each pixel of
 * each slot is the best linear estimate from the coded pixels around it, which
 * saw other slots, under a model of scenes (scene_model.h), the code and the
 * camera's noise: ordinary kriging in space and time. Light that is flat stays
 * as it is, and pixels of a one-hot code without noise stay as they are in
 * their own slot.
 *
 * Regions are fused each by itself, and so is the background around them. There
 * is a picture for every slot of the exposure; a part of fewer slots shows each
 * of its own for as many of them as it lasted.
 *
 * Any code and tile will do for `fast`, as long as no more than kMaxPhases
 * pixels of the tile have different neighbourhoods; motion needs kMaxSlots
 * slots or fewer.
 */
template <typename Pixel> // std::uint8_t or std::uint16_t (host order)
class Fuser
{
public:
  static constexpr int kMaxPhases = 1024;
  static constexpr int kMaxSlots = 16;
  static constexpr int kMaxLookahead = 1;

  /** @p width, @p height  of the coded frames, the pilot's rows included.
   * Error when an option or the schedule is out of the bounds above. */
  static Result<Fuser> make (const Schedule &schedule, int width, int height,
      const FuseOptions &options = {});

  Fuser (Fuser &&) noexcept;
  Fuser &operator= (Fuser &&) noexcept;
  ~Fuser ();

  int slots () const;
  /** Of the fused frames: the coded frame's without the pilot's rows. */
  Extent size () const;

  /** Takes the coded frame that follows the last one. */
  void take (ImageView<const Pixel> coded);
  /** Coded frames that were taken and not fused. */
  int pending () const;
  /** Fuses the oldest pending frame with those before and after it.
   * @p frames  slots () views of size (), in exposure order, fully
   *            overwritten.
   * @p stop    may be requested by another thread, where balanced and best
   *            would take too long.
   * @return    false when it was stopped: the frame is gone, the views hold
   *            nothing of use, and forget () must be next. */
  bool fuse (
      std::span<const ImageView<Pixel>> frames, std::stop_token stop = {});
  /** What comes next has nothing to do with what was: frames were lost, or
   * another place was sought. Pending frames are dropped. */
  void forget ();

private:
  struct State;
  explicit Fuser (std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

extern template class Fuser<std::uint8_t>;
extern template class Fuser<std::uint16_t>;

} // namespace cexp
