/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Bytes as the text in which documents print them. */
#pragma once

#include <cstdint>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace codedexposure::test
{

/** "40 13 03" as bytes. */
inline std::vector<std::uint8_t>
from_hex (const std::string &text)
{
  std::istringstream in (text);
  std::vector<std::uint8_t> bytes;
  for (unsigned byte; in >> std::hex >> byte;)
    bytes.push_back (std::uint8_t (byte));
  return bytes;
}

inline std::string
to_hex (std::span<const std::uint8_t> bytes)
{
  static constexpr char kDigits[] = "0123456789ABCDEF";
  std::string text;
  for (const std::uint8_t byte : bytes) {
    if (!text.empty ())
      text += ' ';
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

/** The document's text of whole packets: without the zeros at the end. */
inline std::string
packet_hex (std::vector<std::uint8_t> bytes, std::size_t shown)
{
  EXPECT_EQ (bytes.size () % 64, 0u);
  for (std::size_t i = shown; i < bytes.size (); i++)
    EXPECT_EQ (bytes[i], 0) << "byte " << i;
  bytes.resize (shown);
  return to_hex (bytes);
}

} // namespace codedexposure::test
