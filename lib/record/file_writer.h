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
 * A direct file bypasses the page cache: its bytes are collected in aligned
 * blocks, which a thread of its own writes. That takes a quarter of the
 * processor time, and no memory. Blocks stay in memory for as long as the
 * muxer went back before. When write () is called 50 ms or more after the last
 * bytes went to the file, all go there, so a program that is killed leaves all
 * but the last frames. File systems in memory have no direct files; there, as
 * without the option, write () writes at once.
 *
 * For one thread.
 */
class FileWriter
{
public:
  struct Options {
    bool direct = false;       ///< where the file system can
    std::uint64_t reserve = 0; ///< bytes to allocate before anything is written
  };

  /** Replaces the content of @p path. An error if it cannot be written, or if
   * there is not enough space for the reserve. */
  static Result<std::unique_ptr<FileWriter>> open (
      const std::string &path, const Options &options);

  virtual ~FileWriter () = default;

  /** At the position, which moves behind it. The error may be of an earlier
   * call. */
  virtual Result<void> write (const void *data, std::size_t size) = 0;
  /** Moves the position; what is skipped over is zero. */
  void seek (std::uint64_t position) { position_ = position; }
  std::uint64_t position () const { return position_; }
  /** At the end: all bytes are in the file, and the rest of the reserve is free
   * again. */
  virtual Result<void> finish () = 0;
  virtual bool is_direct () const = 0;

protected:
  std::uint64_t position_ = 0;
};

} // namespace codedexposure
