/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "record/file_writer.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <new>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/vfs.h>
#include <unistd.h>

#include "base/try.h"

namespace codedexposure
{

namespace
{

/* All disks of today write multiples of it directly. */
constexpr std::size_t kAlignment = 4096;
constexpr std::size_t kBlock = 4 << 20;

std::size_t
aligned (std::size_t size)
{
  return size & ~(kAlignment - 1);
}

/** A file descriptor. */
class File
{
public:
  explicit File (int number = -1) : number_ (number) {}
  ~File ()
  {
    if (number_ >= 0)
      close (number_);
  }
  File (File &&other) noexcept : number_ (std::exchange (other.number_, -1)) {}
  File &operator= (File &&other) noexcept
  {
    std::swap (number_, other.number_);
    return *this;
  }

  bool is_open () const { return number_ >= 0; }
  int number () const { return number_; }

  /** 0, or errno. */
  int write (const std::byte *data, std::size_t size, std::uint64_t at) const
  {
    while (size > 0) {
      const ssize_t written = pwrite (number_, data, size, off_t (at));
      if (written < 0 && errno == EINTR)
        continue;
      if (written <= 0)
        return written < 0 ? errno : EIO;
      data += written;
      size -= std::size_t (written);
      at += std::uint64_t (written);
    }
    return 0;
  }

private:
  int number_;
};

Error
failure (const std::string &path, int error)
{
  const std::string remedy =
      error == ENOSPC ? "; make room on its disk, or choose another" : "";
  return {"cannot write " + path + ": " + std::strerror (error) + remedy,
      ErrorCode::io};
}

/** What both kinds of file share. */
class OpenFile : public FileWriter
{
public:
  OpenFile (std::string path, File file, bool reserved)
      : path_ (std::move (path)), file_ (std::move (file)), reserved_ (reserved)
  {
  }

protected:
  Result<void> checked (int error) const
  {
    return error == 0 ? Result<void> () : failure (path_, error);
  }
  Result<void> free_reserve (std::uint64_t size)
  {
    if (std::exchange (reserved_, false) &&
        ftruncate (file_.number (), off_t (size)) != 0)
      return failure (path_, errno);
    return {};
  }

  const std::string path_;
  const File file_;

private:
  bool reserved_;
};

/** Through the page cache. */
class CachedFile : public OpenFile
{
public:
  using OpenFile::OpenFile;

  Result<void> write (const void *data, std::size_t size) override
  {
    const int error =
        file_.write (static_cast<const std::byte *> (data), size, position_);
    if (error == 0) {
      position_ += size;
      end_ = std::max (end_, position_);
    }
    return checked (error);
  }
  Result<void> finish () override { return free_reserve (end_); }
  bool is_direct () const override { return false; }

private:
  std::uint64_t end_ = 0;
};

struct FreeAligned {
  void operator() (std::byte *data) const
  {
    ::operator delete (data, std::align_val_t (kAlignment));
  }
};

using Memory = std::unique_ptr<std::byte, FreeAligned>;

/** Bytes of the file from @p at, which is aligned, on. */
struct Block {
  std::uint64_t at = 0;
  std::size_t size = 0;
  Memory data;
  std::size_t on_disk = 0; ///< of them, from the first on
};

/** Past the page cache. */
class DirectFile : public OpenFile
{
public:
  DirectFile (std::string path, File file, File direct, bool reserved)
      : OpenFile (std::move (path), std::move (file), reserved),
        direct_ (std::move (direct)), last_ (new_block (0))
  {
    spare_.reserve (kMostBlocks); // so that the thread needs no memory
    thread_ = std::jthread ([this] (std::stop_token stop) { serve (stop); });
  }

  Result<void> write (const void *data, std::size_t size) override;
  Result<void> finish () override;
  bool is_direct () const override { return true; }

private:
  using Clock = std::chrono::steady_clock;
  static constexpr auto kLatest = std::chrono::milliseconds (50);
  static constexpr std::size_t kMostQueued = 4;
  /** For muxers that go back over frames of 16 bits and 32 megapixels. */
  static constexpr std::uint64_t kMostHeld = 64 << 20;
  static constexpr std::size_t kMostBlocks =
      kMostHeld / kBlock + kMostQueued + 3;

  /** What the thread writes: a block, or a few bytes of one that it has
   * written. */
  struct Job {
    std::optional<Block> block = {};
    std::uint64_t at = 0;
    std::vector<std::byte> bytes = {};
  };

