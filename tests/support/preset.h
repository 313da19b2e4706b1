/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include <string>

#include <gtest/gtest.h>

#include "schedule/schedule.h"

namespace codedexposure::test
{

/** The schedule of a preset that is valid. */
inline Schedule
schedule_of (const std::string &preset)
{
  auto schedule = Schedule::from_preset (preset);
  EXPECT_TRUE (schedule) << preset;
  return *schedule;
}

} // namespace codedexposure::test
