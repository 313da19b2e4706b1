/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Numbers that users give, and the bounds of them. */
#pragma once

#include <initializer_list>

#include "base/result.h"

namespace cexp
{

/** A number, what it is, and the least and the largest that it may be. */
struct Range {
  const char *what;
  double value;
  double low;
  double high;
};

/** Error that names the first number that is outside of its range, or none. */
Result<void> check_ranges (std::initializer_list<Range> ranges);

} // namespace cexp
