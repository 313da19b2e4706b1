/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Any bytes as lines of a track, as they are and with the check that makes them
 * valid, and frames at any times among them. */
#include <algorithm>
#include <cstring>

#include <xxhash.h>

#include "fuzz_check.h"
#include "record/track.h"
#include "record/track_reader.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

/** @p text without its last character, which should be the bracket. */
std::string
with_check (std::string_view text)
{
  const std::string part (text.substr (0, text.size () - 1));
  char check[18];
  std::snprintf (check, sizeof check, "%016llx",
      static_cast<unsigned long long> (
          XXH3_64bits (part.data (), part.size ())));
  return part + ",\"check\":\"" + check + "\"}";
}

/** Takes a time of @p text away, of any size. */
Nanoseconds
take_time (std::string_view &text)
{
  Nanoseconds time = 0;
  const std::size_t bytes = std::min (text.size (), sizeof time);
  std::memcpy (&time, text.data (), bytes);
  text.remove_prefix (bytes);
  return time;
}

void
read_lines (std::string_view text)
{
  TrackReader reader;
  while (!text.empty ()) {
    const std::size_t end = std::min (text.find ('\n'), text.size ());
    const std::string_view line = text.substr (0, end);
    text.remove_prefix (std::min (end + 1, text.size ()));
    if (line.empty ())
      continue;
    const std::string whole = with_check (line);
    check_json (TrackLine::from_json (whole));
    // A container's times are not negative.
    const Nanoseconds pts = take_time (text) & 0x7fffffffffffffff;
    const Nanoseconds duration = take_time (text) & 0xffffffffff;
    check (reader.add (whole, pts, duration));
    (void)reader.take (take_time (text) & 0x7fffffffffffffff, 0);
  }
  const auto rest = reader.take_rest (0);
  require (rest.skipped <= TrackReader::kMaxLines, "lines out of nowhere", "");
}

} // namespace

extern "C" int
LLVMFuzzerTestOneInput (const std::uint8_t *data, std::size_t size)
{
  const std::string_view text = text_of (data, size);
  check_json (TrackLine::from_json (text));
  require (unescape_markup (text).size () <= size, "text that grew", text);
  read_lines (text);
  return 0;
}
