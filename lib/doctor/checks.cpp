/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/checks.h"

#include <algorithm>

#include "base/try.h"

namespace codedexposure
{

StillMask
lit (int first, int count)
{
  return {.name = "light",
      .on = [] (int, int) { return true; },
      .slots = count,
      .first = first};
}

Result<std::vector<SeenFrame>>
look (Examination &examination, const StillMask &mask, int slots, int frames)
{
  RETURN_IF_ERROR (examination.rig.show (mask, slots));
  ASSIGN_OR_RETURN (
      auto seen, examination.rig.watch (examination.lag + frames));
  const auto old = std::min (seen.size (), std::size_t (examination.lag));
  seen.erase (seen.begin (), seen.begin () + std::ptrdiff_t (old));
  return seen;
}

} // namespace codedexposure
