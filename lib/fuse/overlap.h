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
 * time on both sides. Where each pixel is of one slot, the last slots of a
 * coded frame and the first ones of the next are an exposure, too, which is
 * fused like a coded frame. A slot is in several such exposures, and the
 * estimates count the more the nearer it lies to the middle of theirs.
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

  /** Fuses the exposures around a coded frame, which is to be fused next. */
  void run (const CodedFrames &frames, bool deviations, const Task &task);
  /** Instead of run (), for a coded frame that is not fused. */
  void pass (const CodedFrames &frames, Workers &workers);
  void forget ();

  /** All estimates of row @p y of a slot, once for each.
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
  /** An exposure between two coded frames. */
  struct Fused {
    bool known = false;
    std::vector<Field> light, deviations; ///< of its slots
  };
  /** Exposures that begin in the same slot of every coded frame. */
  struct Between {
    int first;                  ///< this slot
    FieldOf<std::uint8_t> late; ///< pixels whose slot is not before it
    std::unique_ptr<Engine> engine;
    Fused before, after; ///< of which the last coded frame has slots

    Between (
        const Schedule &schedule, int first_slot, std::unique_ptr<Engine> its);
    void take (const CodedFrames &frames);
    void fuse (Fused &to, bool deviations, const Task &task);
    void run (const CodedFrames &frames, bool deviations, const Task &task);
  };

  explicit Overlap (int slots) : slots_ (slots) {}
  const float *mix (std::vector<Field> Fused::*which, int slot, int y,
      const float *own, const float *is_static);

  int slots_;
  std::vector<Between> between_;
};

} // namespace codedexposure::fuse
