/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What every fuzz target asks of a parser. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "base/result.h"
#include "base/text.h"

extern "C" int LLVMFuzzerTestOneInput (const std::uint8_t *, std::size_t);

namespace codedexposure::test
{

inline void
require (bool holds, const char *what, std::string_view shown)
{
  if (holds)
    return;
  std::fprintf (stderr, "%s: %s\n", what, printable (shown, 2000).c_str ());
  std::abort ();
}

/** The message can be shown to people. */
inline void
check (const Error &error)
{
  const std::string &message = error.message;
  require (!message.empty () && message.size () < 1000 &&
               printable (message, message.size ()) == message,
      "message cannot be shown", message);
}

template <typename T>
void
check (const Result<T> &result)
{
  if (!result)
    check (result.error ());
}

/** A value that was read is written so that it reads back the same, or there is
 * a message. */
template <typename T>
void
check_json (const Result<T> &result)
{
  check (result);
  if (!result)
    return;
  const std::string json = result->to_json ();
  const auto again = T::from_json (json);
  require (again.ok () && *again == *result && again->to_json () == json,
      "JSON does not read back", json);
}

inline std::string_view
text_of (const std::uint8_t *data, std::size_t size)
{
  return {reinterpret_cast<const char *> (data), size};
}

} // namespace codedexposure::test
