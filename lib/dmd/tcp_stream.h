/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A TCP connection whose waits have a time limit. */
#pragma once

#include <chrono>
#include <memory>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "dmd/bytes.h"

namespace codedexposure
{

/** One connection, used from one thread at a time. */
class TcpStream
{
public:
  using Milliseconds = std::chrono::milliseconds;

  /** @p host  a name or an address. */
  static Result<std::unique_ptr<TcpStream>> connect (
      const std::string &host, int port, Milliseconds timeout);
  ~TcpStream ();
  TcpStream (const TcpStream &) = delete;
  TcpStream &operator= (const TcpStream &) = delete;

  /** @p timeout  for all of it. */
  Result<void> send (ByteView bytes, Milliseconds timeout);
  /** Exactly @p size bytes; @p timeout for all of them. */
  Result<Bytes> receive (std::size_t size, Milliseconds timeout);
  /** Whether a failure or a cancelled wait left the stream within a message, or
   * the other side has closed it. */
  bool broken () const { return broken_; }

  /** Waits end within 50 ms of a request to @p stop. */
  void cancel_on (std::stop_token stop) { stop_ = std::move (stop); }

private:
  explicit TcpStream (int socket) : socket_ (socket) {}
  using Clock = std::chrono::steady_clock;

  Result<void> wait_for (short events, Clock::time_point deadline);
  Error fail (const std::string &message, ErrorCode code = ErrorCode::io);

  const int socket_;
  std::stop_token stop_;
  bool broken_ = false;
};

} // namespace codedexposure
