/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Exposures between coded frames. */
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fuse/engine.h"

namespace codedexposure::fuse
{

/**
 * The slots in the middle of an exposure are truest: others lie around them in
 * time on both sides. Where each pixel is of one slot, the second half of a
 * coded frame's slots and the first half of the next one's are an exposure,
 * too, in whose middle the ends of both meet. It is fused like a coded frame,
 * and of the two estimates of a slot, the one counts more that lies nearer to
 * the middle of its exposure.
 */
class Overlap
{
public:
  /** Why @p schedule and @p options have no such exposures; empty if they have.
   */
  static std::string why_not (
      const Schedule &schedule, const FuseOptions &options);
  /** Coded frames before a frame on which its pixels then depend, beside those
   * of an Engine. */
  static constexpr int kHistory = 1;

  /** As Engine::make (). */
  static Result<std::unique_ptr<Overlap>> make (const Schedule &schedule,
      int width, int height, const FuseOptions &options, double steps,
      std::stop_token stop);

  /** Fuses the exposures before and after the middle of a coded frame, which
   * is to be fused next. False, or Stopped, when it was stopped. */
  bool run (const CodedFrames &frames, bool deviations, Workers &workers,
      std::stop_token stop);
  /** Instead of run (), for a coded frame that is not fused. */
  void pass (const CodedFrames &frames, Workers &workers);
  void forget ();

  /** Both estimates of row @p y of a slot, once for each.
   * @p own        that of the coded frame.
   * @p is_static  what is not mixed, 0 to 1. */
  const float *mix (int slot, int y, const float *own, const float *is_static)
  {
    return mix (&Fused::light, slot, y, own, is_static);
  }
  /** The same of their deviations. */
  const float *mix_deviations (
      int slot, int y, const float *own, const float *is_static)
  {
    return mix (&Fused::deviations, slot, y, own, is_static);
  }

private:
  Overlap (const Schedule &schedule, std::unique_ptr<Engine> engine);

  /** An exposure between two coded frames. */
  struct Fused {
    bool known = false;
    std::vector<Field> light, deviations; ///< of its slots
  };
  void take (const CodedFrames &frames);
  bool fuse (
      Fused &to, bool deviations, Workers &workers, std::stop_token stop);
  const float *mix (std::vector<Field> Fused::*which, int slot, int y,
      const float *own, const float *is_static);

  int slots_;
  int first_; ///< slot of a coded frame in which such an exposure begins
  FieldOf<std::uint8_t> late_; ///< pixels whose slot is not before that one
  std::unique_ptr<Engine> engine_;
  Fused before_, after_; ///< the middle of the last coded frame
};

} // namespace codedexposure::fuse
