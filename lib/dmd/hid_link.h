/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Requests and replies, one at a time, over a pipe that may fail. */
#pragma once

#include <chrono>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>

#include "base/result.h"
#include "dmd/hid_packet.h"

namespace codedexposure
{

/** Packets to a device and back. Calls come from one thread at a time. */
class PacketPipe
{
public:
  using Milliseconds = std::chrono::milliseconds;

  virtual ~PacketPipe () = default;

  /** Sends whole packets: all of them, or fails. */
  virtual Result<void> write (ByteView packets, Milliseconds timeout) = 0;
  /** The next packet, of the length that the device sent; empty after the
   * timeout. */
  virtual Result<Bytes> read (Milliseconds timeout) = 0;
  /** Whether the device has disappeared; it does not come back. */
  virtual bool gone () const = 0;
  /** Gives the device some time. */
  virtual void pause (Milliseconds time) { std::this_thread::sleep_for (time); }
};

/** The answer of a device. */
struct HidReply {
  bool refused = false;
  Bytes data = {};
};

/**
 * Talks to one controller: one request in flight; replies with another sequence
 * number are dropped. Not thread-safe.
 *
 * A job, which begin () begins, ends within 50 ms of a request to stop, and
 * after the device has kept it waiting for longer than its patience in all. A
 * message is always finished as far as the pipe allows, so that the device is
 * left between two messages.
 */
class HidLink
{
public:
  using Milliseconds = std::chrono::milliseconds;

  /** How long a job waits for a device that does not answer or is not ready. */
  static constexpr Milliseconds kPatience{2000};

  /** @p name  of the device, for messages. Drops replies that wait from an
   * earlier conversation. */
  HidLink (std::unique_ptr<PacketPipe> pipe, std::string name)
      : pipe_ (std::move (pipe)), name_ (std::move (name))
  {
  }

  /** The data that the device answers. A refusal is an answer, too. */
  Result<HidReply> read (const HidCommand &command, ByteView data = {})
  {
    return transact (HidKind::read, command, data);
  }
  /** The device acknowledges, or refuses. */
  Result<HidReply> write (const HidCommand &command, ByteView data)
  {
    return transact (HidKind::write, command, data);
  }
  /** The device does not answer; only a failure of the pipe is reported. */
  Result<void> post (const HidCommand &command, ByteView data)
  {
    return send (HidKind::post, command, data);
  }

  /** @p stop  a token without a source: never. */
  void begin (std::stop_token stop = {}, Milliseconds patience = kPatience);
  bool cancelled () const { return stop_.stop_requested (); }
  /** Waits as long as the device was told to take; fails when cancelled. */
  Result<void> pause (Milliseconds time);
  /** Waits for a device that is late; false at the end of the job's patience.
   */
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
  Error error (const char *what, const Error &reason) const
  {
    return error (what, reason.message, reason.code);
  }
  void drain ();

  const std::unique_ptr<PacketPipe> pipe_;
  const std::string name_;
  std::stop_token stop_;
  Milliseconds patience_ = kPatience; // that is left to the job
  std::uint8_t sequence_ = 0;
  bool unclean_ = true; // an unexpected reply may be waiting
};

} // namespace codedexposure
