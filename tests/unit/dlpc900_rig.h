/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The DLPC900 driver on an emulated board. */
#pragma once

#include "dmd/dlpc900.h"
#include "dmd_rig.h"
#include "emulated_dlpc900.h"

namespace cexp::test
{

/* Types of boards, as they say themselves. */
constexpr int kDlp6500 = 1, kDlp9000 = 2, kDlp5500 = 5;

/** The driver and an emulated board. */
struct Rig : DmdRig<EmulatedDlpc900, open_dlpc900> {
  explicit Rig (int type = kDlp5500)
      : DmdRig (std::make_shared<EmulatedDlpc900> (type))
  {
  }
};

/** What the board shows is the masks of @p schedule. */
inline void
expect_masks (const EmulatedDlpc900 &board, const Schedule &schedule,
    const Placement &placement = {})
{
  ASSERT_EQ (int (board.shown ().size ()), schedule.masks ());
  for (int mask = 0; mask < schedule.masks (); mask++) {
    const auto shown = board.mirrors (mask);
    Image<std::uint8_t> expected (shown.width (), shown.height ());
    render_mirrors (schedule, mask, placement, expected.view ());
    ASSERT_TRUE (shown == expected) << "mask " << mask;
  }
}

} // namespace cexp::test
