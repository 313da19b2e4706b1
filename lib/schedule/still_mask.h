/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A mask that does not change, for measuring a bench. */
#pragma once

#include <functional>
#include <string>

namespace codedexposure
{

/** One mask in place of a schedule's, the same in every exposure. */
struct StillMask {
  std::string name; ///< for messages
  /** Whether pixel (x, y) of the tile is on; x, y >= 0. Called from other
   * threads, also at the same time. */
  std::function<bool (int x, int y)> on;
  /** Slots of the schedule, from slot `first` on, in which it is shown in every
   * exposure; the mirrors are off in the others. */
  int slots = 1;
  int first = 0;

  bool in_slot (int slot) const
  {
    return slot >= first && slot < first + slots;
  }
  /** What the beam of the mirrors that are off has of it, in its slots. */
  StillMask complement () const
  {
    StillMask other = *this;
    other.on = [mine = on] (int x, int y) { return !mine (x, y); };
    return other;
  }
};

/** Index of the still mask where those of a schedule are 0, 1, ... */
constexpr int kStillMask = 1 << 20;
/** Index of no mask: the DMD runs, but every mirror is off. */
constexpr int kOffMask = -2;

} // namespace codedexposure
