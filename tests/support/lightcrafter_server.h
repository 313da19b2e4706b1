/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* An emulated first LightCrafter as a server on this machine. Written from the
 * documentation of its protocol, not from the driver. */
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "base/image.h"

namespace codedexposure::test
{

/** Faults of the server. */
struct LightcrafterFaults {
  bool knows_0480 = true;
  bool wants_repeat = true; ///< the 18-byte form, not that of 17
  int busy_replies = 0;     ///< before the next mask is taken
  int silent_after = -1;    ///< masks after which it says no more
  int close_after = -1;     ///< masks after which it hangs up
  bool refuses_start = false;
  int stray_byte_after = -1; ///< masks after which one byte too many comes
  bool wrong_checksum = false;
};

class LightcrafterServer
{
public:
  using Data = std::vector<std::uint8_t>;
  using Mirrors = Image<std::uint8_t>;

  explicit LightcrafterServer (LightcrafterFaults faults = {})
      : faults_ (faults)
  {
    listener_ = socket (AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl (INADDR_LOOPBACK);
    bind (listener_, reinterpret_cast<sockaddr *> (&address), sizeof address);
    listen (listener_, 4);
    socklen_t size = sizeof address;
    getsockname (listener_, reinterpret_cast<sockaddr *> (&address), &size);
    port_ = ntohs (address.sin_port);
    thread_ = std::thread ([this] { serve (); });
  }
  ~LightcrafterServer ()
  {
    shutdown (listener_, SHUT_RDWR);
    {
      const std::lock_guard guard (lock_);
      if (client_ >= 0)
        shutdown (client_, SHUT_RDWR);
    }
    thread_.join ();
    close (listener_);
  }

  int port () const { return port_; }
  bool running () const { return locked (running_); }
  Data setting () const { return locked (setting_); }
  Data camera () const { return locked (camera_); }
  std::map<int, Mirrors> masks () const { return locked (masks_); }
  int masks_received () const { return locked (masks_received_); }

private:
  template <typename T>
  T locked (const T &value) const
  {
    const std::lock_guard guard (lock_);
    return value;
  }

  void serve ()
  {
    for (;;) {
      const int client = accept (listener_, nullptr, nullptr);
      if (client < 0)
        return;
      {
        const std::lock_guard guard (lock_);
        client_ = client;
      }
      while (serve_packet (client))
        ;
      const std::lock_guard guard (lock_);
      close (client);
      client_ = -1;
    }
  }

  static bool read_all (int client, Data &data)
  {
    std::size_t at = 0;
    while (at < data.size ()) {
      const ssize_t got =
          recv (client, data.data () + at, data.size () - at, 0);
      if (got <= 0)
        return false;
      at += std::size_t (got);
    }
    return true;
  }

  bool serve_packet (int client)
  {
    Data head (6);
    if (!read_all (client, head))
      return false;
    Data rest (head[4] + 256u * head[5] + 1);
    if (!read_all (client, rest))
      return false;
    unsigned sum = 0;
    for (const std::uint8_t byte : head)
      sum += byte;
    for (std::size_t i = 0; i + 1 < rest.size (); i++)
      sum += rest[i];
    const std::lock_guard guard (lock_);
    const bool intact = (sum & 0xFF) == rest.back ();
    rest.pop_back ();
    const int command = head[1] * 256 + head[2];
    if (command == 0x0401 && faults_.silent_after == int (masks_.size ()))
      return true;
    if (command == 0x0401 && faults_.close_after == int (masks_.size ()))
      return false;
    if (command == 0x0401 && faults_.busy_replies > 0) {
      faults_.busy_replies--;
      return reply (client, 0, command, {});
    }
    if (command == 0x0401 && faults_.stray_byte_after == int (masks_.size ())) {
      faults_.stray_byte_after = -1;
      const std::uint8_t stray = 0x55;
      send (client, &stray, 1, MSG_NOSIGNAL);
    }
    const int error = intact ? execute (command, rest) : 9;
    if (error != 0)
      return reply (client, 1, command, {std::uint8_t (error)});
    Data payload;
    if (command == 0x0100) {
      payload = {'v', '4', '.', '0'};
      payload.resize (32);
    }
    return reply (client, head[0] + 1, command, payload);
  }

  bool reply (int client, int type, int command, Data payload)
  {
    Data packet{std::uint8_t (type), std::uint8_t (command >> 8),
        std::uint8_t (command), 0, std::uint8_t (payload.size ()),
        std::uint8_t (payload.size () >> 8)};
    packet.insert (packet.end (), payload.begin (), payload.end ());
    unsigned sum = faults_.wrong_checksum ? 1 : 0;
    for (const std::uint8_t byte : packet)
      sum += byte;
    packet.push_back (std::uint8_t (sum));
    // In two pieces: TCP may split anywhere.
    return send (client, packet.data (), 3, MSG_NOSIGNAL) == 3 &&
           send (client, packet.data () + 3, packet.size () - 3, MSG_NOSIGNAL) >
               0;
  }

  int execute (int command, const Data &data)
  {
    switch (command) {
    case 0x0100:
      return 0;
    case 0x0101:
      mode_ = data.at (0);
      return 0;
    case 0x0402:
      if (data.at (0) == 1 && (mode_ != 4 || faults_.refuses_start ||
                                  int (masks_.size ()) < wanted_))
        return 7;
      running_ = data.at (0) == 1;
      return 0;
    case 0x0404:
      camera_ = data;
      return data.size () == 11 ? 0 : 3;
    case 0x0480:
      if (!faults_.knows_0480)
        return 2;
      return set (data, 19, data.size () == 19 ? data[1] + 256 * data[2] : 0);
    case 0x0400:
      return set (data, faults_.wants_repeat ? 18 : 17, data.at (1));
    case 0x0401:
      return take (data);
    default:
      return 2;
    }
  }

  int set (const Data &data, std::size_t size, int patterns)
  {
    if (data.size () != size || mode_ != 4 || patterns < 1 || patterns > 96)
      return 3;
    setting_ = data;
    masks_.clear (); // those of a sequence follow its setting
    wanted_ = patterns;
    return 0;
  }

  /** Reads a bitmap file by its own header. */
  int take (const Data &data)
  {
    const auto u32 = [&] (std::size_t at) {
      return data[at] | unsigned (data[at + 1]) << 8 |
             unsigned (data[at + 2]) << 16 | unsigned (data[at + 3]) << 24;
    };
    constexpr std::size_t kFile = 1; // behind the index
    if (running_ || data.size () != 52047 || data[kFile] != 'B' ||
        u32 (kFile + 2) != data.size () - 1 || data[kFile + 28] != 1)
      return 3;
    const int width = int (u32 (kFile + 18)), height = int (u32 (kFile + 22));
    if (width != 608 || height != 684 || data[0] >= wanted_)
      return 3;
    const bool second_is_white = u32 (kFile + 58) != 0;
    Mirrors mirrors (width, height);
    for (int y = 0; y < height; y++)
      for (int x = 0; x < width; x++) {
        const std::size_t at = kFile + u32 (kFile + 10) +
                               std::size_t (height - 1 - y) * 76 +
                               std::size_t (x / 8);
        const bool bit = (data[at] >> (7 - x % 8) & 1) != 0;
        mirrors.at (x, y) = bit == second_is_white;
      }
    masks_[data[0]] = mirrors;
    masks_received_++;
    return 0;
  }

  int listener_ = -1;
  int port_ = 0;
  mutable std::mutex lock_; // covers everything below
  LightcrafterFaults faults_;
  int client_ = -1;
  int mode_ = 0;
  int wanted_ = 0;
  int masks_received_ = 0;
  bool running_ = false;
  Data setting_, camera_;
  std::map<int, Mirrors> masks_;
  std::thread thread_; // last: it uses all of the above
};

} // namespace codedexposure::test
