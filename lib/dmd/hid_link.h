/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* USB messages of DLPC350 and DLPC900: their packets, the commands of both, and
 * requests with their replies over a pipe that may fail. */
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

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
  /** The device answers within this time, or not at all. */
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

constexpr HidCommand kPower{0x0200, "leave standby", std::chrono::seconds (10)};
constexpr HidCommand kPowerMode{kPower.word, "read the power mode"};
constexpr HidCommand kVersion{0x0205, "read the firmware version"};
constexpr HidCommand kHardwareStatus{0x1A0A, "read the hardware status"};
constexpr HidCommand kMainStatus{0x1A0C, "read the main status"};
constexpr HidCommand kDisplayMode{0x1A1B, "set the display mode"};
constexpr HidCommand kTriggerOut2{0x1A1E, "set up trigger output 2"};
constexpr HidCommand kRun{0x1A24, "start or stop the patterns"};
constexpr HidCommand kTriggerIn1{0x1A35, "set up trigger input 1"};

constexpr std::uint8_t kPowerNormal = 0;
/** Bytes of the version reply. */
constexpr std::size_t kVersionSize = 16;
constexpr std::uint8_t kRunStop = 0;
constexpr std::uint8_t kRunStart = 2;
/** Main status. */
constexpr std::uint8_t kParked = 1 << 0;
constexpr std::uint8_t kSequencerRuns = 1 << 1;
/** Hardware status. */
constexpr std::uint8_t kInitialised = 1 << 0;
constexpr std::uint8_t kSecondController = 1 << 4;

} // namespace dlp

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
 * after the device has kept it waiting for longer than its patience in all; a
 * command that may take longer than kPatience has its own time. If a job does
 * not wait for a reply to its end, the next request does, because controllers
 * can hang when they get two at once.
 *
 * A message is always finished as far as the pipe allows. Where the pipe cuts
 * one short, the next request first realigns.
 */
class HidLink
{
public:
  using Milliseconds = std::chrono::milliseconds;

  /** How long a job waits for a device that does not answer or is not ready. */
  static constexpr Milliseconds kPatience{2000};

  /** @p name  of the device, for messages. Drops replies that wait from an
   * earlier conversation. @p serial  empty: not known. */
  HidLink (std::unique_ptr<PacketPipe> pipe, std::string name,
      std::string serial = {})
      : pipe_ (std::move (pipe)), name_ (std::move (name)),
        serial_ (std::move (serial))
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

  /** Brings the device to the start of a message, if it may take the next
   * packets for the rest of one that was cut short: asks for its version until
   * it answers. */
  Result<void> realign ();

  bool gone () const { return pipe_->gone (); }
  const std::string &name () const { return name_; }
  const std::string &serial () const { return serial_; }

  /** "NAME: cannot WHAT: REASON". */
  Error error (const std::string &what, const std::string &reason,
      ErrorCode code = ErrorCode::device) const;

private:
  Result<HidReply> transact (
      HidKind kind, const HidCommand &command, ByteView data);
  Result<void> send (HidKind kind, const HidCommand &command, ByteView data);
  Result<HidReply> receive (const HidCommand &command);
  std::optional<HidReplyHead> own_reply (ByteView packet) const;
  bool await_last ();
  Result<Bytes> receive_rest (HidReplyHead head, Bytes first);
  Error error (const char *what, const Error &reason) const
  {
    return error (what, reason.message, reason.code);
  }
  void drain ();

  const std::unique_ptr<PacketPipe> pipe_;
  const std::string name_, serial_;
  std::stop_token stop_;
  Milliseconds patience_ = kPatience; // that is left to the job
  std::uint8_t sequence_ = 0;
  bool unclean_ = true; // an unexpected reply may be waiting
  bool cut_ = false;    // the device may be waiting for the rest of a message
  Milliseconds due_{0}; // time in which the last request may be answered
};

} // namespace codedexposure
