/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Any bytes as a preset and as JSON must give a valid schedule or a message. */
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "base/text.h"
#include "schedule/sample_grid.h"
#include "schedule/schedule.h"

using namespace codedexposure;

namespace
{

void
require (bool holds, const char *what, const std::string &shown)
{
  if (holds)
    return;
  std::fprintf (stderr, "%s: %s\n", what, shown.c_str ());
  std::abort ();
}

void
check_schedule (const Schedule &schedule)
{
  const std::string json = schedule.to_json ();
  const auto read = Schedule::from_json (json);
  require (read.ok () && *read == schedule && read->to_json () == json,
      "JSON does not read back", json);
  if (schedule.tile ().is_named () && schedule.code ().is_named ()) {
    const auto parsed = Schedule::from_preset (schedule.text ());
    require (parsed.ok () && *parsed == schedule, "preset does not parse back",
        schedule.text ());
  }
  const Extent cell = SampleGrid (schedule).cell ();
  require (cell.width * cell.height == schedule.elements (),
      "cell has another number of pixels", json);
}

void
check (const Result<Schedule> &schedule)
{
  if (schedule.ok ())
    return check_schedule (*schedule);
  const std::string &message = schedule.error ().message;
  require (!message.empty () && message.size () < 1000 &&
               printable (message, message.size ()) == message,
      "message cannot be shown", printable (message, 2000));
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput (const std::uint8_t *, std::size_t);

extern "C" int
LLVMFuzzerTestOneInput (const std::uint8_t *data, std::size_t size)
{
  const std::string_view text (reinterpret_cast<const char *> (data), size);
  check (Schedule::from_preset (text));
  check (Schedule::from_json (text));
  return 0;
}
