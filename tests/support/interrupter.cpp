/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* For LD_PRELOAD: the signal SIGNAL comes when a program locks its file number
 * LOCK, from 1 on. */
#include <dlfcn.h>
#include <sys/file.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>

extern "C" int
flock (int fd, int how)
{
  static auto *real =
      reinterpret_cast<int (*) (int, int)> (dlsym (RTLD_NEXT, "flock"));
  static std::atomic<int> locks = 0;
  const int result = real (fd, how);
  if (const char *lock = std::getenv ("LOCK"); lock && ++locks == atoi (lock))
    kill (getpid (), atoi (std::getenv ("SIGNAL")));
  return result;
}
