/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The per-frame track: its lines, the hash of pixels, and which line belongs to
 * which frame. */
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "base/image.h"
#include "record/pixel_hash.h"
#include "record/provenance.h"
#include "record/track.h"
#include "record/track_reader.h"

namespace
{

using namespace codedexposure;

constexpr Nanoseconds kPeriod = 40'000'000;

FrameRecord
full_record ()
{
  FrameRecord record;
  record.frame = 18'446'744'073'709'551'615u;
  record.pts = 80'000'001;
  record.duration = kPeriod;
  record.exposure_start = 79'999'000;
  record.exposure_duration = 39'200'000;
  record.time_uncertainty = 47'000;
  record.locked = false;
  record.slip = -3;
  record.lost_before = 2;
  record.saturated = 17;
  record.pattern = "a <b> & \"c\" 'd' \\ é";
  record.bits = 12;
  record.flags = {"discont", "corrupted"};
  record.hash = 0x0123456789abcdefu;
  return record;
}

TrackLine
full_line ()
{
  StreamSetup setup{*Schedule::parse ("staircase:2x2,active=9.8ms"),
      Mapping (Extent{16, 8}), Extent{16, 8}, FrameRate{30000, 1001}};
  return {.frame = full_record (), .setup = setup};
}

TEST (Track, ALineIsReadAsItWasWritten)
{
  for (const TrackLine &line :
      {full_line (), TrackLine{.frame = FrameRecord ()}, TrackLine{.end = 9}}) {
    const auto read = TrackLine::from_json (line.to_json ());
    ASSERT_TRUE (read) << read.error ().message;
    EXPECT_EQ (*read, line);
  }
}

TEST (Track, ALineIsOneLineWithoutMarkup)
{
  const std::string text = full_line ().to_json ();
  EXPECT_EQ (text.find_first_of ("<&\n"), text.npos) << text;
}

TEST (Track, ALineSurvivesEscapingForPango)
{
  std::string escaped;
  for (const char c : full_line ().to_json ())
    escaped += c == '"'    ? "&quot;"
               : c == '\'' ? "&#39;"
               : c == '>'  ? "&gt;"
                           : std::string (1, c);
  const auto read = TrackLine::from_json (unescape_markup (escaped));
  ASSERT_TRUE (read) << read.error ().message;
  EXPECT_EQ (*read, full_line ());
}

TEST (Track, NoFrameHasMoreThan16Bits)
{
  FrameRecord record;
  record.bits = 99;
  const auto read =
      TrackLine::from_json (TrackLine{.frame = record}.to_json ());
  ASSERT_FALSE (read);
  EXPECT_NE (read.error ().message.find ("bits"), std::string::npos)
      << read.error ().message;
}

TEST (Track, NoTimeIsFartherThan73Years)
{
  FrameRecord record;
  record.exposure_start = kFarthestTime + 1;
  EXPECT_FALSE (TrackLine::from_json (TrackLine{.frame = record}.to_json ()));
  record.exposure_start = -kFarthestTime;
  const std::string line = TrackLine{.frame = record}.to_json ();
  EXPECT_TRUE (TrackLine::from_json (line));

  TrackReader reader;
  EXPECT_FALSE (reader.add (line, kFarthestTime + 1, kPeriod));
  ASSERT_TRUE (reader.add (line, kFarthestTime, kPeriod));
  constexpr Nanoseconds last = std::numeric_limits<Nanoseconds>::max ();
  EXPECT_FALSE (reader.take (last, 0));
  EXPECT_TRUE (reader.take (kFarthestTime, last)->line);
}

/* A damaged line is refused, not misread. */
TEST (Track, EveryFlippedBitIsNoticed)
{
  const std::string text = full_line ().to_json ();
  for (std::size_t bit = 0; bit < 8 * text.size (); bit++) {
    std::string flipped = text;
    flipped[bit / 8] = char (flipped[bit / 8] ^ (1 << bit % 8));
    EXPECT_FALSE (TrackLine::from_json (flipped)) << "bit " << bit;
  }
}

TEST (Track, APartOfALineIsRefused)
{
  const std::string text = full_line ().to_json ();
  for (std::size_t size = 0; size < text.size (); size++)
    EXPECT_FALSE (TrackLine::from_json (text.substr (0, size))) << size;
}

TEST (Track, HashCoversEachPixelAndNoPadding)
{
  Image<std::uint16_t> image (5, 3), padded (8, 3);
  for (int y = 0; y < 3; y++)
    for (int x = 0; x < 8; x++)
      padded.view ().at (x, y) =
          x < 5 ? image.view ().at (x, y) = std::uint16_t (1000 * y + x) : 77;
  const ImageView<const std::uint16_t> cropped =
      padded.view ().block (0, 0, 5, 3);
  const std::uint64_t hash =
      pixel_hash (ImageView<const std::uint16_t> (image.view ()));
  EXPECT_EQ (pixel_hash (cropped), hash);
  for (int y = 0; y < 3; y++)
    for (int x = 0; x < 5; x++) {
      padded.view ().at (x, y) ^= 0x800;
      EXPECT_NE (pixel_hash (cropped), hash) << x << ", " << y;
      padded.view ().at (x, y) ^= 0x800;
    }
}

/* Of the program xxhsum -H3, so that others can check recordings. */
TEST (Track, HashIsXxh3)
{
  Image<std::uint8_t> image (3, 2);
  for (int i = 0; i < 6; i++)
    image.view ().at (i % 3, i / 3) = std::uint8_t ("abcdef"[i]);
  EXPECT_EQ (pixel_hash (ImageView<const std::uint8_t> (image.view ())),
      0xda87bd32d3c47db6u);
}

class Reader : public ::testing::Test
{
protected:
  /** The line of frame @p frame, which is there at @p pts. */
  void add (std::uint64_t frame, Nanoseconds pts)
  {
    FrameRecord record;
    record.frame = frame;
    record.pts = pts;
    ASSERT_TRUE (
        reader.add (TrackLine{.frame = record}.to_json (), pts, kPeriod));
  }
  /** The frame of the line for @p pts: -1 for none, -2 for one that may come.
   */
  std::int64_t take (Nanoseconds pts, Nanoseconds start = 0)
  {
    match = reader.take (pts, start);
    if (!match)
      return -2;
    return match->line ? std::int64_t (match->line->frame->frame) : -1;
  }

