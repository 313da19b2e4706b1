/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The USB packets of DLPC350 and DLPC900, and the commands of both. */
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "base/result.h"
#include "dmd/bytes.h"

namespace codedexposure
{

constexpr std::size_t kHidPacketSize = 64;
/** Longest message, header included: the one buffer of the device. */
constexpr std::size_t kHidMessageSize = 512;
/** Data bytes of the longest request (after flags, sequence, length and
 * command) and of the longest reply (which has no command). */
constexpr std::size_t kHidRequestData = kHidMessageSize - 6;
constexpr std::size_t kHidReplyData = kHidMessageSize - 4;

/** Packets that @p bytes fill. */
constexpr std::size_t
hid_packets (std::size_t bytes)
{
  return (bytes + kHidPacketSize - 1) / kHidPacketSize;
}

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
  std::size_t packets () const { return hid_packets (kSize + length); }
};

/** Fails if @p packet cannot begin a reply. */
Result<HidReplyHead> parse_reply_head (ByteView packet);

/** The commands that DLPC350 and DLPC900 have in common. */
namespace dlp
{

constexpr HidCommand kVersion{0x0205, "read the firmware version"};
constexpr HidCommand kHardwareStatus{0x1A0A, "read the hardware status"};
constexpr HidCommand kMainStatus{0x1A0C, "read the main status"};
constexpr HidCommand kDisplayMode{0x1A1B, "set the display mode"};
constexpr HidCommand kTriggerOut2{0x1A1E, "set up trigger output 2"};
constexpr HidCommand kRun{0x1A24, "start or stop the patterns"};
constexpr HidCommand kTriggerIn1{0x1A35, "set up trigger input 1"};

constexpr std::uint8_t kRunStop = 0;
constexpr std::uint8_t kRunStart = 2;
/** Main status. */
constexpr std::uint8_t kParked = 1 << 0;
constexpr std::uint8_t kSequencerRuns = 1 << 1;
/** Hardware status. */
constexpr std::uint8_t kInitialised = 1 << 0;
constexpr std::uint8_t kSecondController = 1 << 4;

} // namespace dlp

} // namespace codedexposure