  std::uint64_t end () const { return last_.at + last_.size; }
  Block new_block (std::uint64_t at);
  Result<void> write_at_position (const std::byte *data, std::size_t size);
  Result<void> append (const std::byte *data, std::size_t size);
  Result<void> change (const std::byte *data, std::size_t size);
  Result<void> pass (Job job);
  Result<void> release (std::uint64_t hold);
  Result<void> write_all ();
  int write_direct (const Block &block, std::size_t end);
  int write_job (const Job &job);
  void serve (std::stop_token stop);

  std::mutex mutex_;
  std::condition_variable_any changed_;
  /* Mutex: */
  std::deque<Job> jobs_; ///< the first is being written
  std::vector<Memory> spare_;
  int error_ = 0;

  File direct_;
  std::deque<Block> held_; ///< full, in front of the last
  Block last_;
  std::uint64_t hold_ = 0; ///< bytes that the muxer goes back
  Clock::time_point written_ = Clock::now ();
  std::jthread thread_; ///< last: it uses all of the above
};

Block
DirectFile::new_block (std::uint64_t at)
{
  const std::lock_guard lock (mutex_);
  if (spare_.empty ())
    spare_.emplace_back (static_cast<std::byte *> (
        ::operator new (kBlock, std::align_val_t (kAlignment))));
  Block block{.at = at, .data = std::move (spare_.back ())};
  spare_.pop_back ();
  return block;
}

Result<void>
DirectFile::write (const void *data, std::size_t size)
try {
  static constexpr std::byte kZeros[kAlignment] = {};
  while (position_ > end ())
    RETURN_IF_ERROR (append (
        kZeros, std::size_t (std::min<std::uint64_t> (
                    {kAlignment, position_ - end (), kBlock - last_.size}))));
  RETURN_IF_ERROR (
      write_at_position (static_cast<const std::byte *> (data), size));
  return Clock::now () - written_ < kLatest ? Result<void> () : write_all ();
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

Result<void>
DirectFile::write_at_position (const std::byte *bytes, std::size_t size)
{
  while (size > 0) {
    const std::size_t inside =
        std::size_t (std::min<std::uint64_t> (size, end () - position_));
    const std::size_t part =
        inside > 0 ? inside : std::min (size, kBlock - last_.size);
    RETURN_IF_ERROR (inside > 0 ? change (bytes, part) : append (bytes, part));
    position_ += part;
    bytes += part;
    size -= part;
  }
  return {};
}

Result<void>
DirectFile::append (const std::byte *data, std::size_t size)
{
  std::memcpy (last_.data.get () + last_.size, data, size);
  last_.size += size;
  if (last_.size < kBlock)
    return {};
  held_.push_back (std::exchange (last_, new_block (end ())));
  return release (hold_);
}

/* Bytes at the position, before the end. */
Result<void>
DirectFile::change (const std::byte *data, std::size_t size)
{
  const std::uint64_t held = held_.empty () ? last_.at : held_.front ().at;
  if (position_ < held) {
    const auto early =
        std::size_t (std::min<std::uint64_t> (size, held - position_));
    hold_ = std::max (hold_, std::min (end () - position_, kMostHeld));
    RETURN_IF_ERROR (
        pass ({.at = position_, .bytes = std::vector (data, data + early)}));
  }
  /* Of what is on the disk, only these bytes are written again. */
  const auto change_in = [&] (Block &block) -> Result<void> {
    const auto begin = std::max (position_, block.at);
    const auto stop = std::min (position_ + size, block.at + block.size);
    if (begin >= stop)
      return {};
    const std::byte *from = data + (begin - position_);
    std::memcpy (block.data.get () + (begin - block.at), from,
        std::size_t (stop - begin));
    const auto known = std::min (stop, block.at + block.on_disk);
    if (begin >= known)
      return {};
    return pass (
        {.at = begin, .bytes = std::vector (from, from + (known - begin))});
  };
  for (Block &block : held_)
    RETURN_IF_ERROR (change_in (block));
  return change_in (last_);
}

/** To the thread, when it has room. */
Result<void>
DirectFile::pass (Job job)
{
  std::unique_lock lock (mutex_);
  changed_.wait (
      lock, [this] { return error_ != 0 || jobs_.size () < kMostQueued; });
  if (error_ != 0)
    return failure (path_, error_);
  jobs_.push_back (std::move (job));
  changed_.notify_all ();
  return {};
}

/** Passes all blocks but the last @p hold bytes on. */
Result<void>
DirectFile::release (std::uint64_t hold)
{
  while (!held_.empty () &&
         end () - (held_.front ().at + held_.front ().size) >= hold) {
    Job job{.block = std::move (held_.front ())};
    held_.pop_front ();
    RETURN_IF_ERROR (pass (std::move (job)));
    written_ = Clock::now ();
  }
  return {};
}

/** Also the last block, which stays: more may follow. */
Result<void>
DirectFile::write_all ()
{
  RETURN_IF_ERROR (release (0));
  std::unique_lock lock (mutex_);
  changed_.wait (lock, [this] { return error_ != 0 || jobs_.empty (); });
  if (error_ == 0) {
    const std::size_t whole = aligned (last_.size);
    error_ = write_direct (last_, whole);
    if (error_ == 0)
      error_ = file_.write (
          last_.data.get () + whole, last_.size - whole, last_.at + whole);
    if (error_ == 0)
      last_.on_disk = last_.size;
  }
  written_ = Clock::now ();
  return checked (error_);
}

Result<void>
DirectFile::finish ()
{
  RETURN_IF_ERROR (write_all ());
  return free_reserve (end ());
}

/* What is not on the disk yet, up to @end, which is aligned. */
int
DirectFile::write_direct (const Block &block, std::size_t end)
{
  const std::size_t begin = aligned (block.on_disk);
  if (begin >= end)
    return 0;
  const std::byte *data = block.data.get () + begin;
  const int error = direct_.write (data, end - begin, block.at + begin);
  /* Of a disk with larger sectors. */
  return error == EINVAL ? file_.write (data, end - begin, block.at + begin)
                         : error;
}

int
DirectFile::write_job (const Job &job)
{
  return job.block ? write_direct (*job.block, job.block->size)
                   : file_.write (job.bytes.data (), job.bytes.size (), job.at);
}

void
DirectFile::serve (std::stop_token stop)
{
  std::unique_lock lock (mutex_);
  while (changed_.wait (lock, stop, [this] { return !jobs_.empty (); })) {
    Job &job = jobs_.front ();
    if (error_ == 0) {
      lock.unlock ();
      const int error = write_job (job);
      lock.lock ();
      error_ = error;
    }
    if (job.block)
      spare_.push_back (std::move (job.block->data));
    jobs_.pop_front ();
    changed_.notify_all ();
  }
}

/** The file system of @p file keeps its files in memory. */
bool
is_in_memory (const File &file)
{
  struct statfs system;
  return fstatfs (file.number (), &system) == 0 &&
         (system.f_type == TMPFS_MAGIC || system.f_type == RAMFS_MAGIC);
}

/* A try would fill the disk first. */
bool
has_room (const File &file, std::uint64_t size)
{
  struct statvfs system = {};
  return fstatvfs (file.number (), &system) != 0 ||
         size / system.f_frsize < system.f_bavail;
}

Result<void>
reserve_space (const std::string &path, const File &file, std::uint64_t size)
{
  if (size == 0)
    return {};
  int error = ENOSPC;
  if (has_room (file, size))
    error =
        fallocate (file.number (), FALLOC_FL_KEEP_SIZE, 0, off_t (size)) == 0
            ? 0
            : errno;
  if (error == 0 || error == EOPNOTSUPP || error == ENOSYS)
    return {};
  return Error{"cannot reserve " + std::to_string ((size + 999999) / 1000000) +
                   " MB for " + path + ": " + std::strerror (error) +
                   "; make room on its disk, or record fewer frames",
      ErrorCode::io};
}

} // namespace

Result<std::unique_ptr<FileWriter>>
FileWriter::open (const std::string &path, const Options &options)
try {
  File file (
      ::open (path.c_str (), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (!file.is_open ())
    return failure (path, errno);
  RETURN_IF_ERROR (reserve_space (path, file, options.reserve));
  struct stat status = {};
  if (options.direct && fstat (file.number (), &status) == 0 &&
      S_ISREG (status.st_mode) && !is_in_memory (file)) {
    File direct (::open (path.c_str (), O_WRONLY | O_DIRECT | O_CLOEXEC));
    if (direct.is_open ())
      return std::unique_ptr<FileWriter> (std::make_unique<DirectFile> (
          path, std::move (file), std::move (direct), options.reserve > 0));
  }
  return std::unique_ptr<FileWriter> (std::make_unique<CachedFile> (
      path, std::move (file), options.reserve > 0));
} catch (const std::exception &error) {
  return Error{"cannot write " + path + ": " + error.what ()};
}

} // namespace codedexposure
