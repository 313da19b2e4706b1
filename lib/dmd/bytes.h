/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Messages of devices as bytes, with little-endian fields. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

namespace codedexposure
{

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

/** Appends the low @p bytes bytes of @p value, the lowest first. */
inline void
append_le (Bytes &out, std::uint32_t value, int bytes)
{
  for (int i = 0; i < bytes; i++)
    out.push_back (std::uint8_t (value >> (8 * i)));
}

/** A number, and how many of its bytes a message has. */
struct Field {
  std::int64_t value;
  int bytes;
};

/** @p fields end to end. */
inline Bytes
bytes_of (std::initializer_list<Field> fields)
{
  Bytes out;
  for (const auto &[value, bytes] : fields)
    append_le (out, std::uint32_t (value), bytes);
  return out;
}

inline void
append (Bytes &out, ByteView bytes)
{
  out.insert (out.end (), bytes.begin (), bytes.end ());
}

/** The @p bytes bytes at @p at, which must lie inside @p in, as a number. */
inline std::uint32_t
read_le (ByteView in, std::size_t at, int bytes)
{
  std::uint32_t value = 0;
  for (int i = 0; i < bytes; i++)
    value |= std::uint32_t (in[at + std::size_t (i)]) << (8 * i);
  return value;
}

/** "NAME (error 3)", or "error 77" for a @p code without a name. */
inline std::string
error_text (std::span<const char *const> names, std::uint8_t code)
{
  const std::string number = "error " + std::to_string (code);
  return code < names.size () && *names[code] != 0
             ? std::string (names[code]) + " (" + number + ")"
             : number;
}

} // namespace codedexposure
