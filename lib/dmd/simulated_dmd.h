/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A DMD in this process, for the optical bench in software. */
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "dmd/dmd.h"

namespace cexp
{

/**
 * The mirrors of a simulated DMD, shared by name between the driver that
 * programs them and the bench that looks through them. Thread-safe.
 *
 * Its clock is the bench's exposure clock: the bench counts slots from its
 * first frame, and asks which mask stands in each.
 */
class SimulatedMirrors
{
public:
  /** The mirrors of that name in this process; made at the first call, gone
   * when nobody holds them. */
  static std::shared_ptr<SimulatedMirrors> find (const std::string &name);

  void program (const Schedule &schedule);
  void start ();
  void stop ();
  bool running () const;

  /** What was programmed last; none before the first upload. */
  std::optional<Schedule> schedule () const;

  /**
   * Index of the mask that stands in slot @p slot counted from the bench's
   * first exposure, none while the mirrors are parked. The first call after
   * start () falls on the start of an exposure and shows mask 0 or, for
   * schedules with a pilot, the mask of that frame's parity.
   */
  std::optional<int> mask_in_slot (std::int64_t slot);

  /** From slot @p slot on, the masks come @p by slots late (> 0) or early
   * (< 0): a missed or a spurious trigger. start () mends it. */
  void slip_at (std::int64_t slot, int by);

private:
  mutable std::mutex lock_; // covers everything below; a leaf lock
  std::optional<Schedule> schedule_;
  bool running_ = false;
  std::int64_t slip_slot_ = -1;
  int slip_by_ = 0;
  int offset_ = 0;
};

} // namespace cexp
