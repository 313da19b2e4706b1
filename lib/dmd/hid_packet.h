/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The packets in which DLPC350 and DLPC900 talk over USB. */
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "base/result.h"
#include "dmd/little_endian.h"

namespace codedexposure
{

constexpr std::size_t kHidPacketSize = 64;
/** Longest message, header included: the one buffer of the device. */
constexpr std::size_t kHidMessageSize = 512;
/** Data bytes of the longest request (after flags, sequence, length and
 * command) and of the longest reply (which has no command). */
constexpr std::size_t kHidRequestData = kHidMessageSize - 6;
constexpr std::size_t kHidReplyData = kHidMessageSize - 4;

/** What a request asks of the device: the flag byte on the wire. */
enum class HidKind : std::uint8_t {
  post = 0x00,  ///< write, no answer
  write = 0x40, ///< write, acknowledged
  read = 0xC0,
};

/** A command of a controller. */
struct HidCommand {
  std::uint16_t word;
  const char *name; ///< for messages: "start the sequence"
  std::chrono::milliseconds timeout = std::chrono::seconds (2);
};

/**
 * The packets of one request, end to end: a header of 6 bytes and as much data
 * as fits in the first, raw data in the others, zeros up to a whole packet.
 * @p data  at most kHidRequestData bytes.
 */
Bytes encode_request (
    HidKind kind, std::uint8_t sequence, std::uint16_t command, ByteView data);

/** The start of a reply, which is in its first packet. */
struct HidReplyHead {
  static constexpr std::size_t kSize = 4;

  std::uint8_t sequence; ///< of the request that it answers
  bool refused;          ///< the device did not do what was asked (NACK)
  std::size_t length;    ///< data bytes, at most kHidReplyData

  /** Packets of the reply, this one included. */
  std::size_t packets () const
  {
    return (kSize + length + kHidPacketSize - 1) / kHidPacketSize;
  }
};

/** Error when @p packet is no packet that can begin a reply. */
Result<HidReplyHead> parse_reply_head (ByteView packet);

} // namespace codedexposure
