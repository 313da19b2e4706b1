/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A file that grows as fast as its disk takes it. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "base/result.h"

namespace codedexposure
{

/**
 * Writes a new file from front to back, as muxers do, which now and then go
 * back to fill in a size.
 *
 * All bytes are in the file when write () returns, so a program that is killed
 * loses none. The page cache passes them on to the disk steadily and keeps few,
 * so it does not fill with a recording, and write () waits for a disk that is
 * too slow.
 *
 * For one thread.
 */
class FileWriter
{
public:
  /** Replaces the content of @p path; allocates @p reserve bytes for it. An
   * error if it cannot be written, or if there is not enough space. */
  static Result<std::unique_ptr<FileWriter>> open (
      const std::string &path, std::uint64_t reserve = 0);

  ~FileWriter ();
  FileWriter (const FileWriter &) = delete;
  FileWriter &operator= (const FileWriter &) = delete;

  /** At the position, which moves behind it. */
  Result<void> write (const void *data, std::size_t size);
  /** Moves the position; what is skipped over is zero. */
  void seek (std::uint64_t position) { position_ = position; }
  std::uint64_t position () const { return position_; }
  /** Forgets all that was written, and reserves the space anew. */
  Result<void> restart ();
  /** At the end: the rest of the reserve is free again. */
  Result<void> finish ();

private:
  FileWriter (const std::string &path, int file, std::uint64_t reserve)
      : path_ (path), file_ (file), reserve_ (reserve)
  {
  }
  void pass_on ();

  const std::string path_;
  const int file_;
  const std::uint64_t reserve_;
  std::uint64_t position_ = 0;
  std::uint64_t end_ = 0;
  std::uint64_t passed_ = 0; ///< to the disk, from the beginning
};

} // namespace codedexposure
