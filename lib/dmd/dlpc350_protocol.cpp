/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/dlpc350_protocol.h"

#include <array>

namespace codedexposure::dlpc350
{

Bytes
encode_entries (const std::vector<Entry> &entries)
{
  constexpr std::uint32_t kOneBit = 1 << 8;
  constexpr std::uint32_t kWhite = 7 << 12;
  Bytes bytes;
  for (const Entry &entry : entries)
    append_le (bytes,
        std::uint32_t (entry.trigger) | std::uint32_t (entry.plane) << 2 |
            kOneBit | kWhite | std::uint32_t (entry.black_after) << 17 |
            std::uint32_t (entry.next_image) << 18,
        3);
  return bytes;
}

Bytes
encode_configuration (int entries, int per_trigger, int images)
{
  constexpr std::uint8_t kRepeat = 1;
  return {std::uint8_t (entries - 1), kRepeat, std::uint8_t (per_trigger - 1),
      std::uint8_t (images - 1)};
}

Bytes
encode_times (const PatternTime &time)
{
  return bytes_of ({{time.exposure, 4}, {time.exposure + time.dark, 4}});
}

Bytes
encode_pulse (bool low, int polarity_bit)
{
  constexpr std::uint8_t kNoDelay = 0xBB;
  return {std::uint8_t (unsigned (low) << polarity_bit), kNoDelay};
}

Verdict
parse_verdict (std::uint8_t byte, bool triggered)
{
  struct Finding {
    std::uint8_t bit;
    bool error;
    const char *text;
  };
  const std::array<Finding, 5> findings{{
      {0, true, "exposure or period is out of range"},
      {1, true, "a pattern number is out of range"},
      {2, false, "trigger output 1 never falls"},
      {3, triggered, "no black before a triggered pattern"},
      {4, false, "less than 230 us of dark time"},
  }};
  Verdict verdict{(byte & 1 << 7) != 0, true, ""};
  for (const Finding &finding : findings) {
    if ((byte >> finding.bit & 1) == 0)
      continue;
    verdict.good &= !finding.error;
    verdict.text += (verdict.text.empty () ? "" : "; ");
    verdict.text += finding.text;
  }
  return verdict;
}

} // namespace codedexposure::dlpc350
