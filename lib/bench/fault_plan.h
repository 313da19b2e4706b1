/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What goes wrong on the way from a camera, and in which frame. */
#pragma once

#include <cstdint>
#include <map>
#include <string_view>

#include "base/result.h"
#include "schedule/timing.h"

namespace codedexposure
{

/** What happens to one frame of a camera. */
struct Fault {
  enum class Kind {
    none,
    lose,       ///< none of its packets is sent
    incomplete, ///< half of its packets is sent
    delay,      ///< it is sent late by `delay`, and so may be those after it
    duplicate,  ///< it comes once more, in place of the next one
    late,       ///< it comes after the next one, in place of the one after that
    stop,       ///< it is the first of which nothing comes any more
  };

  Kind kind = Kind::none;
  Nanoseconds delay = 0;
};

/**
 * Faults by the number of the frame that they befall, from a text of words
 * KIND@FRAME[:MORE]:
 *
 *   lose@10 lose@10:3 incomplete@10 incomplete@10:3   (MORE: how many frames)
 *   delay@10:5ms  duplicate@10  late@10  stop@10
 *
 * FRAME may be "now".
 */
class FaultPlan
{
public:
  /** Adds those of @p text; none of them when there is an error. @p now: the
   * number of the next frame. */
  Result<void> add (std::string_view text, std::uint64_t now = 0);
  Fault at (std::uint64_t frame) const;

private:
  std::map<std::uint64_t, Fault> faults_;
};

} // namespace codedexposure
