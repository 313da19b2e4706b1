/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/hid_packet.h"

#include <cassert>
#include <string>

namespace codedexposure
{

Bytes
encode_request (
    HidKind kind, std::uint8_t sequence, std::uint16_t command, ByteView data)
{
  assert (data.size () <= kHidRequestData);
  constexpr std::size_t kCommandSize = 2;
  Bytes message{std::uint8_t (kind), sequence};
  append_le (message, std::uint32_t (kCommandSize + data.size ()), 2);
  append_le (message, command, 2);
  append (message, data);
  message.resize (hid_packets (message.size ()) * kHidPacketSize);
  return message;
}

Result<HidReplyHead>
parse_reply_head (ByteView packet)
{
  constexpr std::uint8_t kRefused = 0x20;
  if (packet.size () != kHidPacketSize)
    return Error{"a reply packet has " + std::to_string (packet.size ()) +
                     " bytes instead of " + std::to_string (kHidPacketSize),
        ErrorCode::device};
  const HidReplyHead head{
      packet[1], (packet[0] & kRefused) != 0, read_le (packet, 2, 2)};
  if (head.length > kHidReplyData)
    return Error{"a reply announces " + std::to_string (head.length) +
                     " bytes, more than the " + std::to_string (kHidReplyData) +
                     " that a device can send",
        ErrorCode::device};
  return head;
}

} // namespace codedexposure