  TrackReader reader;
  std::optional<TrackReader::Match> match;
};

TEST_F (Reader, FindsLinesThatComeBeforeOrAfterTheirFrames)
{
  EXPECT_EQ (take (0), -2);
  add (0, 0);
  EXPECT_EQ (take (0), 0);
  add (1, kPeriod);
  add (2, 2 * kPeriod);
  EXPECT_EQ (take (kPeriod), 1);
  EXPECT_EQ (take (2 * kPeriod), 2);
}

TEST_F (Reader, AFrameWithoutALineIsToldFromOneThatIsEarly)
{
  add (1, kPeriod);
  EXPECT_EQ (take (0), -1);
  EXPECT_EQ (take (kPeriod), 1);
  EXPECT_EQ (take (2 * kPeriod), -2);
  reader.end ();
  EXPECT_EQ (take (2 * kPeriod), -1);
}

TEST_F (Reader, AFrameWithoutALineIsNumberedByTheOneAfterIt)
{
  add (7, 7 * kPeriod);
  EXPECT_EQ (reader.number_at (4 * kPeriod), 4u);
  EXPECT_EQ (reader.number_at (7 * kPeriod - 1), 6u);
  EXPECT_EQ (reader.number_at (-2 * kPeriod), 0u);
  EXPECT_FALSE (reader.number_at (7 * kPeriod));
}

TEST_F (Reader, LinesWithoutAFrameAreCounted)
{
  for (int i = 0; i < 6; i++)
    add (std::uint64_t (i), i * kPeriod);
  EXPECT_EQ (take (0), 0);
  EXPECT_EQ (match->skipped, 0u);
  EXPECT_EQ (take (3 * kPeriod), 3);
  EXPECT_EQ (match->skipped, 2u);
  EXPECT_EQ (match->skipped_from, kPeriod);
  EXPECT_EQ (reader.take_rest (0).skipped, 2u);
}

/* Matroska rounds to a millisecond by default; the record has the exact time.
 */
TEST_F (Reader, RoundedTimesStillMatch)
{
  FrameRecord record;
  record.pts = 33'366'666;
  ASSERT_TRUE (reader.add (
      TrackLine{.frame = record}.to_json (), 33'000'000, 33'000'000));
  EXPECT_EQ (take (33'000'000), 0);
  EXPECT_EQ (match->offset, 0);
}

TEST_F (Reader, TimesOfAFileThatWasMovedMoveWithIt)
{
  FrameRecord record;
  record.pts = 0;
  ASSERT_TRUE (
      reader.add (TrackLine{.frame = record}.to_json (), 5 * kPeriod, kPeriod));
  EXPECT_EQ (take (5 * kPeriod), 0);
  EXPECT_EQ (match->offset, 5 * kPeriod);
}

/* As by damage to the time of a cluster, or to the unit of all times. */
TEST_F (Reader, AFrameThatMovedAgainstTheOthersIsMisplaced)
{
  const auto misplaced = [this] (std::uint64_t frame, Nanoseconds pts) {
    FrameRecord record;
    record.frame = frame;
    record.pts = Nanoseconds (frame) * kPeriod;
    EXPECT_TRUE (
        reader.add (TrackLine{.frame = record}.to_json (), pts, kPeriod));
    EXPECT_EQ (take (pts), std::int64_t (frame));
    return match->misplaced;
  };
  constexpr Nanoseconds kLater = 250 * kPeriod;
  EXPECT_FALSE (misplaced (0, kLater));
  EXPECT_FALSE (misplaced (1, kLater + kPeriod + 400'000)) << "rounded";
  EXPECT_TRUE (misplaced (2, kLater + 3 * kPeriod));
  EXPECT_FALSE (misplaced (4, kLater + 4 * kPeriod));
  reader.next_segment ();
  EXPECT_FALSE (misplaced (0, kLater + 5 * kPeriod)) << "the next recording";
  reader.clear ();
  EXPECT_FALSE (misplaced (5, 5 * kPeriod));
  EXPECT_TRUE (misplaced (6, 6 * kPeriod - kPeriod / 4));
}

/* A decoder clips the first frame of a segment to its start. */
TEST_F (Reader, TheFirstFrameOfASegmentMayBeClipped)
{
  for (int i = 0; i < 4; i++)
    add (std::uint64_t (i), i * kPeriod);
  const Nanoseconds start = 2 * kPeriod + 15'000'000;
  EXPECT_EQ (take (start, start), 2);
  EXPECT_EQ (match->skipped, 0u) << "those before the segment are not missed";
  EXPECT_EQ (take (3 * kPeriod + 15'000'000, start), -2)
      << "a later frame at a wrong time has no line";
}

TEST_F (Reader, UnreadableLinesAreRefusedAndMissed)
{
  std::string text = TrackLine{.frame = FrameRecord ()}.to_json ();
  text[3] ^= 1;
  EXPECT_FALSE (reader.add (text, 0, kPeriod));
  add (1, kPeriod);
  EXPECT_EQ (take (0), -1);
}

TEST_F (Reader, MemoryIsBounded)
{
  for (std::size_t i = 0; i < TrackReader::kMaxLines + 10; i++)
    add (i, Nanoseconds (i) * kPeriod);
  EXPECT_EQ (take (0), -1);
  EXPECT_EQ (take (10 * kPeriod), 10);
}

TEST (Provenance, IsReadAsItWasWritten)
{
  const Provenance provenance{full_line ().setup.value (), "decode", 12, 0};
  const auto read = Provenance::from_json (provenance.to_json ());
  ASSERT_TRUE (read) << read.error ().message;
  EXPECT_EQ (*read, provenance);
  EXPECT_FALSE (Provenance::from_json (full_line ().setup->to_json ()));
}

} // namespace
