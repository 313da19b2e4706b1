/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* For LD_PRELOAD: a disk that changes one bit of what a program writes to a
 * .part file, in its third write of 1,000 bytes or more. */
#include <dlfcn.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <string_view>
#include <vector>

namespace
{

std::atomic<int> writes = 0;

bool
lies (int fd, size_t size)
{
  char link[64], name[4096];
  std::snprintf (link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t length = readlink (link, name, sizeof name);
  return size >= 1000 && length > 0 &&
         std::string_view (name, size_t (length)).ends_with (".part") &&
         ++writes == 3;
}

template <typename Function>
Function *
next (const char *name)
{
  return reinterpret_cast<Function *> (dlsym (RTLD_NEXT, name));
}

} // namespace

extern "C" ssize_t
write (int fd, const void *data, size_t size)
{
  static auto *real = next<ssize_t (int, const void *, size_t)> ("write");
  if (!lies (fd, size))
    return real (fd, data, size);
  const auto *bytes = static_cast<const char *> (data);
  std::vector<char> changed (bytes, bytes + size);
  changed[size / 2] ^= 1;
  return real (fd, changed.data (), size);
}

extern "C" ssize_t
writev (int fd, const iovec *parts, int count)
{
  static auto *real = next<ssize_t (int, const iovec *, int)> ("writev");
  size_t size = 0;
  for (int i = 0; i < count; i++)
    size += parts[i].iov_len;
  if (!lies (fd, size))
    return real (fd, parts, count);
  std::vector<char> changed;
  for (int i = 0; i < count; i++) {
    const auto *bytes = static_cast<const char *> (parts[i].iov_base);
    changed.insert (changed.end (), bytes, bytes + parts[i].iov_len);
  }
  changed[size / 2] ^= 1;
  const iovec whole{changed.data (), size};
  return real (fd, &whole, 1);
}
