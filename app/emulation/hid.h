/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* An emulated controller that fails on command. */
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace codedexposure::emulated
{

using Packet = std::vector<std::uint8_t>;

/** A fault of a message or of the reply to it. */
enum class Fault {
  none,
  refuse,      ///< the message is ignored, and a NACK is sent
  lose_reply,  ///< executed, but no reply is sent
  late_reply,  ///< the reply is sent with that of the next message
  stale_reply, ///< a reply with another sequence number comes first
  short_reply, ///< the packet ends early
  wild_reply,  ///< a reply with a size above the limit
  cut,         ///< only the first packet is taken before the host gives up
  stall,       ///< the host cannot send
  unplug,      ///< disconnected for good
};
constexpr int kFaults = int (Fault::unplug) + 1;

/**
 * The part that controllers have in common: packets in, whole messages to
 * obey (), packets out. Faults strike the message of their number.
 */
class EmulatedHid
{
public:
  virtual ~EmulatedHid () = default;

  std::map<int, Fault> faults; ///< by number of the message, from 0

  /** Data of the writes of each command, in the order in which they came. */
  std::map<int, std::vector<std::vector<std::uint8_t>>> writes;

  bool gone () const { return gone_; }
  void unplug () { gone_ = true; }
  int messages () const { return messages_; }
  /** Messages that came before the reply to another was fetched. */
  int overlaps () const { return overlaps_; }
  virtual bool running () const = 0;

  /** Whether the last packet was not taken because the host is to wait. */
  bool hesitates () const { return hesitates_; }

  /** The host sends one packet of 64 bytes; false when it cannot. */
  bool out (const Packet &packet)
  {
    if (pending_.empty () && !begin_message ())
      return false;
    hesitates_ = !pending_.empty () && fault_ == Fault::cut;
    if (hesitates_) {
      fault_ = Fault::none;
      return false;
    }
    pending_.insert (pending_.end (), packet.begin (), packet.end ());
    const std::size_t needed = 4 + word (pending_, 2);
    if (pending_.size () < needed)
      return true;
    Packet message = std::move (pending_);
    pending_.clear ();
    message.resize (needed);
    if (needed >= 6)
      answer (message);
    return true;
  }

  /** The next packet for the host, none while there is none. */
  std::optional<Packet> in ()
  {
    if (gone_ || replies_.empty ())
      return std::nullopt;
    Packet packet = std::move (replies_.front ());
    replies_.pop_front ();
    return packet;
  }

protected:
  using Data = std::vector<std::uint8_t>;

  /** Does what a message asks for; none refuses it. */
  virtual std::optional<Data> obey (
      bool read, int command, const Data &data) = 0;

  /** Does nothing of what a message asks for. */
  virtual std::optional<Data> refuse () { return std::nullopt; }

  static std::uint32_t number (const Data &data, std::size_t at, int bytes)
  {
    std::uint32_t value = 0;
    for (int i = bytes - 1; i >= 0; i--)
      value = value * 256 + data.at (at + std::size_t (i));
    return value;
  }
  static std::size_t word (const Data &data, std::size_t at)
  {
    return number (data, at, 2);
  }

private:
  /** Draws the fault of a message; false where the host cannot send it. */
  bool begin_message ()
  {
    if (gone_)
      return false;
    overlaps_ += !replies_.empty ();
    const auto found = faults.find (messages_++);
    fault_ = found == faults.end () ? Fault::none : found->second;
    if (fault_ == Fault::unplug)
      gone_ = true;
    return !gone_ && fault_ != Fault::stall;
  }

  void answer (const Packet &message)
  {
    for (Packet &late : late_)
      replies_.push_back (std::move (late));
    late_.clear ();
    const bool read = (message[0] & 0x80) != 0;
    const Data data (message.begin () + 6, message.end ());
    if (!read && data.size () < 64)
      writes[int (word (message, 4))].push_back (data);
    const auto done = fault_ == Fault::refuse
                          ? refuse ()
                          : obey (read, int (word (message, 4)), data);
    if ((message[0] & 0x40) == 0)
      return;
    Packet reply{std::uint8_t (message[0] | (done ? 0 : 0x20)), message[1]};
    const Data content = done.value_or (Data{});
    reply.push_back (std::uint8_t (content.size () & 0xFF));
    reply.push_back (std::uint8_t (content.size () >> 8));
    reply.insert (reply.end (), content.begin (), content.end ());
    reply.resize ((reply.size () + 63) / 64 * 64);
    send (reply);
  }

  void send (const Packet &reply)
  {
    std::deque<Packet> packets;
    for (std::size_t at = 0; at < reply.size (); at += 64)
      packets.emplace_back (reply.begin () + std::ptrdiff_t (at),
          reply.begin () + std::ptrdiff_t (at + 64));
    switch (fault_) {
    case Fault::lose_reply:
      return;
    case Fault::late_reply:
      late_.insert (late_.end (), packets.begin (), packets.end ());
      return;
    case Fault::stale_reply: {
      Packet stale = packets.front ();
      stale[1] = std::uint8_t (stale[1] - 3);
      packets.push_front (stale);
      break;
    }
    case Fault::short_reply:
      packets.back ().resize (17);
      break;
    case Fault::wild_reply:
      packets.front ()[3] = 0xFF;
      break;
    default:
      break;
    }
    replies_.insert (replies_.end (), packets.begin (), packets.end ());
  }

  Packet pending_; // pieces of a message that is not complete
  std::deque<Packet> replies_;
  std::deque<Packet> late_;
  Fault fault_ = Fault::none;
  int messages_ = 0;
  int overlaps_ = 0;
  bool gone_ = false;
  bool hesitates_ = false;
};

/** What DLPC350 and DLPC900 have in common: their power, their mode, and
 * commands of a fixed length. */
class EmulatedDlpc : public EmulatedHid
{
public:
  bool standby = false;

  bool running () const override { return running_; }

protected:
  using Lengths = std::map<int, std::size_t>;

  /** @p lengths  data bytes of the writes that have a fixed number of them. */
  EmulatedDlpc (int mode, Lengths lengths)
      : mode_ (mode), lengths_ (std::move (lengths))
  {
  }

  /** The data of a register; none: there is none. */
  virtual std::optional<Data> answer (int command) = 0;
  /** Does what a write asks for; returns an error code, or 0. */
  virtual int execute (int command, const Data &data) = 0;

  static constexpr int kUnknown = 3, kNotNow = 5, kInvalid = 6, kInternal = 255;

  int mode_;
  int error_ = 0; // of the previous command
  bool running_ = false;

private:
  std::optional<Data> obey (bool read, int command, const Data &data) override
  {
    if (read) {
      auto found = answer_common (command);
      if (!found)
        found = answer (command);
      if (!found)
        error_ = kUnknown;
      return found;
    }
    error_ = check (command, data);
    if (error_ == 0 && command != kPower)
      error_ = execute (command, data);
    return error_ == 0 ? std::optional (Data{}) : std::nullopt;
  }

  std::optional<Data> refuse () override
  {
    error_ = kInternal;
    return std::nullopt;
  }

  std::optional<Data> answer_common (int command)
  {
    switch (command) {
    case kPower:
      // Leaving standby takes time.
      if (waking_ > 0 && --waking_ == 0)
        standby = false;
      return Data{std::uint8_t (standby ? 1 : 0)};
    case 0x1A0C:
      return Data{std::uint8_t (running_ ? 2 : 0)};
    case 0x1A1B:
      return Data{std::uint8_t (mode_)};
    default:
      return std::nullopt;
    }
  }

  int check (int command, const Data &data)
  {
    const auto length = lengths_.find (command);
    if (length != lengths_.end () && data.size () != length->second)
      return kInvalid;
    if (command == kPower)
      waking_ = standby && data[0] == 0 ? 3 : 0;
    return standby && command != kPower ? kNotNow : 0;
  }

  static constexpr int kPower = 0x0200;

  const Lengths lengths_;
  int waking_ = 0;
};

} // namespace codedexposure::emulated
