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

/** One connection, used from one thread at a time. After a failure, it may
 * stand within a message: close it. */
class TcpStream
{
public:
  using Milliseconds = std::chrono::milliseconds;

  /** @p host  an IP address. @p timeout  for all of it. @p stop  as in
   * cancel_on (). */
  static Result<std::unique_ptr<TcpStream>> connect (const std::string &host,
      int port, Milliseconds timeout, std::stop_token stop = {});
  ~TcpStream ();
  TcpStream (const TcpStream &) = delete;
  TcpStream &operator= (const TcpStream &) = delete;

  /** @p timeout  for all of it. */
  Result<void> send (ByteView bytes, Milliseconds timeout);
  /** Exactly @p size bytes; @p timeout for all of them. */
  Result<Bytes> receive (std::size_t size, Milliseconds timeout);
  /** Waits end within 50 ms of a request to @p stop. */
  void cancel_on (std::stop_token stop) { stop_ = std::move (stop); }

private:
  explicit TcpStream (int socket) : socket_ (socket) {}
  using Clock = std::chrono::steady_clock;

  Result<void> wait_for (short events, Clock::time_point deadline);

  const int socket_;
  std::stop_token stop_;
};

} // namespace codedexposure
