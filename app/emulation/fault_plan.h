/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Faults of frames between a camera and its client. */
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
    incomplete, ///< half of its packets are sent
    delay,      ///< it is sent late by `delay`, which may delay the next ones
    duplicate,  ///< it is sent again in place of the next one
    late,       ///< it is sent after the next one, in place of the one after
    stop,       ///< no packets are sent from this frame on
  };

  Kind kind = Kind::none;
  Nanoseconds delay = 0;
};

/** As in a FaultPlan, "lose"; "sent": none. */
const char *fault_text (Fault::Kind kind);

/**
 * Faults by the number of their frame, from a text of words KIND@FRAME[:MORE]:
 *
 *   lose@10 lose@10:3 incomplete@10 incomplete@10:3   (MORE: how many frames)
 *   delay@10:5ms  duplicate@10  late@10  stop@10
 *
 * FRAME may be "now".
 */
class FaultPlan
{
public:
  /** Adds those of @p text, or none of them on an error. @p now: the number of
   * the next frame. */
  Result<void> add (std::string_view text, std::uint64_t now = 0);
  Fault at (std::uint64_t frame) const;

private:
  std::map<std::uint64_t, Fault> faults_;
};

} // namespace codedexposure
