/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What cannot fail with the schedules and numbers of these programs. */
#pragma once

#include <cstdlib>
#include <iostream>
#include <utility>

#include "base/result.h"

namespace cexp::quality
{

/** The value of @p result; ends the program with the error where there is none.
 */
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

} // namespace cexp::quality
