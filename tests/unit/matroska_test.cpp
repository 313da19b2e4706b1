/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What a recording says without its pixels. */
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "record/matroska.h"
#include "record/track.h"

namespace
{

using namespace codedexposure;
using namespace std::string_literals;

/** An element of Matroska; its length takes 8 bytes, as from the muxer. */
std::string
element (const std::string &name, const std::string &content)
{
  std::string length ("\x01\0\0\0\0\0\0\0"s);
  for (int i = 0; i < 4; i++)
    length[std::size_t (7 - i)] = char (content.size () >> 8 * i & 0xff);
  return name + length + content;
}

std::string
short_element (const std::string &name, const std::string &content)
{
  return name + char (0x80 | content.size ()) + content;
}

std::filesystem::path
file_of (const std::string &content)
{
  const auto path = std::filesystem::temp_directory_path () /
                    ("cexp-" + std::to_string (getpid ()) + ".mkv");
  std::ofstream (path, std::ios::binary) << content;
  return path;
}

Result<RecordingInfo>
read (const std::string &content)
{
  const auto path = file_of (content);
  auto info = recording_info (path.string ());
  std::filesystem::remove (path);
  return info;
}

constexpr char kText = 0x11, kVideo = 1;

std::string
number (std::uint64_t value)
{
  std::string bytes;
  for (int shift = 56; shift >= 0; shift -= 8)
    bytes += char (value >> shift & 0xff);
  return bytes;
}

/** A recording of raw 16-bit frames with ticks of 1 us, up to its clusters. */
std::string
head (const std::string &segment_size)
{
  const std::string video = short_element ("\xb0", "\x10\x00"s) +
                            short_element ("\xba", "\x0c\x00"s) +
                            short_element ("\x2e\xb5\x24", "Y1\0\x10"s);
  const std::string tracks = element ("\x16\x54\xae\x6b",
      element ("\xae",
          short_element ("\xd7", "\2") + short_element ("\x83", {kText})) +
          element ("\xae", short_element ("\xd7", "\1") +
                               short_element ("\x83", {kVideo}) +
                               short_element ("\x86", "V_UNCOMPRESSED") +
                               short_element ("\x23\xe3\x83", "\x98\x96\x80"s) +
                               element ("\xe0", video)));
  const std::string info =
      element ("\x15\x49\xa9\x66", short_element ("\x2a\xd7\xb1", "\x03\xe8"));
  return element ("\x1a\x45\xdf\xa3", "") + "\x18\x53\x80\x67" + segment_size +
         info + tracks;
}

const std::string kNoSize ("\x01\xff\xff\xff\xff\xff\xff\xff");

/** A frame and its line, at a tick of the file. */
std::string
cluster (std::uint64_t tick, const std::string &line, bool is_open = false)
{
  const std::string content =
      short_element ("\xe7", number (tick)) +
      element ("\xa0", element ("\xa1", "\x82\0\0\0"s + line)) +
      element ("\xa3", "\x81\0\1\x80"s + std::string (64, 'p'));
  return is_open ? "\x1f\x43\xb6\x75" + kNoSize + content
                 : element ("\x1f\x43\xb6\x75", content);
}

} // namespace

