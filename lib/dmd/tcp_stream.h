/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A TCP connection whose waits have a time limit. */
#pragma once

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <memory>
#include <stop_token>
#include <string>
#include <utility>

#include "base/free_with.h"
#include "base/result.h"
#include "base/text.h"
#include "base/try.h"
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
      int port, Milliseconds timeout, std::stop_token stop = {})
  {
    const std::string where = host + ":" + std::to_string (port);
    const auto deadline = Clock::now () + timeout;
    ASSIGN_OR_RETURN (const Addresses found, parse_address (host, port));
    const addrinfo *raw = found.get ();

    const int socket = ::socket (raw->ai_family,
        raw->ai_socktype | SOCK_CLOEXEC | SOCK_NONBLOCK, raw->ai_protocol);
    if (socket < 0)
      return Error{
          std::string ("cannot make a socket: ") + std::strerror (errno),
          ErrorCode::io};
    std::unique_ptr<TcpStream> stream (new TcpStream (socket));
    stream->cancel_on (std::move (stop));
    int code = 0;
    if (::connect (socket, raw->ai_addr, raw->ai_addrlen) != 0)
      code = errno;
    if (code == EINPROGRESS) {
      RETURN_IF_ERROR (with_prefix (stream->wait_for (POLLOUT, deadline),
          "cannot connect to " + where + ": "));
      socklen_t size = sizeof code;
      getsockopt (socket, SOL_SOCKET, SO_ERROR, &code, &size);
    }
    if (code != 0)
      return Error{"cannot connect to " + where + ": " + std::strerror (code) +
                       "; is the board on, and this computer in its network?",
          ErrorCode::io};
    const int on = 1;
    setsockopt (socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    return stream;
  }

  ~TcpStream () { close (socket_); }
  TcpStream (const TcpStream &) = delete;
  TcpStream &operator= (const TcpStream &) = delete;

  /** @p timeout  for all of it. */
  Result<void> send (ByteView bytes, Milliseconds timeout)
  {
    const auto deadline = Clock::now () + timeout;
    while (!bytes.empty ()) {
      RETURN_IF_ERROR (wait_for (POLLOUT, deadline));
      const ssize_t sent =
          ::send (socket_, bytes.data (), bytes.size (), MSG_NOSIGNAL);
      if (sent < 0 && errno != EAGAIN && errno != EINTR)
        return Error{std::strerror (errno), ErrorCode::io};
      bytes = bytes.subspan (std::size_t (std::max<ssize_t> (sent, 0)));
    }
    return {};
  }

  /** Exactly @p size bytes; @p timeout for all of them. */
  Result<Bytes> receive (std::size_t size, Milliseconds timeout)
  {
    const auto deadline = Clock::now () + timeout;
    Bytes bytes (size);
    for (std::size_t at = 0; at < size;) {
      RETURN_IF_ERROR (wait_for (POLLIN, deadline));
      const ssize_t got = ::recv (socket_, bytes.data () + at, size - at, 0);
      if (got == 0)
        return Error{"the board closed the connection", ErrorCode::io};
      if (got < 0 && errno != EAGAIN && errno != EINTR)
        return Error{std::strerror (errno), ErrorCode::io};
      at += std::size_t (std::max<ssize_t> (got, 0));
    }
    return bytes;
  }

  /** Waits end within 50 ms of a request to @p stop. */
  void cancel_on (std::stop_token stop) { stop_ = std::move (stop); }

private:
  explicit TcpStream (int socket) : socket_ (socket) {}
  using Clock = std::chrono::steady_clock;
  using Addresses = std::unique_ptr<addrinfo, FreeWith<freeaddrinfo>>;
  static constexpr Milliseconds kPatience{50};

  /** Names would be looked up by servers that the network of a board does not
   * have, and that cannot be told how long to take. */
  static Result<Addresses> parse_address (const std::string &host, int port)
  {
    addrinfo hints{};
    hints.ai_family = AF_UNSPEC;
    hints.ai_socktype = SOCK_STREAM;
    hints.ai_flags = AI_NUMERICHOST;
    addrinfo *raw = nullptr;
    if (getaddrinfo (
            host.c_str (), std::to_string (port).c_str (), &hints, &raw) != 0)
      return Error{in_quotes (host) +
                   " is no IP address; write one such as 192.168.1.100"};
    return Addresses (raw);
  }

  Result<void> wait_for (short events, Clock::time_point deadline)
  {
    for (;;) {
      if (stop_.stop_requested ())
        return Error{"cancelled", ErrorCode::cancelled};
      const auto left =
          std::chrono::ceil<Milliseconds> (deadline - Clock::now ());
      if (left <= Milliseconds (0))
        return Error{"no answer in time", ErrorCode::timeout};
      const auto wait = std::min (left, kPatience);
      pollfd poll_this{socket_, events, 0};
      const int ready = ::poll (&poll_this, 1, int (wait.count ()));
      if (ready > 0)
        return {};
      if (ready < 0 && errno != EINTR)
        return Error{std::strerror (errno), ErrorCode::io};
    }
  }

  const int socket_;
  std::stop_token stop_;
};

} // namespace codedexposure
