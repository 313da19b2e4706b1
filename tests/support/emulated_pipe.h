/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Passes packets directly to an emulated controller. It has its own clock, so
 * that waiting takes no time. */
#pragma once

#include <algorithm>
#include <functional>
#include <memory>

#include "dmd/hid_link.h"
#include "emulation/hid.h"

namespace codedexposure::test
{

using namespace emulated;

class EmulatedPipe : public PacketPipe
{
public:
  /** Time of this clock, which advances only while a caller waits. */
  struct Clock {
    Milliseconds now{0};
    Milliseconds wire{0};         ///< of it, packets were under way
    Milliseconds silent_until{0}; ///< the device works and sends nothing
    /** Called when packets are sent. */
    std::function<void ()> on_write = [] {};
  };

  EmulatedPipe (
      std::shared_ptr<EmulatedHid> device, std::shared_ptr<Clock> clock)
      : device_ (std::move (device)), clock_ (std::move (clock))
  {
  }

  Result<void> write (ByteView packets, Milliseconds timeout) override
  {
    clock_->on_write ();
    for (std::size_t at = 0; at < packets.size (); at += 64) {
      const auto packet = packets.subspan (at, 64);
      clock_->now += kPacket;
      clock_->wire += kPacket;
      if (!device_->out ({packet.begin (), packet.end ()})) {
        if (!device_->gone ())
          clock_->now += timeout;
        return Error{"it takes no packets"};
      }
    }
    return {};
  }
  Result<Bytes> read (Milliseconds timeout) override
  {
    if (device_->gone ())
      return Error{"it is gone"};
    if (clock_->now < clock_->silent_until) {
      clock_->now = std::min (clock_->now + timeout, clock_->silent_until);
      return Bytes{};
    }
    const auto packet = device_->in ();
    clock_->now += packet ? kPacket : timeout;
    clock_->wire += packet ? kPacket : Milliseconds (0);
    return packet.value_or (Bytes{});
  }
  bool gone () const override { return device_->gone (); }
  void pause (Milliseconds time) override { clock_->now += time; }

private:
  static constexpr Milliseconds kPacket{1};

  std::shared_ptr<EmulatedHid> device_;
  std::shared_ptr<Clock> clock_;
};

} // namespace codedexposure::test
