/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "base/range.h"

#include "base/text.h"

namespace codedexposure
{

Result<void>
check_ranges (std::initializer_list<Range> ranges)
{
  for (const auto &[what, value, low, high] : ranges)
    if (!(value >= low && value <= high))
      return Error{std::string (what) + " = " + real_text (value) +
                   " is outside " + real_text (low) + ".." + real_text (high)};
  return {};
}

} // namespace codedexposure
