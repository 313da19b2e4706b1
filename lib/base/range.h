/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Bounds of the numbers that users give. */
#pragma once

#include <initializer_list>

#include "base/result.h"

namespace codedexposure
{

/** A number and its bounds, which it may reach. */
struct Range {
  const char *what; ///< its name in the message
  double value;
  double low;
  double high;
};

/** Error for the first number that is out of bounds, or not a number. */
Result<void> check_ranges (std::initializer_list<Range> ranges);

} // namespace codedexposure
