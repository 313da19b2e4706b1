/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What is known of one coded frame beside its pixels. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "schedule/timing.h"

namespace codedexposure
{

/** No time of a recording is as far from 0 as 73 years, ns. Sums of few such
 * times do not overflow. */
constexpr Nanoseconds kFarthestTime = Nanoseconds (1) << 61;

/** Times are on the clock of the recording; what is unknown is absent.
 * docs/formats.md, "Per-frame track". */
struct FrameRecord {
  std::uint64_t frame = 0; ///< its number, lost frames counted
  std::optional<int> slot; ///< of a picture that was decoded from it, from 0
  std::optional<Nanoseconds> pts;
  std::optional<Nanoseconds> duration;
  std::optional<Nanoseconds> exposure_start;
  std::optional<Nanoseconds> exposure_duration;
  std::optional<Nanoseconds> time_uncertainty;
  /** Whether masks and exposure were synchronised. */
  std::optional<bool> locked;
  std::optional<int> slip; ///< slots by which the masks were late
  std::optional<std::uint64_t> lost_before; ///< frames
  std::optional<std::uint64_t> saturated;   ///< pixels
  std::string pattern; ///< that the mirrors showed; empty: the schedule
  int bits = 0;        ///< significant bits; 0: all of the format
  std::vector<std::string> flags;    ///< "discont", "corrupted", "gap" ...
  std::optional<std::uint64_t> hash; ///< pixel_hash ()

  /** The first of its times that no recording has; nothing: all are good. */
  std::optional<Nanoseconds> too_far () const;
  /** One line; unknown values are left out, but `locked` is null. */
  std::string to_json () const;

  bool operator== (const FrameRecord &) const = default;
};

} // namespace codedexposure
