/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Any bytes as the short texts of properties and command lines: what is
 * accepted is written so that it parses back. */
#include "base/packed_mono.h"
#include "calibrate/gratings.h"
#include "dmd/options.h"
#include "dmd/simulated_dmd.h"
#include "emulation/fault_plan.h"
#include "fuzz_check.h"
#include "schedule/mirror_array.h"
#include "stats/profile_line.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

template <typename Value, typename Write, typename Read>
void
check_text (const Value &value, Write write, Read read)
{
  if (!value)
    return;
  const std::string text = write (*value);
  const auto again = read (text);
  require (bool (again) && *again == *value, "text does not read back", text);
}

void
check_plain (std::string_view text)
{
  check_text (
      parse_real (text), real_text, [] (auto t) { return parse_real (t); });
  check_text (
      parse_size (text), size_text, [] (auto t) { return parse_size (t); });
  check_text (
      parse_rect (text), rect_text, [] (auto t) { return parse_rect (t); });
  check_text (parse_mono_format (text), mono_format_text,
      [] (auto t) { return parse_mono_format (t); });
  (void)parse_int (text);
}

void
check_named (std::string_view text)
{
  const auto time = parse_time (text);
  check (time);
  check_text (time, time_text, parse_time);
  const auto layout = parse_layout (text);
  check (layout);
  check_text (layout, layout_text, parse_layout);
  const auto region = parse_region (text);
  check (region);
  check_text (region, rect_text, parse_region);
  const auto pattern = Pattern::parse (text);
  check (pattern);
  check_text (
      pattern, [] (const Pattern &p) { return p.text (); }, Pattern::parse);
}

void
check_line (std::string_view text)
{
  const auto line = ProfileLine::parse (text);
  check (line);
  if (!line)
    return;
  const Extent size{640, 480};
  const auto points = line->points (size);
  check (points);
  if (points)
    for (const Position &p : *points)
      require (p.x >= 0 && p.y >= 0 && p.x <= size.width - 1 &&
                   p.y <= size.height - 1,
          "a point outside of the picture", text);
}

} // namespace

extern "C" int
LLVMFuzzerTestOneInput (const std::uint8_t *data, std::size_t size)
{
  const std::string_view text = text_of (data, size);
  check_plain (text);
  check_named (text);
  check_line (text);
  check (DmdOptions::parse (text));
  check (open_simulated_dmd (text));
  FaultPlan faults;
  check (faults.add (text, 7));
  return 0;
}
