/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Results that cannot be errors with the schedules and numbers of these
 * programs. */
#pragma once

#include <cstdlib>
#include <iostream>
#include <utility>

#include "base/result.h"

namespace codedexposure::quality
{

/** The value of @p result; on an error, prints it and ends the program. */
template <typename T>
T
must (Result<T> result)
{
  if (!result) {
    std::cerr << result.error ().message << '\n';
    std::abort ();
  }
  return std::move (*result);
}

inline void
must (Result<void> result)
{
  if (result)
    return;
  std::cerr << result.error ().message << '\n';
  std::abort ();
}

} // namespace codedexposure::quality
