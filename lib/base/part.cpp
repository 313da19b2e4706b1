/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "base/part.h"

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace codedexposure
{

namespace fs = std::filesystem;

namespace
{

std::string
reason (int error)
{
  return std::generic_category ().message (error);
}

} // namespace

Part::Part (std::string name, Kind kind, std::string path)
    : name_ (std::move (name)),
      path_ (path.empty () ? name_ + ".part" : std::move (path)), kind_ (kind)
{
}

Part::~Part ()
{
  if (lock_ >= 0)
    close (lock_);
}

/* False, with errno: it exists, or cannot be created. */
bool
Part::create ()
{
  if (kind_ == kFolder)
    return mkdir (path_.c_str (), 0777) == 0;
  const int file = open (path_.c_str (), O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file >= 0)
    close (file);
  return file >= 0;
}

/* False, with errno: another run has it. That run may also have renamed it
 * while this one waited for the lock. */
bool
Part::lock ()
{
  lock_ = open (path_.c_str (),
      O_RDONLY | O_CLOEXEC | (kind_ == kFolder ? O_DIRECTORY : 0));
  if (lock_ < 0 || flock (lock_, LOCK_EX | LOCK_NB) != 0)
    return false;
  struct stat locked = {}, there = {};
  if (fstat (lock_, &locked) == 0 && stat (path_.c_str (), &there) == 0 &&
      locked.st_ino == there.st_ino)
    return true;
  errno = EWOULDBLOCK;
  return false;
}

bool
Part::is_empty () const
{
  std::error_code error;
  return fs::is_empty (path_, error);
}

Error
Part::busy () const
{
  return {"another run is writing " + name_ +
              "; choose another name, or wait for its end",
      ErrorCode::io};
}

Error
Part::unwritable () const
{
  const char *remedy = errno == ENAMETOOLONG
                           ? "; choose a shorter name"
                           : "; choose a folder that you can write to";
  return {
      "cannot write " + name_ + ": " + reason (errno) + remedy, ErrorCode::io};
}

Result<void>
Part::claim (bool replace)
{
  std::error_code ignored;
  fs::create_directories (fs::path (path_).parent_path (), ignored);
  const bool created = create ();
  if (!created && errno != EEXIST)
    return unwritable ();
  if (!lock ())
    return errno == EWOULDBLOCK ? busy () : unwritable ();
  if (created || is_empty ())
    return {};
  if (!replace)
    return Error{path_ + " was left by a run that was killed; rename it to use "
                         "what it holds, or set --force to replace it",
        ErrorCode::io};
  if (kind_ == kFile)
    return truncate (path_.c_str (), 0) == 0 ? Result<void> () : unwritable ();
  for (const auto &entry : fs::directory_iterator (path_, ignored))
    fs::remove_all (entry, ignored);
  return {};
}

/* What a user has put into the folder that was replaced. */
Result<void>
Part::keep_others ()
{
  std::error_code failed, ignored;
  for (const auto &entry : fs::directory_iterator (path_, failed)) {
    const fs::path kept = fs::path (name_) / entry.path ().filename ();
    if (!failed && !fs::exists (fs::symlink_status (kept, ignored)))
      fs::rename (entry, kept, failed);
  }
  if (failed)
    return Error{"cannot move what " + name_ + " held besides: " +
                     failed.message () + "; it is in " + path_,
        ErrorCode::io};
  discard ();
  return {};
}

Result<void>
Part::publish (bool replace)
{
  /* A full disk or a lost network may be reported only here. */
  if (fsync (lock_) != 0 && errno != EINVAL)
    return Error{
        "cannot finish " + path_ + ": " + reason (errno), ErrorCode::io};
  /* A folder takes no other's place, but changes it. */
  if (kind_ == kFolder && replace &&
      renameat2 (AT_FDCWD, path_.c_str (), AT_FDCWD, name_.c_str (),
          RENAME_EXCHANGE) == 0)
    return keep_others ();
  return move_file (path_, name_, replace);
}

void
Part::discard ()
{
  std::error_code ignored;
  fs::remove_all (path_, ignored);
}

Result<void>
move_file (const std::string &from, const std::string &to, bool replace)
{
  int failed = renameat2 (AT_FDCWD, from.c_str (), AT_FDCWD, to.c_str (),
      replace ? 0 : RENAME_NOREPLACE);
  std::error_code ignored;
  if (failed != 0 && errno == EINVAL) { // a file system without that flag
    if (replace || !fs::exists (to, ignored))
      failed = std::rename (from.c_str (), to.c_str ());
    else
      errno = EEXIST;
  }
  if (failed == 0)
    return {};
  const int error = errno;
  if (error == ENOENT && !fs::exists (from, ignored))
    return Error{from +
                     " is gone; it, or its folder, was removed or renamed "
                     "while it was written. If it is elsewhere, rename it "
                     "to " +
                     to,
        ErrorCode::io};
  return Error{"cannot rename " + from + " to " + to + ": " + reason (error) +
                   "; rename it yourself",
      ErrorCode::io};
}

} // namespace codedexposure
