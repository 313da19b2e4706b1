/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Passes errors on to the caller; for source files of lib/ only. */
#pragma once

#include <string>
#include <utility>

#include "base/result.h"

namespace codedexposure
{

/** @p result; if it is an error, with @p prefix before the message. */
template <typename T>
Result<T>
with_prefix (Result<T> result, const std::string &prefix)
{
  return result ? std::move (result)
                : Result<T> (result.error ().with_prefix (prefix));
}

} // namespace codedexposure

/** Returns the error of a Result from the enclosing function, if it has one. */
#define RETURN_IF_ERROR(...)                                                   \
  do {                                                                         \
    if (const auto &tried_ = (__VA_ARGS__); !tried_)                           \
      return tried_.error ();                                                  \
  } while (false)

/** Sets @p variable, which may be a declaration, to the value of a Result, or
 * returns its error from the enclosing function. */
#define ASSIGN_OR_RETURN(variable, ...)                                        \
  ASSIGN_OR_RETURN_AS_ (JOIN_NAMES_ (result_, __LINE__), variable, __VA_ARGS__)
#define JOIN_NAMES_(a, b) JOIN_NAMES_EXPANDED_ (a, b)
#define JOIN_NAMES_EXPANDED_(a, b) a##b
#define ASSIGN_OR_RETURN_AS_(result, variable, ...)                            \
  auto result = (__VA_ARGS__);                                                 \
  if (!result)                                                                 \
    return result.error ();                                                    \
  variable = *std::move (result)
