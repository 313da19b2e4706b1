/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A network of the process's own, with nothing but the loopback in it: what
 * looks for cameras by broadcast reaches nobody else. */
#pragma once

#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>

namespace codedexposure::test
{

/** Moves the process there, with room for a camera at 127.0.0.1 and one at
 * 127.0.0.2; call it before there is another thread. False where the system
 * does not allow that. */
inline bool
enter_own_network ()
{
  const int user = geteuid () == 0 ? 0 : CLONE_NEWUSER;
  if (unshare (user | CLONE_NEWNET) != 0)
    return false;
  const int control = socket (AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ifreq up{};
  std::strcpy (up.ifr_name, "lo");
  up.ifr_flags = IFF_UP | IFF_RUNNING;
  ifreq second{};
  std::strcpy (second.ifr_name, "lo:1");
  sockaddr_in address{};
  address.sin_family = AF_INET;
  inet_pton (AF_INET, "127.0.0.2", &address.sin_addr);
  std::memcpy (&second.ifr_addr, &address, sizeof address);
  const bool done = ioctl (control, SIOCSIFFLAGS, &up) == 0 &&
                    ioctl (control, SIOCSIFADDR, &second) == 0;
  close (control);
  return done;
}

} // namespace codedexposure::test
