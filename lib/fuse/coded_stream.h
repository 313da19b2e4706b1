/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The coded frames that are fused next, and the one before them. */
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "estimate/observation.h"
#include "fuse/field.h"
#include "fuse/kernels.h"
#include "fuse/phases.h"

namespace codedexposure::fuse
{

/** What a camera saw; the pairs have a margin of the taps' radius. */
struct CodedLight {
  Field light;
  SplitField pairs;
  /** Squared errors of the light beyond the noise, grey levels, where they are
   * known; empty: there are none. */
  Field errors;
};

/** A coded frame and, if it has one, its partner. */
struct CodedFrame : CodedLight {
  CodedLight partner;
  bool has_partner = false;
  /** 1 for each pixel near which the partner is not known, row by row without
   * padding; empty: it is everywhere. */
  std::vector<std::uint8_t> clipped;
};

/** A coded frame, and those before and after it, null where there is none. */
struct CodedFrames {
  const CodedFrame *before, *now, *after;
  bool alone = false; ///< as if it had no partner

  bool has_partner () const { return now->has_partner && !alone; }
  /** Whether the partner does not tell of all pixels. */
  bool clipped () const { return has_partner () && !now->clipped.empty (); }
  CodedFrames of_first () const { return {before, now, after, true}; }
  Neighbours neighbours () const
  {
    return {before != nullptr, after != nullptr, has_partner ()};
  }
};

/** Pixels of one camera as light, and as pairs for the filters. */
class CodedCamera
{
public:
  /** @p observation  of the camera, behind the mirrors of @p schedule.
   *  For the others, see CodedStream. */
  CodedCamera (const Kernels &kernels, const Schedule &schedule,
      const Observation &observation, Extent size, int radius, int period,
      float steps);

  CodedLight room () const;
  /** Factors of the pixels of row @p y, beside 255 / white; null where they are
   * all 1. */
  const float *gain (int y) const
  {
    return gain_.empty () ? nullptr : gain_.row (y);
  }
  /** Makes the pairs of what is in the light. */
  void pair (CodedLight &seen);

private:
  void find_margin (const Schedule &schedule, bool exact);

  const Kernels &kernels_;
  int radius_, period_;
  float steps_;
  FieldOf<std::int32_t> pixels_; ///< of one frame, with its margin
  Field gain_;                   ///< empty if it is 1 everywhere

  /* Pixels of the margin and the pixels that they repeat. */
  struct Repeat {
    std::ptrdiff_t to, from;
  };
  std::vector<Repeat> margin_;
};

/** Coded frames in the order of their exposure. */
class CodedStream
{
public:
  /** @p size     of the frames; the schedule has no pilot.
   *  @p partner  what partners tell of the slots; null: there are none.
   *  @p radius   of the taps, px.
   *  @p period   of the parts of rows of pairs.
   *  @p steps    see FilterBank. */
  CodedStream (const Kernels &kernels, const Schedule &schedule,
      const Observation &observation, const Observation *partner, Extent size,
      int radius, int period, float steps);

  const CodedCamera &camera () const { return camera_; }
  const CodedCamera *partner_camera () const
  {
    return partner_ ? &*partner_ : nullptr;
  }
  /** The next coded frame, whose light is to be written, times the gain of its
   * camera row by row; that of the partner as well, if it has one. */
  CodedFrame &next ();
  /** Queues the frame in next (). */
  void take ();

  int pending () const { return int (queue_.size ()); }
  /** The oldest pending frame and its neighbours. */
  CodedFrames frames () const;
  /** Goes on to the next frame. */
  void advance ();
  void forget ();

private:
  CodedCamera camera_;
  std::optional<CodedCamera> partner_;
  std::deque<CodedFrame> queue_;
  CodedFrame previous_; ///< empty if there is none
  CodedFrame spare_;
};

} // namespace codedexposure::fuse
