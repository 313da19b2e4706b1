/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Little-endian fields in messages of devices. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
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

} // namespace codedexposure
