/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/tcp_stream.h"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <new>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

#include "base/try.h"

namespace codedexposure
{

namespace
{

using namespace std::chrono_literals;

constexpr auto kPatience = 50ms;

using Addresses = std::unique_ptr<addrinfo,
    std::integral_constant<decltype (&freeaddrinfo), freeaddrinfo>>;
using Deadline = std::chrono::steady_clock::time_point;

Result<Addresses>
ask_resolver (const std::string &host, int port, int flags)
{
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = flags;
  addrinfo *raw = nullptr;
  if (const int code = getaddrinfo (
          host.c_str (), std::to_string (port).c_str (), &hints, &raw);
      code != 0)
    return Error{gai_strerror (code), ErrorCode::not_found};
  return Addresses (raw);
}

/** A question to the resolver, which may outlive the one who asked. */
struct Lookup {
  std::mutex lock; // covers everything below
  std::condition_variable_any answered;
  std::optional<Result<Addresses>> answer;
};

/** Name servers may take far longer than the caller can wait, and the resolver
 * cannot be cancelled: it works in a thread that nobody waits for. */
Result<Addresses>
find_addresses (const std::string &host, int port, Deadline deadline,
    const std::stop_token &stop)
{
  if (auto address = ask_resolver (host, port, AI_NUMERICHOST))
    return address;
  const auto lookup = std::make_shared<Lookup> ();
  try {
    std::thread ([lookup, host, port] {
      Result<Addresses> answer = out_of_memory ();
      try {
        answer = ask_resolver (host, port, 0);
      } catch (const std::bad_alloc &) {
      }
      const std::lock_guard guard (lookup->lock);
      lookup->answer = std::move (answer);
      lookup->answered.notify_all ();
    }).detach ();
  } catch (const std::system_error &failed) {
    return Error{failed.what (), ErrorCode::io};
  }
  std::unique_lock guard (lookup->lock);
  if (lookup->answered.wait_until (
          guard, stop, deadline, [&] { return lookup->answer.has_value (); }))
    return *std::move (lookup->answer);
  return stop.stop_requested ()
             ? Error{"cancelled", ErrorCode::cancelled}
             : Error{"the name servers do not answer in time",
                   ErrorCode::timeout};
}

} // namespace

Result<std::unique_ptr<TcpStream>>
TcpStream::connect (const std::string &host, int port, Milliseconds timeout,
    std::stop_token stop)
{
  const std::string where = host + ":" + std::to_string (port);
  const auto deadline = Clock::now () + timeout;
  const auto found = find_addresses (host, port, deadline, stop);
  if (!found)
    return found.error ().with_prefix ("cannot find " + where + ": ");
  const addrinfo *raw = found->get ();

  const int socket = ::socket (raw->ai_family,
      raw->ai_socktype | SOCK_CLOEXEC | SOCK_NONBLOCK, raw->ai_protocol);
  if (socket < 0)
    return Error{std::string ("cannot make a socket: ") + std::strerror (errno),
        ErrorCode::io};
  std::unique_ptr<TcpStream> stream (new TcpStream (socket));
  stream->cancel_on (std::move (stop));
  int code = 0;
  if (::connect (socket, raw->ai_addr, raw->ai_addrlen) != 0)
    code = errno;
  if (code == EINPROGRESS) {
    if (const auto ready = stream->wait_for (POLLOUT, deadline); !ready)
      return ready.error ().with_prefix ("cannot connect to " + where + ": ");
    socklen_t size = sizeof code;
    getsockopt (socket, SOL_SOCKET, SO_ERROR, &code, &size);
  }
  if (code != 0)
    return Error{"cannot connect to " + where + ": " + std::strerror (code),
        ErrorCode::io};
  const int on = 1;
  setsockopt (socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  return stream;
}

TcpStream::~TcpStream ()
{
  close (socket_);
}

Result<void>
TcpStream::wait_for (short events, Clock::time_point deadline)
{
  for (;;) {
    if (stop_.stop_requested ())
      return Error{"cancelled", ErrorCode::cancelled};
    const auto left =
        std::chrono::ceil<Milliseconds> (deadline - Clock::now ());
    if (left <= 0ms)
      return Error{"no answer in time", ErrorCode::timeout};
    const auto wait = std::min<Milliseconds> (left, kPatience);
    pollfd poll_this{socket_, events, 0};
    const int ready = ::poll (&poll_this, 1, int (wait.count ()));
    if (ready > 0)
      return {};
    if (ready < 0 && errno != EINTR)
      return Error{std::strerror (errno), ErrorCode::io};
  }
}

Result<void>
TcpStream::send (ByteView bytes, Milliseconds timeout)
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

Result<Bytes>
TcpStream::receive (std::size_t size, Milliseconds timeout)
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

} // namespace codedexposure
