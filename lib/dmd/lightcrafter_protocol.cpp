/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/lightcrafter_protocol.h"

#include <numeric>

namespace codedexposure::lightcrafter
{

namespace
{

constexpr std::uint8_t kGreen = 1;

/** By error code. */
constexpr const char *kErrors[] = {"no error", "command failed",
    "command not supported", "invalid parameter", "out of resources",
    "device failure", "busy", "not initialised", "not found", "checksum",
    "packet format", "continuation of a packet"};

std::uint8_t
checksum (ByteView bytes)
{
  return std::uint8_t (std::accumulate (bytes.begin (), bytes.end (), 0u));
}

} // namespace

Bytes
encode_message (PacketType type, std::uint16_t command, ByteView payload)
{
  constexpr std::uint8_t kWhole = 0; // not a part of a longer message
  Bytes packet{std::uint8_t (type), std::uint8_t (command >> 8),
      std::uint8_t (command), kWhole};
  packet.reserve (kHeadSize + payload.size () + 1);
  append_le (packet, std::uint32_t (payload.size ()), 2);
  append (packet, payload);
  packet.push_back (checksum (packet));
  return packet;
}

Bytes
encode_sequence (const Sequence &sequence, int bytes)
{
  constexpr int kBits = 1, kNoInverse = 0, kNoDelay = 0, kRepeat = 1;
  return bytes_of ({{kBits, 1}, {sequence.patterns, bytes == 19 ? 2 : 1},
      {kNoInverse, 1}, {std::int64_t (sequence.trigger), 1}, {kNoDelay, 4},
      {sequence.period, 4}, {sequence.exposure, 4}, {kGreen, 1},
      {kRepeat, bytes > 17 ? 1 : 0}});
}

Bytes
encode_camera_trigger (bool enable, std::uint32_t pulse_us)
{
  return bytes_of ({{enable, 1}, {0, 2}, {0, 4}, {pulse_us, 4}});
}

Result<PacketHead>
parse_head (ByteView head)
{
  if (head.size () != kHeadSize)
    return Error{"a packet begins with " + std::to_string (head.size ()) +
                     " bytes instead of 6",
        ErrorCode::device};
  const auto type = PacketType (head[0]);
  switch (type) {
  case PacketType::busy:
  case PacketType::error:
  case PacketType::write_response:
  case PacketType::read_response:
    break;
  default:
    return Error{"a packet of type " + std::to_string (head[0]) +
                     " is not one that the board sends",
        ErrorCode::device};
  }
  return PacketHead{
      type, std::uint16_t (head[1] << 8 | head[2]), read_le (head, 4, 2)};
}

bool
checksum_holds (ByteView packet)
{
  return !packet.empty () &&
         checksum (packet.first (packet.size () - 1)) == packet.back ();
}

std::string
error_text (std::uint8_t code)
{
  return codedexposure::error_text (kErrors, code);
}

} // namespace codedexposure::lightcrafter
