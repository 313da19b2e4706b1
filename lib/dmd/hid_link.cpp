/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/hid_link.h"

#include <algorithm>
#include <cassert>

#include "base/try.h"

namespace codedexposure
{

namespace
{

using namespace std::chrono_literals;

/** Waits are cut into pieces of this length, between which a stop is noticed.
 */
constexpr std::chrono::milliseconds kPiece{50};
constexpr std::chrono::milliseconds kDrainTime{5};
/** The packets of a message follow each other as fast as the bus allows: a
 * device that holds them up for this long is out of order. */
constexpr std::chrono::milliseconds kWriteTime{2000};
/** In which a device answers a question, unless it took the packet for the rest
 * of another message. */
constexpr std::chrono::milliseconds kAlignTime{200};
/** The packets of one reply follow each other. */
constexpr std::chrono::milliseconds kRestTime{200};
constexpr int kMaxStrayPackets = 64;

} // namespace

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

Error
HidLink::error (
    const std::string &what, const std::string &reason, ErrorCode code) const
{
  if (gone ())
    return Error{name_ + " was unplugged or switched off; connect it, then "
                         "open it again",
        ErrorCode::not_found};
  return Error{name_ + ": cannot " + what + ": " + reason, code};
}

void
HidLink::begin (std::stop_token stop, Milliseconds patience)
{
  stop_ = std::move (stop);
  patience_ = patience;
}

Result<void>
HidLink::pause (Milliseconds time)
{
  for (; time > 0ms && !cancelled (); time -= kPiece)
    pipe_->pause (std::min (time, kPiece));
  if (cancelled ())
    return error ("go on", "cancelled", ErrorCode::cancelled);
  return {};
}

bool
HidLink::wait (Milliseconds time)
{
  if (cancelled () || patience_ < time)
    return false;
  patience_ -= time;
  pipe_->pause (time);
  return true;
}

Result<HidReply>
HidLink::transact (HidKind kind, const HidCommand &command, ByteView data)
{
  RETURN_IF_ERROR (send (kind, command, data));
  auto reply = receive (command);
  unclean_ = !reply.ok ();
  return reply;
}

Result<void>
HidLink::send (HidKind kind, const HidCommand &command, ByteView data)
{
  await_last ();
  if (due_ > 0ms)
    return error (command.name, "cancelled", ErrorCode::cancelled);
  if (cut_)
    RETURN_IF_ERROR (realign ());
  if (unclean_)
    drain ();
  const Bytes message = encode_request (kind, ++sequence_, command.word, data);
  const auto sent = pipe_->write (message, kWriteTime);
  unclean_ = !sent;
  if (sent)
    return sent;
  cut_ = message.size () > kHidPacketSize;
  patience_ -= kWriteTime;
  return error (command.name, sent.error ());
}

Result<HidReply>
HidLink::receive (const HidCommand &command)
{
  const bool slow = command.timeout > kPatience;
  const Milliseconds left_over = std::max (patience_, 0ms);
  const Milliseconds limit = slow ? std::max (command.timeout, left_over)
                                  : std::min (command.timeout, left_over);
  due_ = std::max (command.timeout, limit);
  bool strays = false;
  for (Milliseconds left = limit; left > 0ms;) {
    if (cancelled ())
      return error (command.name, "cancelled", ErrorCode::cancelled);
    const Milliseconds piece = std::min (left, kPiece);
    const auto packet = pipe_->read (piece);
    if (!packet)
      return error (command.name, packet.error ());
    const auto head = own_reply (*packet);
    if (!head) {
      // Nothing yet; or a late reply to an earlier request, or a piece of one.
      strays |= !packet->empty ();
      left -= piece;
      due_ -= piece;
      patience_ -= slow ? 0ms : piece;
      continue;
    }
    due_ = 0ms;
    auto rest = receive_rest (*head, *packet);
    if (!rest)
      return error (command.name, rest.error ());
    return HidReply{head->refused, *std::move (rest)};
  }
  return error (command.name,
      strays ? "it sends only replies to other requests; is another program "
               "using it?"
      : limit == 0ms
          ? std::string ("no time is left to wait for its reply; give it more "
                         "patience=")
          : "no reply within " + std::to_string (limit.count ()) + " ms",
      ErrorCode::timeout);
}

/** The head of the reply to the last request, if @p packet has it. */
std::optional<HidReplyHead>
HidLink::own_reply (ByteView packet) const
{
  const auto head = parse_reply_head (packet);
  return head && head->sequence == sequence_ ? std::optional (*head)
                                             : std::nullopt;
}

Result<Bytes>
HidLink::receive_rest (HidReplyHead head, Bytes first)
{
  Bytes data (first.begin () + HidReplyHead::kSize, first.end ());
  for (std::size_t packet = 1; packet < head.packets (); packet++) {
    ASSIGN_OR_RETURN (const Bytes more, pipe_->read (kRestTime));
    if (more.size () != kHidPacketSize)
      return Error{"the reply ends after " + std::to_string (data.size ()) +
                       " of " + std::to_string (head.length) + " bytes",
          ErrorCode::device};
    append (data, more);
  }
  data.resize (head.length);
  return data;
}

/** Waits for the reply that the last job did not wait for; whether it came. */
bool
HidLink::await_last ()
{
  while (due_ > 0ms && !cancelled () && !gone ()) {
    const Milliseconds piece = std::min (due_, kPiece);
    const auto packet = pipe_->read (piece);
    if (packet && own_reply (*packet)) {
      due_ = 0ms;
      return true;
    }
    if (!packet)
      pipe_->pause (piece);
    due_ -= piece;
  }
  return false;
}

Result<void>
HidLink::realign ()
{
  // The rest of the longest message, then one that is understood.
  for (std::size_t i = 0; i < hid_packets (kHidMessageSize); i++) {
    drain ();
    const auto sent = pipe_->write (
        encode_request (HidKind::read, ++sequence_, dlp::kVersion.word, {}),
        kWriteTime);
    if (!sent)
      return error (dlp::kVersion.name, sent.error ());
    due_ = kAlignTime;
    cut_ = !await_last ();
    if (!cut_)
      return {};
    if (due_ > 0ms)
      return error (dlp::kVersion.name, "cancelled", ErrorCode::cancelled);
  }
  return error ("reach it",
      "it takes no message since one was cut short; switch it off and on",
      ErrorCode::timeout);
}

void
HidLink::drain ()
{
  for (int packets = 0; packets < kMaxStrayPackets; packets++) {
    const auto stray = pipe_->read (kDrainTime);
    if (!stray || stray->empty ())
      return;
  }
}

} // namespace codedexposure
