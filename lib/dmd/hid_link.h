/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Requests and replies, one at a time, over a pipe that may fail. */
#pragma once

#include <memory>
#include <stop_token>
#include <string>

#include "dmd/hid_packet.h"
#include "dmd/packet_pipe.h"

namespace codedexposure
{

/** What a device answered. */
struct HidReply {
  bool refused = false;
  Bytes data = {};
};

/**
 * Talks to one controller: one request in flight, the reply of the same
 * sequence number, others dropped. For one thread at a time.
 *
 * A job, which begin () begins, ends within 50 ms of a request to stop, and
 * when the device has kept it waiting for longer than its patience in all; a
 * message that was begun is always finished as far as the pipe allows, so that
 * the device is left between two messages.
 */
class HidLink
{
public:
  using Milliseconds = std::chrono::milliseconds;

  /** What a job waits for a device that does not answer, or is not ready. */
  static constexpr Milliseconds kPatience{2000};

  /** @p name  of the device, for messages. Drops replies that wait from an
   * earlier conversation. */
  HidLink (std::unique_ptr<PacketPipe> pipe, std::string name);

  /** Data that the device answers. Error for a refusal, too. */
  Result<HidReply> read (const HidCommand &command, ByteView data = {});
  /** The device acknowledges, or refuses. */
  Result<HidReply> write (const HidCommand &command, ByteView data);
  /** Nothing is answered; a failure on the way is the only one known. */
  Result<void> post (const HidCommand &command, ByteView data);

  /** @p stop  a token without a source: never. */
  void begin (std::stop_token stop = {}, Milliseconds patience = kPatience);
  bool cancelled () const { return stop_.stop_requested (); }
  /** Lets time go by that the device was given; error when cancelled. */
  Result<void> pause (Milliseconds time);
  /** Gives the device time that it should not need; false when the job's
   * patience is at its end. */
  bool wait (Milliseconds time);

  bool gone () const { return pipe_->gone (); }
  const std::string &name () const { return name_; }

  /** "NAME: cannot WHAT: REASON". */
  Error error (const std::string &what, const std::string &reason,
      ErrorCode code = ErrorCode::device) const;

private:
  Result<HidReply> transact (
      HidKind kind, const HidCommand &command, ByteView data);
  Result<void> send (HidKind kind, const HidCommand &command, ByteView data);
  Result<HidReply> receive (const HidCommand &command);
  Result<Bytes> receive_rest (HidReplyHead head, Bytes first);
  void drain ();

  const std::unique_ptr<PacketPipe> pipe_;
  const std::string name_;
  std::stop_token stop_;
  Milliseconds patience_ = kPatience; // that is left to the job
  std::uint8_t sequence_ = 0;
  bool unclean_ = true; // a reply to nobody may be waiting
};

} // namespace codedexposure
