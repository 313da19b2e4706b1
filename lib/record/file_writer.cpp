/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "record/file_writer.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <utility>

#include <fcntl.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "base/try.h"

namespace codedexposure
{

namespace
{

Error
failure (const std::string &path, int error)
{
  const std::string remedy =
      error == ENOSPC ? "; make room on its disk, or choose another" : "";
  return {"cannot write " + path + ": " + std::strerror (error) + remedy,
      ErrorCode::io};
}

/* A try would fill the disk first. */
bool
has_room (int file, std::uint64_t size)
{
  struct statvfs system = {};
  return fstatvfs (file, &system) != 0 ||
         size / system.f_frsize < system.f_bavail;
}

Result<void>
reserve_space (const std::string &path, int file, std::uint64_t size)
{
  if (size == 0)
    return {};
  int error = ENOSPC;
  if (has_room (file, size))
    error =
        fallocate (file, FALLOC_FL_KEEP_SIZE, 0, off_t (size)) == 0 ? 0 : errno;
  if (error == 0 || error == EOPNOTSUPP || error == ENOSYS)
    return {};
  return Error{"cannot reserve " + std::to_string ((size + 999999) / 1000000) +
                   " MB for " + path + ": " + std::strerror (error) +
                   "; make room on its disk, or record fewer frames",
      ErrorCode::io};
}

} // namespace

Result<std::unique_ptr<FileWriter>>
FileWriter::open (const std::string &path, std::uint64_t reserve)
try {
  const int file =
      ::open (path.c_str (), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file < 0)
    return failure (path, errno);
  std::unique_ptr<FileWriter> writer (new FileWriter (path, file, reserve));
  if (lseek (file, 0, SEEK_CUR) < 0)
    return Error{"cannot write " + path +
                     ": it is a pipe, which takes no raw frames; write a file, "
                     "or record FFV1",
        ErrorCode::io};
  RETURN_IF_ERROR (reserve_space (path, file, reserve));
  return writer;
} catch (const std::exception &error) {
  return Error{"cannot write " + path + ": " + error.what ()};
}

FileWriter::~FileWriter ()
{
  close (file_);
}

Result<void>
FileWriter::write (const void *data, std::size_t size)
{
  for (const auto *bytes = static_cast<const std::byte *> (data); size > 0;) {
    const ssize_t written =
        TEMP_FAILURE_RETRY (pwrite (file_, bytes, size, off_t (position_)));
    if (written <= 0)
      return failure (path_, written < 0 ? errno : EIO);
    bytes += written;
    size -= std::size_t (written);
    position_ += std::uint64_t (written);
  }
  end_ = std::max (end_, position_);
  pass_on ();
  return {};
}

/* The disk writes one step while the next ones come; those before it leave the
 * memory. Where the file system has no disk, nothing happens. */
void
FileWriter::pass_on ()
{
  constexpr std::uint64_t kStep = 8 << 20, kBehind = 4 * kStep;
  constexpr unsigned kWait = SYNC_FILE_RANGE_WAIT_BEFORE |
                             SYNC_FILE_RANGE_WRITE | SYNC_FILE_RANGE_WAIT_AFTER;
  for (; passed_ + kStep <= end_; passed_ += kStep) {
    sync_file_range (file_, off_t (passed_), kStep, SYNC_FILE_RANGE_WRITE);
    if (passed_ < kBehind)
      continue;
    const auto last = off_t (passed_ - kBehind);
    sync_file_range (file_, last, kStep, kWait);
    posix_fadvise (file_, last, kStep, POSIX_FADV_DONTNEED);
  }
}

/* A device has no length. */
Result<void>
FileWriter::restart ()
{
  position_ = passed_ = 0;
  if (std::exchange (end_, 0) == 0)
    return {};
  if (ftruncate (file_, 0) != 0 && errno != EINVAL)
    return failure (path_, errno);
  return reserve_space (path_, file_, reserve_);
}

Result<void>
FileWriter::finish ()
{
  if (reserve_ > 0 && ftruncate (file_, off_t (end_)) != 0)
    return failure (path_, errno);
  return {};
}

} // namespace codedexposure
