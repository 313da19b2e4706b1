/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Exposures between coded frames. */
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "base/text.h"
#include "base/try.h"
#include "fuse/engine.h"

namespace codedexposure::fuse
{

/* Light that leaked is that of the coded frame's other slots, not of those of
 * the exposure between. */
constexpr double kMaxLeak = 0.01;

/* Of an estimate of slot @at of an exposure. */
inline float
weight_of (int at, int slots)
{
  constexpr float kAtEnds = 0.3f;
  const float sine = std::sin (
      std::numbers::pi_v<float> * (float (at) + 0.5f) / float (slots));
  return kAtEnds + (1.0f - kAtEnds) * sine * sine;
}

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
      const Schedule &schedule, const FuseOptions &options)
  {
    const std::string text = schedule.text ();
    if (options.partner)
      return "the frames of a second camera cannot be divided into slots";
    if (!schedule.code ().one_hot ())
      return text + " has pixels that see more than one slot, which cannot be "
                    "divided";
    if (schedule.leak () > kMaxLeak)
      return text + ": mirrors that are off pass " +
             real_text (std::round (1000.0 * schedule.leak ()) / 10.0) +
             " % of the light of slots that exposures between two frames have "
             "not; it must be " +
             real_text (100.0 * kMaxLeak) + " % at most";
    return {};
  }

  /** Coded frames before a frame on which its pixels then depend, beside those
   * of an Engine. */
  static constexpr int kHistory = 1;

  /** As Engine::make (). */
  static Result<std::unique_ptr<Overlap>> make (const Schedule &schedule,
      int width, int height, const FuseOptions &options, double steps,
      std::stop_token stop)
  {
    FuseOptions between = options;
    between.overlap = 1;
    between.lookahead = 0;
    const int slots = schedule.slots ();
    const int count = std::min (options.overlap, slots);
    std::unique_ptr<Overlap> overlap (new Overlap (slots));
    for (int i = 1; i < count; i++) {
      const int first = i * slots / count;
      ASSIGN_OR_RETURN (
          auto engine, Engine::make (schedule.from_slot (first), nullptr, width,
                           height, between, steps, stop));
      overlap->between_.emplace_back (schedule, first, std::move (engine));
    }
    return overlap;
  }

  /** Fuses the exposures around a coded frame, which is to be fused next. */
  void run (const CodedFrames &frames, bool deviations, const Task &task)
  {
    for (Between &between : between_)
      between.run (frames, deviations, task);
  }

  /** Instead of run (), for a coded frame that is not fused. The exposure that
   * begins in the last frame of a history is fused with the first frame after
   * it. */
  void pass (const CodedFrames &frames, Workers &workers)
  {
    for (Between &between : between_) {
      between.before.known = between.after.known = false;
      if (between.engine->stream ().pending () > 0)
        between.engine->pass (workers);
      if (frames.after)
        between.take (frames);
    }
  }

  void forget ()
  {
    for (Between &between : between_) {
      between.before.known = between.after.known = false;
      between.engine->forget ();
    }
  }

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
        const Schedule &schedule, int first_slot, std::unique_ptr<Engine> its)
        : first (first_slot), late (its->size ().width, its->size ().height),
          engine (std::move (its))
    {
      for (int y = 0; y < late.height (); y++)
        for (int x = 0; x < late.width (); x++)
          for (int s = first; s < schedule.slots (); s++)
            late.row (y)[x] |= std::uint8_t (schedule.on (x, y, s));
    }

    /* The exposure that begins in a coded frame. */
    void take (const CodedFrames &frames)
    {
      const CodedFrame &now = *frames.now, &next = *frames.after;
      CodedFrame &frame = engine->stream ().next ();
      const auto join = [&] (const Field &a, const Field &b, Field &to) {
        for (int y = 0; y < late.height (); y++)
          for (int x = 0; x < late.width (); x++)
            to.row (y)[x] = (late.row (y)[x] ? a : b).row (y)[x];
      };
      join (now.light, next.light, frame.light);
      if (!now.errors.empty () && !next.errors.empty ()) {
        frame.errors = Field (late.width (), late.height ());
        join (now.errors, next.errors, frame.errors);
      }
      engine->stream ().take ();
    }

    void fuse (Fused &to, bool deviations, const Task &task)
    {
      const auto slots = std::size_t (engine->slots ());
      const auto [width, height] = engine->size ();
      const auto keep = [] (std::vector<Field> &fields, std::size_t slot, int y,
                            const float *row) {
        std::copy_n (row, fields[slot].width (), fields[slot].row (y));
      };
      to.light.resize (slots, Field (width, height));
      to.deviations.resize (deviations ? slots : 0, Field (width, height));
      const RowSink sink = [&] (int y, const float *const *rows) {
        for (std::size_t s = 0; s < slots; s++)
          keep (to.light, s, y, rows[s]);
      };
      const Uncertainty::Sink of_deviations = [&] (
                                                  const Uncertainty::Row &row) {
        keep (to.deviations, std::size_t (row.slot), row.y, row.deviations);
      };
      engine->fuse (
          sink, task, deviations ? of_deviations : Uncertainty::Sink ());
      to.known = true;
    }

    void run (const CodedFrames &frames, bool deviations, const Task &task)
    {
      std::swap (before, after);
      after.known = false;
      if (engine->stream ().pending () > 0)
        fuse (before, deviations, task);
      if (!frames.after)
        return;
      take (frames);
      fuse (after, deviations, task);
    }
  };

  explicit Overlap (int slots) : slots_ (slots) {}

  /* In the row of one of them, which nobody needs again. */
  const float *mix (std::vector<Field> Fused::*which, int slot, int y,
      const float *own, const float *is_static)
  {
    const float weight = weight_of (slot, slots_);
    float sum = weight;
    float *to = nullptr;
    int width = 0;
    for (Between &between : between_) {
      const bool early = slot < between.first;
      Fused &fused = early ? between.before : between.after;
      std::vector<Field> &fields = fused.*which;
      if (!fused.known || fields.empty ())
        continue;
      const int at = slot - between.first + (early ? slots_ : 0);
      Field &field = fields[std::size_t (at)];
      const float its = weight_of (at, slots_);
      const float *from = field.row (y);
      width = field.width ();
      sum += its;
      if (!to) {
        to = field.row (y);
        for (int x = 0; x < width; x++)
          to[x] = weight * own[x] + its * from[x];
      } else {
        for (int x = 0; x < width; x++)
          to[x] += its * from[x];
      }
    }
    if (!to)
      return own;
    for (int x = 0; x < width; x++)
      to[x] = own[x] + (1.0f - is_static[x]) * (to[x] / sum - own[x]);
    return to;
  }

  int slots_;
  std::vector<Between> between_;
};

} // namespace codedexposure::fuse
