/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Any bytes as a preset and as JSON must give a valid schedule or a message. */
#include "fuzz_check.h"
#include "schedule/sample_grid.h"
#include "schedule/schedule.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

void
check_schedule (const Schedule &schedule)
{
  if (schedule.tile ().is_named () && schedule.code ().is_named ()) {
    const auto parsed = Schedule::from_preset (schedule.text ());
    require (parsed.ok () && *parsed == schedule, "preset does not parse back",
        schedule.text ());
  }
  const Extent cell = SampleGrid (schedule).cell ();
  require (cell.width * cell.height == schedule.elements (),
      "cell has another number of pixels", schedule.to_json ());
}

void
check_read (const Result<Schedule> &schedule)
{
  check_json (schedule);
  if (schedule)
    check_schedule (*schedule);
}

} // namespace

extern "C" int
LLVMFuzzerTestOneInput (const std::uint8_t *data, std::size_t size)
{
  const std::string_view text = text_of (data, size);
  check_read (Schedule::from_preset (text));
  check_read (Schedule::from_json (text));
  return 0;
}
