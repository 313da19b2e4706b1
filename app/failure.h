/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How a command ends. */
#pragma once

#include <string>
#include <type_traits>
#include <utility>

#include "base/result.h"

namespace codedexposure::app
{

/** Exit status of every command, as its --help says. */
enum class Exit {
  done = 0,
  failed = 1,
  usage = 2,         ///< the command line is wrong
  damaged = 3,       ///< done, but frames are missing or not as recorded
  not_known = 4,     ///< done, but it is not known whether all is good
  nobody = 4,        ///< nobody listens or receives, or the excerpt is empty
  no_device = 3,     ///< there is no such device, or it cannot be opened
  does_not_fit = 4,  ///< the schedule does not fit the device or the rate
  interrupted = 130, ///< by a signal, before it was done
};

/** Thrown by commands before or after they run a pipeline; main () prints the
 * message. No exception leaves a callback of GStreamer. */
struct Failure {
  Exit exit;
  Error error;
};

[[noreturn]] inline void
fail (std::string message, Exit exit = Exit::failed)
{
  throw Failure{exit, Error{std::move (message)}};
}

/** For a command line that is wrong: the value, the rule and the remedy. */
[[noreturn]] inline void
usage_error (std::string message)
{
  fail (std::move (message), Exit::usage);
}

/** The value of @p result; throws a Failure if it has none. */
template <typename T>
T
value_of (Result<T> result, Exit exit = Exit::failed)
{
  if (!result)
    throw Failure{exit, result.error ()};
  if constexpr (!std::is_void_v<T>)
    return *std::move (result);
}

} // namespace codedexposure::app