TEST (Matroska, AQuotedTagBecomesPlain)
{
  EXPECT_EQ (unquoted_tag (R"("coded-exposure\=\{\"a\":\"\302\265s\ \\\"\}")"),
      "coded-exposure={\"a\":\"\xc2\xb5s \\\"}");
  EXPECT_EQ (unquoted_tag ("plain"), std::nullopt);
  EXPECT_EQ (unquoted_tag (""), std::nullopt);
}

TEST (Matroska, TheHeadOfAFileThatWasCutOffHasTheFormat)
{
  const std::string unfinished = head (kNoSize) + "\x1f\x43\xb6\x75" + kNoSize;
  const auto info = read (unfinished + "pictures");
  ASSERT_TRUE (info) << info.error ().message;
  EXPECT_EQ (info->head.codec, MatroskaHead::Codec::raw);
  EXPECT_EQ (info->head.pixel_bytes, 2);
  EXPECT_EQ (info->head.size, (Extent{4096, 3072}));
  EXPECT_EQ (info->head.duration, 10'000'000);
  EXPECT_EQ (info->head.tick, 1000);
  EXPECT_TRUE (info->is_cut_short);
  EXPECT_TRUE (info->times.empty ());

  for (std::size_t length = 0; length < unfinished.size () - 12; length++)
    EXPECT_FALSE (matroska_head (unfinished.substr (0, length))) << length;
}

TEST (Matroska, TheHeadOfAFileWithoutTicksIsDamaged)
{
  std::string bytes = head (kNoSize) + "\x1f\x43\xb6\x75" + kNoSize;
  const auto scale = bytes.find ("\x2a\xd7\xb1");
  bytes.replace (scale + 4, 2, "\0\0"s);
  const auto info = read (bytes);
  ASSERT_FALSE (info);
  EXPECT_NE (
      info.error ().message.find ("its TimestampScale is 0"), std::string::npos)
      << info.error ().message;
}

TEST (Matroska, FramesAreFoundWithTheirTimesAndTheSetup)
{
  const StreamSetup setup = {*Schedule::parse ("staircase:2x2")};
  const std::string line =
      TrackLine{.frame = FrameRecord (), .setup = setup}.to_json ();
  const std::string clusters = cluster (40'000, "damaged") +
                               cluster (80'000, line) +
                               cluster (120'000, line, true);
  const auto cut = read (head (kNoSize) + clusters);
  ASSERT_TRUE (cut) << cut.error ().message;
  EXPECT_EQ (cut->times,
      (std::vector<Nanoseconds>{40'001'000, 80'001'000, 120'001'000}));
  EXPECT_EQ (cut->setup, setup);
  EXPECT_TRUE (cut->is_cut_short);

  const std::size_t rest = head (kNoSize).size () + clusters.size () -
                           (head (kNoSize).find (kNoSize) + 8);
  const std::string size = "\x01" + number (rest).substr (1);
  const std::string whole = head (size) + clusters;
  EXPECT_FALSE (read (whole)->is_cut_short);
  const auto shorter = read (whole.substr (0, whole.size () - 1));
  EXPECT_TRUE (shorter->is_cut_short);
  EXPECT_EQ (shorter->times.size (), 2u) << "without the part of a frame";
}

TEST (Matroska, AnyBitFlipCanBeRead)
{
  const std::string whole =
      head (kNoSize) + cluster (1, "line") + cluster (2, "line");
  for (std::size_t bit = 0; bit < 8 * whole.size (); bit++) {
    std::string flipped = whole;
    flipped[bit / 8] = char (flipped[bit / 8] ^ 1 << bit % 8);
    const auto info = read (flipped);
    EXPECT_LE (info ? info->times.size () : 0, 2u) << bit;
  }
}

TEST (Matroska, WhatIsNoRecordingIsRefusedByItsName)
{
  EXPECT_NE (read ("no Matroska").error ().message.find ("not a Matroska"),
      std::string::npos);
  EXPECT_FALSE (read (""));
  std::string other = head (kNoSize);
  other.replace (other.find ("V_UNCOMPRESSED"), 14, "V_MPEG4/ISO/AV");
  EXPECT_NE (
      read (other).error ().message.find ("V_MPEG4/ISO/AV"), std::string::npos);
  other.replace (other.find ("V_MPEG4/ISO/AV"), 2, "A_");
  const std::string video_type = short_element ("\x83", {kVideo});
  const std::size_t type = other.find (video_type);
  other.replace (type, video_type.size (), short_element ("\x83", {2}));
  EXPECT_NE (
      read (other).error ().message.find ("has no video"), std::string::npos);
  const auto missing = recording_info ("/nowhere/at/all.mkv");
  EXPECT_EQ (missing.error ().code, ErrorCode::io);
}
