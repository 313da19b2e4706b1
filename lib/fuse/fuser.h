/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Coded frames in, full-resolution frames for every slot out. */
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "estimate/sensor_noise.h"
#include "schedule/schedule.h"

namespace codedexposure
{

/** How much work a frame is worth. */
enum class FuseQuality {
  kFast,     ///< one linear filter a pixel, for live pictures
  kBalanced, ///< the filter of the motion that fits around each pixel
  kBest,     ///< balanced, then collaborative filtering
  kLearned,  ///< best, then refined
};

struct FuseOptions {
  FuseQuality quality = FuseQuality::kFast;
  /** Refine the result by a network that learned from pictures. Otherwise,
   * nothing is learned from pictures but the parameters of the scene model. */
  bool refine = false;
  /** Coded frames can have partners: frames of a second camera in the beam of
   * the mirrors that are off. Their light is measured in each pair. */
  bool partner = false;
  /** Of partners: the full well is what white makes in a pixel that is on for
   * the whole exposure, as that of coded frames; none: the same noise. */
  std::optional<SensorNoise> partner_noise = {};
  /** White of fused frames in whites of a coded frame, 1..16. Beyond 1, light
   * that saturates a coded frame is that of its partner, which a filter keeps
   * from being saturated. Such frames are not refined. */
  int range = 1;
  /** Of a partner without light, DN, 0..65535; coded frames have none. */
  double partner_black = 0.0;
  /** Later coded frames that are used to fuse one: 0 or 1. */
  int lookahead = 0;
  /** Exposures that are fused for each coded frame, 1..8; no more than there
   * are slots count. Beyond 1, those that
   * begin in it and end in the next one are fused as well, so that the first
   * and the last slots are as true as those in the middle. It takes as many
   * times as long, and needs lookahead 1, a one-hot code, and coded frames that
   * follow each other with hardly a gap. */
  int overlap = 1;
  /** Significant bits of a pixel, 1..8 or 1..16; 0: all that the type has. */
  int bits = 0;
  SensorNoise noise = {};
  /** Threads, 1..64; 0: one per processor, and for fast without refine, only
   * the caller's. The pixels do not depend on it. */
  int threads = 0;
  /** One of fuse_targets (), all of which give the same pixels; empty: the
   * fastest. */
  std::string_view target = {};
};

/** Errors of the pixels of a coded frame and its partner beyond their noise,
 * rms, DN, as of Rectifier::run (); they count in the uncertainty. */
struct CodedErrors {
  std::optional<ImageView<const float>> coded = {}, partner = {};
};

/** "fast", "balanced", "best" or "learned". */
std::string_view quality_name (FuseQuality quality);

/** Names the weights of the refinement: a hash with 16 hexadecimal digits. */
const std::string &refinement_hash ();

/** The instruction sets that fusion can use on this machine, fastest first. */
std::vector<std::string_view> fuse_targets ();

/**
 * Reconstructs the picture of every slot at the size of the coded frame, from
 * a stream of coded frames of one size and depth.
 *
 * Where nothing moves, the coded frame is the picture. Elsewhere each pixel of
 * each slot is the best linear estimate from the coded pixels around it, which
 * saw other slots, under a model of scenes (scene_model.h), the code and the
 * camera's noise: ordinary kriging in space and time. Flat light is kept, and
 * without noise a pixel of a one-hot code keeps its value in its own slot.
 *
 * Each region is fused separately, and so is the background. There is a picture
 * for every slot of the exposure; a part with fewer slots repeats each of its
 * pictures for the slots of the exposure that it covers.
 *
 * `fast` takes every code and tile with at most kMaxPhases pixels of the tile
 * that have different neighbourhoods; `balanced` and `best` take up to
 * kMaxSlots slots.
 */
template <typename Pixel> // std::uint8_t or std::uint16_t (host order)
class Fuser
{
public:
  static constexpr int kMaxPhases = 1024;
  static constexpr int kMaxSlots = 16;
  static constexpr int kMaxLookahead = 1;
  static constexpr int kMaxRange = 16;
  static constexpr int kMaxOverlap = 8;
  static constexpr int kMaxHistory = 17;
  /** 256 steps per grey level of 8 bits. */
  static constexpr int kUncertaintyWhite = 255 * 256;

  /** @p width, @p height  of the coded frames, the pilot's rows included.
   *  @p stop  another thread can request it if many slots take too long.
   * Error when an option or the schedule is out of the bounds above, and
   * ErrorCode::cancelled when it was stopped. */
  static Result<Fuser> make (const Schedule &schedule, int width, int height,
      const FuseOptions &options = {}, std::stop_token stop = {});

  Fuser (Fuser &&) noexcept = default;
  Fuser &operator= (Fuser &&) noexcept = default;

  int slots () const;
  /** Coded frames before a frame on which its pixels can depend, at most
   * kMaxHistory. Fused with as many before it, and lookahead after it, a part
   * of a stream gives the same pixels as the whole. */
  int history () const;
  /** Why exposures do not overlap although the options say so; empty if they
   * do, or should not. */
  std::string unoverlapped () const;
  /** Why frames, or a region of them, are not refined although the options say
   * so: the schedule or the noise is not among those of the training. Empty if
   * they are refined, or should not be. */
  std::string unrefined () const;
  /** Of the fused frames: the coded frame's without the pilot's rows. */
  Extent size () const;

  /** Queues the coded frame that follows the last one.
   * @p partner  none, or the coded frame of the beam of mirrors that are off,
   *             which has seen every mirror where @p coded has it (the same
   *             size), and collected light in the slots in which it was off.
   * @p errors   of the size of @p coded.
   * Error when a view does not have the size of make (), or there is a partner
   * without FuseOptions::partner; the stream is unchanged then. After
   * ErrorCode::out_of_memory it is as after forget (). */
  Result<void> take (ImageView<const Pixel> coded,
      const std::optional<ImageView<const Pixel>> &partner = {},
      const CodedErrors &errors = {});
  /** Queued coded frames. */
  int pending () const;
  /** Fuses the oldest pending frame with those before and after it.
   * @p frames  slots () views of size (), in exposure order, fully
   *            overwritten; none overlaps another.
   * @p stop    another thread can request it if a frame takes too long.
   * @p uncertainty  none, or as many views like them: half the width of the
   *            interval that holds 68 % of the errors of each pixel, of which
   *            the value kUncertaintyWhite is as much as white of a fused
   *            frame.
   * Error when no frame is pending or a view is wrong; the frame stays pending
   * then. ErrorCode::cancelled when it was stopped: then, and after
   * ErrorCode::out_of_memory, the contents of the views are undefined, and the
   * stream is as after forget (). */
  Result<void> fuse (std::span<const ImageView<Pixel>> frames,
      std::stop_token stop = {},
      std::span<const ImageView<std::uint16_t>> uncertainty = {});
  /** Keeps the oldest pending frame as one before the next, without fusing it.
   * Error when no frame is pending. */
  Result<void> pass ();
  /** Starts anew after lost frames or a seek: the next frame does not continue
   * the previous ones. Pending frames are dropped. */
  void forget ();

private:
  struct State;
  explicit Fuser (std::shared_ptr<State> state) : state_ (std::move (state)) {}
  std::shared_ptr<State> state_;
};

extern template class Fuser<std::uint8_t>;
extern template class Fuser<std::uint16_t>;

} // namespace codedexposure
