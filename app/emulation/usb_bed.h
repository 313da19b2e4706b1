/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* An emulated USB for the unmodified libusb, with boards that are connected and
 * disconnected. */
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <umockdev.h>

#include "emulation/hid.h"

namespace codedexposure::emulated
{

class UsbPort;

/** Library that a process must preload to see the bus; a sanitizer must come
 * first. */
#ifdef __SANITIZE_ADDRESS__
inline constexpr const char *kPreload = "libasan.so.8 libumockdev-preload.so.0";
#else
inline constexpr const char *kPreload = "libumockdev-preload.so.0";
#endif

/** One bus; one at a time in a process. */
class UsbBed
{
public:
  UsbBed ();
  ~UsbBed ();
  UsbBed (const UsbBed &) = delete;
  UsbBed &operator= (const UsbBed &) = delete;

  /** @p port  such as "1-2", the 2 in 1..9; @p product  0x6401 or 0xC900. */
  void plug (const std::string &port, std::uint16_t product,
      const std::string &serial, std::shared_ptr<EmulatedHid> board);
  /** Disconnects the board, even during a transfer. */
  void unplug (const std::string &port);
  /** Waits until no process has a disconnected board open. */
  void forget_pulled ();
  /** Whether the kernel's own driver has the board. */
  bool kernel_driver_bound (const std::string &port) const;
  /** The board at @p port is held by another program. */
  void occupy (const std::string &port);
  /** Whether the board at @p port shows masks; also while somebody uses it. */
  bool running (const std::string &port) const;
  /** Whether no process waits for the board: it has been asked for something
   * before, and all that it was asked for is answered. True stays true while
   * those who use it are stopped. */
  bool idle (const std::string &port) const;

private:
  UMockdevTestbed *const bed_;
  std::map<std::string, std::unique_ptr<UsbPort>> ports_;
  // Whoever had a board open asks its port once more before it sees the end.
  std::vector<std::unique_ptr<UsbPort>> pulled_;
};

} // namespace codedexposure::emulated
