/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Numbers of frames from their times: lost, late and duplicate frames. */
#pragma once

#include <cstdint>
#include <optional>
#include <set>

#include "schedule/timing.h"

namespace codedexposure
{

/** How a frame follows the one before. */
enum class Arrival {
  first,      ///< nothing came before it
  next,       ///< one frame period later
  after_loss, ///< more than 1.5 frame periods later
  duplicate,  ///< at the time of the frame before
  late,       ///< takes the number of one that was counted as lost
  behind,     ///< at an earlier time, at which none is missing
  restarted,  ///< the camera's clock restarted
};

struct FrameStep {
  Arrival arrival = Arrival::first;
  /** Number of the frame, including lost ones. A late frame has the number that
   * was counted as lost; a duplicate and one that is behind, that of the frame
   * which was taken for this time. */
  std::uint64_t number = 0;
  /** Frames missing right before this one. */
  std::uint64_t lost = 0;
};

/**
 * Numbers frames by their times.
 *
 * The period comes from the frame rate, never from two frames. A step of less
 * than a quarter of a period is a duplicate, one of more than 1.5 periods a
 * loss; steps between are jitter. A loss is revoked if the frame after it is so
 * close that the one before it was only late: what was counted as lost is late
 * then, and the numbers are right again. A step backward is one frame that is
 * late or behind, or a restart of the camera if the next one steps backward as
 * well or the step is longer than a second.
 */
class FrameSequence
{
public:
  /** @p first  number of the first frame. */
  explicit FrameSequence (FrameRate rate, std::uint64_t first = 0);

  /** Number of the frame that comes next, if none is lost. */
  std::uint64_t next_number () const { return next_number_; }
  /** After resync (), unless a frame has come: that frame has @p number. */
  void go_to (std::uint64_t number)
  {
    if (!last_)
      next_number_ = number;
  }

  /** @p time of the frame, any epoch; times fall when @p reverse. */
  FrameStep take (Nanoseconds time, bool reverse = false);
  /** A frame of a camera that was disconnected, at a time of another epoch:
   * @p away after the frame before. A duplicate if that is less than three
   * quarters of a period, in which there is no other exposure. */
  FrameStep take_after (Nanoseconds time, Nanoseconds away);
  /** A frame from which on times count anew; it has the next number. */
  FrameStep restart (Nanoseconds time);
  /** The next frame may follow at any time: after a flush, or a new segment.
   * Numbers continue. */
  void resync ();

private:
  std::uint64_t periods (Nanoseconds span) const;
  FrameStep begin (Nanoseconds time, Arrival arrival);
  FrameStep step_back (Nanoseconds time, Nanoseconds by);
  bool disproves_loss (Nanoseconds step) const;
  void note_lost (std::uint64_t lost);

  Nanoseconds period_;
  std::optional<Nanoseconds> last_; // of the frame with the largest number
  std::uint64_t next_number_ = 0;
  Nanoseconds loss_step_ = 0; // to the last frame, if frames are lost before it
  bool stepped_back_ = false; // the last frame did
  std::set<std::uint64_t> lost_; // numbers that may come late
};

} // namespace codedexposure
