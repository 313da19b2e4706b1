/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "emulation/own_network.h"

#include <arpa/inet.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>

namespace codedexposure
{

namespace
{

Error
refused (const char *what)
{
  return {std::string (what) + ": " + std::generic_category ().message (errno),
      ErrorCode::denied};
}

bool
write_text (const char *path, const std::string &text)
{
  std::ofstream file (path);
  file << text;
  file.close ();
  return bool (file);
}

/* The user is root in the new user namespace. */
bool
map_user (uid_t user, gid_t group)
{
  return write_text ("/proc/self/setgroups", "deny") &&
         write_text (
             "/proc/self/uid_map", "0 " + std::to_string (user) + " 1") &&
         write_text (
             "/proc/self/gid_map", "0 " + std::to_string (group) + " 1");
}

bool
add_address (int socket, int number)
{
  ifreq request = {};
  if (number == 1)
    std::strcpy (request.ifr_name, "lo");
  else
    std::snprintf (request.ifr_name, IFNAMSIZ, "lo:%d", number);
  auto *address = reinterpret_cast<sockaddr_in *> (&request.ifr_addr);
  address->sin_family = AF_INET;
  address->sin_addr.s_addr = htonl (INADDR_LOOPBACK - 1 + unsigned (number));
  if (ioctl (socket, SIOCSIFADDR, &request) != 0)
    return false;
  address->sin_addr.s_addr = htonl (0xff000000);
  if (ioctl (socket, SIOCSIFNETMASK, &request) != 0 ||
      ioctl (socket, SIOCGIFFLAGS, &request) != 0)
    return false;
  request.ifr_flags |= IFF_UP;
  return ioctl (socket, SIOCSIFFLAGS, &request) == 0;
}

} // namespace

Result<void>
leave_network (int addresses)
{
  const uid_t user = geteuid ();
  const gid_t group = getegid ();
  if (unshare (CLONE_NEWNET | (user == 0 ? 0 : CLONE_NEWUSER)) != 0 ||
      (user != 0 && !map_user (user, group)))
    return refused (
        "unprivileged network namespaces are disabled; run as root");
  const int socket = ::socket (AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  bool good = socket >= 0;
  for (int number = 1; good && number <= addresses; number++)
    good = add_address (socket, number);
  const auto failed =
      good ? Result<void> () : refused ("cannot set up the loopback interface");
  if (socket >= 0)
    close (socket);
  return failed;
}

} // namespace codedexposure
