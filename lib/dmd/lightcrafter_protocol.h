/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Packets of the first LightCrafter (DLP3000), as bytes. */
#pragma once

#include <cstdint>
#include <string>

#include "base/result.h"
#include "dmd/bytes.h"

namespace codedexposure::lightcrafter
{

constexpr std::uint16_t kVersion = 0x0100;
constexpr std::uint16_t kDisplayMode = 0x0101;
constexpr std::uint16_t kSequenceOld = 0x0400;
constexpr std::uint16_t kPattern = 0x0401;
constexpr std::uint16_t kRun = 0x0402;
constexpr std::uint16_t kCameraTrigger = 0x0404;
constexpr std::uint16_t kSequence = 0x0480;

constexpr std::uint8_t kModeSequence = 4;

enum class PacketType : std::uint8_t {
  busy = 0,
  error = 1,
  write = 2,
  write_response = 3,
  read = 4,
  read_response = 5,
};

enum class Trigger : std::uint8_t {
  timer = 1,
  rising = 2,
  falling = 3,
};

/** A sequence, which repeats; times in microseconds. */
struct Sequence {
  int patterns = 1;
  Trigger trigger = Trigger::timer;
  std::uint32_t period = 0; ///< of the timer
  std::uint32_t exposure = 0;
};

/** A message of one packet. @p payload  at most 65535 bytes. */
Bytes encode_message (PacketType type, std::uint16_t command, ByteView payload);

/** @p bytes 19: for kSequence; 18 or 17: for kSequenceOld. */
Bytes encode_sequence (const Sequence &sequence, int bytes);
/** One pulse of the trigger output per pattern. */
Bytes encode_camera_trigger (bool enable, std::uint32_t pulse_us);

constexpr std::size_t kHeadSize = 6;
/** The head of a packet from the board. */
struct PacketHead {
  PacketType type;
  std::uint16_t command;
  std::size_t payload;
};
/** @p head  kHeadSize bytes. Fails for a type that no board sends. */
Result<PacketHead> parse_head (ByteView head);
/** Whether the last byte of @p packet is the sum of the others. */
bool checksum_holds (ByteView packet);

std::string error_text (std::uint8_t code);

} // namespace codedexposure::lightcrafter
