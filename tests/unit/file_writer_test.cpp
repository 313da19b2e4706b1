/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "record/file_writer.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>

using namespace codedexposure;
namespace fs = std::filesystem;

namespace
{

/** A file of its own on the disk, where direct writes are possible. */
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
open (const Scratch &scratch, const FileWriter::Options &options)
{
  auto file = FileWriter::open (scratch.file (), options);
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

class Kinds : public testing::TestWithParam<bool>
{
};

} // namespace

TEST_P (Kinds, WriteWhatAMuxerWrites)
{
  for (const std::size_t length : {100u, 70'000u, 5'000'000u, 13'000'000u}) {
    SCOPED_TRACE (length);
    const Scratch scratch;
    const auto file = open (scratch, {.direct = GetParam ()});
    const std::string expected =
        mux (*file, length > 1'000'000 ? 4 : 100, length);
    ASSERT_TRUE (file->finish ());
    EXPECT_TRUE (scratch.content () == expected);
  }
}

TEST_P (Kinds, SkipOverZeros)
{
  const Scratch scratch;
  const auto file = open (scratch, {.direct = GetParam ()});
  file->seek (9'000'000);
  ASSERT_TRUE (file->write ("end", 3));
  ASSERT_TRUE (file->finish ());
  EXPECT_TRUE (scratch.content () == std::string (9'000'000, '\0') + "end");
}

TEST_P (Kinds, FreeWhatTheyReservedAndDidNotUse)
{
  constexpr std::uint64_t kReserve = 30'000'000;
  const Scratch scratch;
  const auto file =
      open (scratch, {.direct = GetParam (), .reserve = kReserve});
  EXPECT_GE (scratch.allocated (), kReserve);
  EXPECT_EQ (scratch.content ().size (), 0u);
  const std::string bytes = noise (100'000);
  ASSERT_TRUE (file->write (bytes.data (), bytes.size ()));
  ASSERT_TRUE (file->finish ());
  EXPECT_TRUE (scratch.content () == bytes);
  EXPECT_LT (scratch.allocated (), kReserve / 10);
}

/* A program that is killed calls no destructor. */
TEST_P (Kinds, HaveAllBytesInTheFileSoon)
{
  const Scratch scratch;
  const auto file = open (scratch, {.direct = GetParam ()});
  const std::string early = noise (10'000);
  ASSERT_TRUE (file->write (early.data (), early.size ()));
  std::string content;
  const auto begin = std::chrono::steady_clock::now ();
  while (content.size () < early.size () &&
         std::chrono::steady_clock::now () - begin < std::chrono::minutes (1)) {
    ASSERT_TRUE (file->write ("+", 1));
    content = scratch.content ();
  }
  EXPECT_TRUE (content.starts_with (early));
  EXPECT_EQ (content.find_first_not_of ('+', early.size ()), content.npos);
}

INSTANTIATE_TEST_SUITE_P (FileWriter, Kinds, testing::Bool (),
    [] (const auto &info) { return info.param ? "Direct" : "Cached"; });

TEST (FileWriter, SaysWhyItCannotWrite)
{
  const auto missing = FileWriter::open ("/nonexistent/file", {});
  ASSERT_FALSE (missing);
  EXPECT_NE (
      missing.error ().message.find ("/nonexistent/file"), std::string::npos);

  const auto full = FileWriter::open ("/dev/full", {.direct = true});
  ASSERT_TRUE (full);
  const auto written = (*full)->write ("x", 1);
  ASSERT_FALSE (written);
  EXPECT_NE (written.error ().message.find ("make room"), std::string::npos);
}

TEST (FileWriter, SaysBeforeItBeginsThatSpaceIsMissing)
{
  const Scratch scratch;
  const auto space = fs::space (fs::path (scratch.file ()).parent_path ());
  const auto file = FileWriter::open (
      scratch.file (), {.direct = true, .reserve = 2 * space.capacity});
  ASSERT_FALSE (file);
  EXPECT_NE (file.error ().message.find ("cannot reserve"), std::string::npos);
}

namespace
{

/** Bytes that this process has passed to files. */
std::uint64_t
passed_bytes ()
{
  std::ifstream counters ("/proc/self/io");
  std::string name;
  for (std::uint64_t count = 0; counters >> name >> count;)
    if (name == "wchar:")
      return count;
  return 0;
}

} // namespace

/* At 25 frames/s, each goes to the disk at once; its block is not full yet. */
TEST (FileWriter, WritesNothingAgain)
{
  const Scratch scratch;
  const auto file = open (scratch, {.direct = true});
  const std::string frame = noise (442'000);
  const std::uint64_t before = passed_bytes ();
  std::uint64_t size_at = 0;
  std::string expected;
  for (int k = 0; k < 8; k++) {
    std::this_thread::sleep_for (std::chrono::milliseconds (55));
    const auto end = file->position ();
    file->seek (size_at);
    ASSERT_TRUE (file->write ("12345678", 8));
    file->seek (std::max<std::uint64_t> (end, 8));
    size_at = file->position ();
    ASSERT_TRUE (file->write (frame.data (), frame.size ()));
  }
  ASSERT_TRUE (file->finish ());
  EXPECT_LT (double (passed_bytes () - before), 1.1 * 8 * 442'000);
  const std::string content = scratch.content ();
  ASSERT_EQ (content.size (), 8 + 8 * frame.size ());
  for (std::size_t k = 0; k < 8; k++) {
    expected = frame;
    if (k < 7)
      expected.replace (0, 8, "12345678");
    EXPECT_TRUE (
        content.substr (8 + k * frame.size (), frame.size ()) == expected)
        << k;
  }
}
