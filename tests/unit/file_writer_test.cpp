/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "record/file_writer.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/magic.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

using namespace codedexposure;
namespace fs = std::filesystem;

namespace
{

/** A file of its own on the disk. */
class Scratch
{
public:
  Scratch ()
  {
    std::string name = "/var/tmp/file_writer_XXXXXX";
    folder_ = mkdtemp (name.data ());
  }
  ~Scratch () { fs::remove_all (folder_); }
  std::string file () const { return folder_ / "file"; }
  std::string content () const
  {
    std::string bytes (fs::file_size (file ()), '\0');
    std::ifstream (file (), std::ios::binary)
        .read (bytes.data (), std::streamsize (bytes.size ()));
    return bytes;
  }
  /** Bytes that the file takes of the disk. */
  std::uint64_t allocated () const
  {
    struct stat status = {};
    stat (file ().c_str (), &status);
    return std::uint64_t (status.st_blocks) * 512;
  }

private:
  fs::path folder_;
};

std::string
noise (std::size_t size)
{
  static std::mt19937_64 random (7);
  std::vector<std::uint64_t> numbers (size / 8 + 1);
  std::ranges::generate (numbers, std::ref (random));
  std::string bytes (size, '\0');
  std::memcpy (bytes.data (), numbers.data (), size);
  return bytes;
}

std::unique_ptr<FileWriter>
open (const Scratch &scratch, std::uint64_t reserve = 0)
{
  auto file = FileWriter::open (scratch.file (), reserve);
  EXPECT_TRUE (file) << file.error ().message;
  return *std::move (file);
}

/** Writes as a muxer does: for each of @p frames a size, which is zero at
 * first, and @p length bytes; then the size. At last the head. */
std::string
mux (FileWriter &file, int frames, std::size_t length)
{
  std::string expected;
  const auto put = [&] (const std::string &bytes) {
    const auto at = std::size_t (file.position ());
    expected.resize (std::max (expected.size (), at + bytes.size ()));
    expected.replace (at, bytes.size (), bytes);
    ASSERT_TRUE (file.write (bytes.data (), bytes.size ()));
  };
  put (noise (333));
  for (int k = 0; k < frames; k++) {
    const auto size_at = file.position ();
    put (std::string (8, '\0'));
    put (noise (length + std::size_t (k)));
    const auto end = file.position ();
    file.seek (size_at);
    put (noise (8));
    file.seek (end);
  }
  file.seek (100);
  put (noise (50));
  return expected;
}

/** Bytes of @p path that the page cache holds. */
std::uint64_t
bytes_in_memory (const std::string &path)
{
  const std::uint64_t size = fs::file_size (path);
  const int file = ::open (path.c_str (), O_RDONLY);
  void *mapped = mmap (nullptr, size, PROT_READ, MAP_SHARED, file, 0);
  const auto page = std::uint64_t (sysconf (_SC_PAGESIZE));
  std::vector<unsigned char> pages (size / page + 1);
  EXPECT_EQ (mincore (mapped, size, pages.data ()), 0);
  munmap (mapped, size);
  close (file);
  return page * std::uint64_t (std::ranges::count_if (
                    pages, [] (unsigned char one) { return one & 1; }));
}

} // namespace

TEST (FileWriter, WritesWhatAMuxerWrites)
{
  for (const std::size_t length : {100u, 70'000u, 5'000'000u, 13'000'000u}) {
    SCOPED_TRACE (length);
    const Scratch scratch;
    const auto file = open (scratch);
    const std::string expected =
        mux (*file, length > 1'000'000 ? 4 : 100, length);
    ASSERT_TRUE (file->finish ());
    EXPECT_TRUE (scratch.content () == expected);
  }
}

TEST (FileWriter, SkipsOverZeros)
{
  const Scratch scratch;
  const auto file = open (scratch);
  file->seek (9'000'000);
  ASSERT_TRUE (file->write ("end", 3));
  ASSERT_TRUE (file->finish ());
  EXPECT_TRUE (scratch.content () == std::string (9'000'000, '\0') + "end");
}

TEST (FileWriter, FreesWhatItReservedAndDidNotUse)
{
  constexpr std::uint64_t kReserve = 30'000'000;
  const Scratch scratch;
  const auto file = open (scratch, kReserve);
  EXPECT_GE (scratch.allocated (), kReserve);
  EXPECT_EQ (scratch.content ().size (), 0u);
  const std::string bytes = noise (100'000);
  ASSERT_TRUE (file->write (bytes.data (), bytes.size ()));
  ASSERT_TRUE (file->finish ());
  EXPECT_TRUE (scratch.content () == bytes);
  EXPECT_LT (scratch.allocated (), kReserve / 10);
}

TEST (FileWriter, BeginsAnewWithAnEmptyFileAndItsReserve)
{
  constexpr std::uint64_t kReserve = 30'000'000;
  const Scratch scratch;
  const auto file = open (scratch, kReserve);
  const std::string bytes = noise (100'000), others = noise (1000);
  ASSERT_TRUE (file->write (bytes.data (), bytes.size ()));
  ASSERT_TRUE (file->restart ());
  EXPECT_EQ (scratch.content ().size (), 0u);
  EXPECT_GE (scratch.allocated (), kReserve);
  ASSERT_TRUE (file->write (others.data (), others.size ()));
  ASSERT_TRUE (file->finish ());
  EXPECT_TRUE (scratch.content () == others);
}

/* A program that is killed calls no destructor. */
TEST (FileWriter, HasAllBytesInTheFileAtOnce)
{
  const Scratch scratch;
  const auto file = open (scratch);
  const std::string bytes = noise (10'000);
  ASSERT_TRUE (file->write (bytes.data (), bytes.size ()));
  EXPECT_TRUE (scratch.content () == bytes);
}

TEST (FileWriter, DoesNotFillThePageCache)
{
  constexpr std::uint64_t kLength = 120'000'000;
  const Scratch scratch;
  struct statfs system = {};
  statfs (fs::path (scratch.file ()).parent_path ().c_str (), &system);
  if (system.f_type == TMPFS_MAGIC)
    GTEST_SKIP () << "these files stay in memory";
  const auto file = open (scratch);
  const std::string bytes = noise (1'000'000);
  while (file->position () < kLength)
    ASSERT_TRUE (file->write (bytes.data (), bytes.size ()));
  EXPECT_LT (bytes_in_memory (scratch.file ()), kLength / 2);
}

TEST (FileWriter, SaysWhyItCannotWrite)
{
  const auto missing = FileWriter::open ("/nonexistent/file");
  ASSERT_FALSE (missing);
  EXPECT_NE (
      missing.error ().message.find ("/nonexistent/file"), std::string::npos);

  const auto full = FileWriter::open ("/dev/full");
  ASSERT_TRUE (full);
  const auto written = (*full)->write ("x", 1);
  ASSERT_FALSE (written);
  EXPECT_NE (written.error ().message.find ("make room"), std::string::npos);
}

TEST (FileWriter, SaysBeforeItBeginsThatSpaceIsMissing)
{
  const Scratch scratch;
  const auto space = fs::space (fs::path (scratch.file ()).parent_path ());
  const auto file = FileWriter::open (scratch.file (), 2 * space.capacity);
  ASSERT_FALSE (file);
  EXPECT_NE (file.error ().message.find ("cannot reserve"), std::string::npos);
}
