/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The DLPC900 driver on an emulated board. */
#pragma once

#include <memory>

#include "emulation/dlpc900.h"
#include "dmd/drivers.h"
#include "dmd_rig.h"
#include "mirrors.h"

namespace codedexposure::test
{

using namespace emulated;

/* Types of boards, as they report them. */
constexpr int kDlp6500 = 1, kDlp9000 = 2, kDlp5500 = 5;

/** The driver and an emulated board. */
struct Rig : DmdRig<EmulatedDlpc900, open_dlpc900> {
  explicit Rig (int type = kDlp5500)
      : DmdRig (std::make_shared<EmulatedDlpc900> (type))
  {
  }
};

/** Checks that the board shows the masks of @p schedule. */
inline void
expect_masks (const EmulatedDlpc900 &board, const Schedule &schedule,
    const Placement &placement = {})
{
  ASSERT_EQ (int (board.shown ().size ()), schedule.masks ());
  for (int mask = 0; mask < schedule.masks (); mask++) {
    const auto shown = board.mirrors (mask);
    Image<std::uint8_t> expected (shown.width (), shown.height ());
    expected_mask (schedule, mask, expected.view (), placement);
    ASSERT_TRUE (shown == expected) << "mask " << mask;
  }
}

} // namespace codedexposure::test
