/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Files of GStreamer's muxer, made readable for other programs in place. */
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "record/matroska.h"

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

const std::string kTags ("\x12\x54\xc3\x67");

/** A file with a track of that type, and a tag; the header points to the tags.
 */
std::string
file_with (char track_type, const std::string &tag)
{
  const std::string tracks = element ("\x16\x54\xae\x6b",
      element ("\xae", short_element ("\x83", {track_type}) +
                           short_element ("\x53\x6e", "Subtitle\0"s)));
  const std::string clusters = element ("\x1f\x43\xb6\x75", "pictures");
  const std::string tags = element (
      kTags, element ("\x73\x73",
                 element ("\x67\xc8", element ("\x45\xa3", "COMMENTS") +
                                          element ("\x44\x87", tag + '\0'))));
  const auto head = [&] (std::size_t position) {
    std::string at (8, '\0');
    at[6] = char (position >> 8);
    at[7] = char (position & 0xff);
    return element ("\x11\x4d\x9b\x74",
        element ("\x4d\xbb", short_element ("\x53\xab", kTags) +
                                 short_element ("\x53\xac", at)));
  };
  const std::size_t tags_at =
      head (0).size () + tracks.size () + clusters.size ();
  return element ("\x1a\x45\xdf\xa3", "") +
         element (
             "\x18\x53\x80\x67", head (tags_at) + tracks + clusters + tags);
}

std::filesystem::path
file_of (const std::string &content)
{
  const auto path = std::filesystem::temp_directory_path () /
                    ("cexp-" + std::to_string (getpid ()) + ".mkv");
  std::ofstream (path, std::ios::binary) << content;
  return path;
}

Result<RawFormat>
format_of (const std::string &content)
{
  const auto path = file_of (content);
  const auto format = raw_format (path.string ());
  std::filesystem::remove (path);
  return format;
}

/** The file after tidy_matroska (). */
std::string
tidied (const std::string &content)
{
  const auto path = file_of (content);
  EXPECT_TRUE (tidy_matroska (path.string ()).ok ());
  std::ostringstream read;
  read << std::ifstream (path, std::ios::binary).rdbuf ();
  std::filesystem::remove (path);
  return read.str ();
}

constexpr char kText = 0x11, kVideo = 1;

} // namespace

TEST (Matroska, TagsBecomePlain)
{
  const std::string before =
      file_with (kVideo, R"("coded-exposure\=\{\"a\":\"\302\265s\ \\\\\"\}")");
  const std::string after = tidied (before);
  ASSERT_EQ (after.size (), before.size ());
  EXPECT_NE (
      after.find ("coded-exposure={\"a\":\"\xc2\xb5s \\\\\"}\0"s), after.npos);
}

TEST (Matroska, ATextTrackIsNotShownUnasked)
{
  const std::string before = file_with (kText, "plain");
  const std::string after = tidied (before);
  ASSERT_EQ (after.size (), before.size ());
  EXPECT_NE (after.find ("\x83\x81\x11\x88\x81\0\x53\x6e\x86"s + "Frames"),
      after.npos);
}

TEST (Matroska, OtherFilesStayAsTheyAre)
{
  const std::string whole = file_with (kVideo, "plain");
  EXPECT_EQ (tidied (whole), whole);
  EXPECT_EQ (tidied (""), "");
  EXPECT_EQ (tidied ("no Matroska"), "no Matroska");
  const std::string cut =
      file_with (kText, R"("a\=b")").substr (0, whole.size () - 3);
  EXPECT_EQ (tidied (cut), cut);
  /* Done already. */
  const std::string done = tidied (file_with (kText, R"("a\=b")"));
  EXPECT_EQ (tidied (done), done);
}

TEST (Matroska, AnyBitFlipIsHarmless)
{
  const std::string whole = file_with (kText, R"("a\=b")");
  for (std::size_t bit = 0; bit < 8 * whole.size (); bit++) {
    std::string flipped = whole;
    flipped[bit / 8] = char (flipped[bit / 8] ^ 1 << bit % 8);
    EXPECT_EQ (tidied (flipped).size (), whole.size ()) << bit;
  }
}

TEST (Matroska, AMissingFileIsAnError)
{
  const auto missing = tidy_matroska ("/nowhere/at/all.mkv");
  ASSERT_FALSE (missing.ok ());
  EXPECT_EQ (missing.error ().code, ErrorCode::io);
  EXPECT_NE (
      missing.error ().message.find ("/nowhere/at/all.mkv"), std::string::npos);
}

TEST (Matroska, TheHeadOfAFileThatWasCutOffHasTheFormat)
{
  const std::string video = short_element ("\xb0", "\x10\x00"s) +
                            short_element ("\xba", "\x0c\x00"s) +
                            short_element ("\x2e\xb5\x24", "Y1\0\x10"s);
  const std::string tracks = element ("\x16\x54\xae\x6b",
      element ("\xae", short_element ("\x83", {kText})) +
          element ("\xae", short_element ("\x23\xe3\x83", "\x98\x96\x80"s) +
                               element ("\xe0", video)));
  const std::string unfinished =
      element ("\x1a\x45\xdf\xa3", "") +
      "\x18\x53\x80\x67\x01\xff\xff\xff\xff\xff\xff\xff" + tracks +
      "\x1f\x43\xb6\x75\x01\xff\xff\xff\xff\xff\xff\xff";
  const auto format = format_of (unfinished + "pictures");
  ASSERT_TRUE (format) << format.error ().message;
  EXPECT_EQ (format->size, (Extent{4096, 3072}));
  EXPECT_EQ (format->duration, 10'000'000);
  EXPECT_EQ (tidied (unfinished), unfinished);

  EXPECT_FALSE (format_of (""));
  EXPECT_FALSE (format_of ("no Matroska"));
  EXPECT_FALSE (format_of (file_with (kVideo, "plain")));
  for (std::size_t length = 0; length < unfinished.size () - 12; length++)
    EXPECT_FALSE (format_of (unfinished.substr (0, length))) << length;
}
