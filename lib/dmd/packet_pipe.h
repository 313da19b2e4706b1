/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A way for packets to a device and back. */
#pragma once

#include <chrono>
#include <thread>

#include "base/result.h"
#include "dmd/little_endian.h"

namespace codedexposure
{

/** Packets out, packets in. Calls come from one thread at a time. */
class PacketPipe
{
public:
  using Milliseconds = std::chrono::milliseconds;

  virtual ~PacketPipe () = default;

  /** Sends whole packets; all of them, or an error. */
  virtual Result<void> write (ByteView packets, Milliseconds timeout) = 0;
  /** The next packet, as long as the device made it; empty when none came in
   * time. */
  virtual Result<Bytes> read (Milliseconds timeout) = 0;
  /** Whether the device was seen to be gone; it does not come back. */
  virtual bool gone () const = 0;
  /** Lets the device have some time. */
  virtual void pause (Milliseconds time) { std::this_thread::sleep_for (time); }
};

} // namespace codedexposure
