/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Blocks that a demuxer would refuse. */
#include <vector>

#include <gtest/gtest.h>

#include "record/large_blocks.h"

namespace
{

using namespace codedexposure;

constexpr std::size_t kLarge = std::size_t (15) << 20;

std::string
element (const std::string &name, const std::string &content)
{
  std::string length (8, '\0');
  std::size_t size = content.size ();
  for (std::size_t i = 7; i > 0; i--, size >>= 8)
    length[i] = char (size & 0xff);
  length[0] = '\x01';
  return name + length + content;
}

std::string
frame (std::size_t size, char value)
{
  return std::string ("\x81\0\5\x80", 4) + std::string (size, value);
}

std::string
cluster (const std::string &block)
{
  return element ("\x1f\x43\xb6\x75", element ("\xe7", "t") + block);
}

const std::string kBegin = element ("\x1a\x45\xdf\xa3", "head") +
                           "\x18\x53\x80\x67\x01" + std::string (7, '\xff');
const std::string kEnd = element ("\x1c\x53\xbb\x6b", "cues");

/* What a demuxer reads: the contents of all blocks. */
std::vector<std::string>
blocks (const std::string &bytes)
{
  std::vector<std::string> found;
  ebml::Source source = ebml::Source::of (bytes);
  for (std::uint64_t at = 0; at < bytes.size ();) {
    const auto one = source.element_at (at, ebml::kUnlimited);
    if (!one) {
      ADD_FAILURE () << "no element at " << at;
      break;
    }
    const bool holds_others = one->id == ebml::kSegment ||
                              one->id == ebml::kCluster ||
                              one->id == ebml::kBlockGroup;
    EXPECT_TRUE (holds_others || one->end - at <= LargeBlocks::kMost);
    if (one->id == ebml::kSimpleBlock || one->id == ebml::kBlock)
      found.push_back (bytes.substr (one->data, one->end - one->data));
    at = holds_others ? one->data : one->end;
  }
  return found;
}

/* The bytes of @block, in @bytes, or of the frame that it stands for. */
std::string
frame_in (const std::string &block, const std::string &bytes)
{
  const auto hidden = LargeBlocks::frame_of (block.substr (4));
  return hidden ? bytes.substr (hidden->at, hidden->end - hidden->at)
                : block.substr (4);
}

std::string
with_group (const std::string &block, bool duration_first)
{
  const std::string duration = element ("\x9b", "d");
  return cluster (element ("\xa0", (duration_first ? duration : "") +
                                       element ("\xa1", block) +
                                       (duration_first ? "" : duration)));
}

const std::string kStream = kBegin +
                            cluster (element ("\xa3", frame (kLarge, 'a'))) +
                            cluster (element ("\xa3", frame (100, 'b'))) +
                            with_group (frame (kLarge, 'c'), true) +
                            with_group (frame (kLarge, 'd'), false) + kEnd;

void
expect_frames (const std::string &shown)
{
  ASSERT_EQ (shown.size (), kStream.size ());
  const auto found = blocks (shown);
  ASSERT_EQ (found.size (), 4u);
  for (const auto &[i, size, value] : {std::tuple (0u, kLarge, 'a'),
           {1u, std::size_t (100), 'b'}, {2u, kLarge, 'c'}, {3u, kLarge, 'd'}})
    EXPECT_TRUE (frame_in (found[i], kStream) == std::string (size, value))
        << i;
}

TEST (LargeBlocks, AreHiddenInAFile)
{
  LargeBlocks large;
  ebml::Source file = ebml::Source::of (kStream);
  std::string shown = kStream;
  const auto read = [&] (std::uint64_t at, std::uint64_t end) {
    for (const auto &[place, bytes] : large.patches (file, at, end)) {
      ASSERT_TRUE (place >= at && place + bytes.size () <= end);
      shown.replace (place, bytes.size (), bytes);
    }
  };
  /* As a demuxer reads: it goes on where an element that it saw ends. */
  for (std::uint64_t at = 0; at < kStream.size ();) {
    read (at, std::min<std::uint64_t> (at + 300, kStream.size ()));
    ebml::Source seen = ebml::Source::of (shown);
    const auto one = seen.element_at (at, ebml::kUnlimited);
    ASSERT_TRUE (one) << at;
    const bool is_open = one->id == ebml::kSegment || one->id == ebml::kCluster;
    at = is_open ? one->data : one->end;
  }
  expect_frames (shown);
}

TEST (LargeBlocks, AreHiddenInAStream)
{
  std::vector<std::pair<std::uint64_t, std::string>> frames;
  for (const char value : {'a', 'c', 'd'}) {
    const std::string pixels (kLarge, value);
    frames.emplace_back (kStream.find (pixels), pixels);
  }
  for (const std::size_t part :
      {std::size_t (1) << 16, std::size_t (1) << 22, kStream.size ()}) {
    SCOPED_TRACE (part);
    LargeBlocks large;
    std::string shown;
    int kept = 0;
    for (std::size_t at = 0; at < kStream.size (); at += part) {
      const std::string bytes = kStream.substr (at, part);
      if (large.passes (bytes)) {
        shown += bytes;
        continue;
      }
      shown += large.take (bytes);
      for (const auto &[begin, pixels] : frames)
        kept += large.bytes_of ({begin, begin + kLarge}) == pixels ? 1 : 0;
    }
    EXPECT_EQ (kept, 3);
    expect_frames (shown);
  }
}

TEST (LargeBlocks, FewBytesAtATimePassAtOnce)
{
  const std::string bytes =
      kBegin + cluster (element ("\xa3", frame (100, 'b'))) + kEnd;
  LargeBlocks large;
  std::string passed;
  for (const char byte : bytes)
    passed += large.take ({&byte, 1});
  EXPECT_EQ (passed, bytes);
}

TEST (LargeBlocks, AStreamWithoutThemIsNotCopied)
{
  const std::string bytes =
      kBegin + cluster (element ("\xa3", frame (100, 'b'))) + kEnd;
  for (std::size_t part = 1; part < bytes.size (); part++) {
    LargeBlocks large;
    const std::string_view all = bytes;
    /* Nothing but where a header is cut. */
    if (large.passes (all.substr (0, part)))
      EXPECT_TRUE (large.passes (all.substr (part))) << part;
    else
      EXPECT_LT (large.take (all.substr (0, part)).size (), part) << part;
  }
  EXPECT_TRUE (LargeBlocks ().passes (bytes));
  EXPECT_FALSE (LargeBlocks ().passes (kStream));
}

/* After a seek, a stream goes on with another element. */
TEST (LargeBlocks, AStreamGoesOnElsewhere)
{
  const std::string last = with_group (frame (kLarge, 'd'), false) + kEnd;
  const std::uint64_t at = kStream.size () - last.size ();
  LargeBlocks large;
  const std::string before = large.take (kStream.substr (0, 5000));
  EXPECT_EQ (before, kStream.substr (0, before.size ()));
  EXPECT_LT (before.size (), 100u) << "up to the block";
  large.restart (at);
  const auto found = blocks (large.take (last));
  ASSERT_EQ (found.size (), 1u);
  const auto hidden = LargeBlocks::frame_of (found[0].substr (4));
  ASSERT_TRUE (hidden);
  EXPECT_TRUE (large.bytes_of (*hidden) == std::string (kLarge, 'd'));
  EXPECT_TRUE (frame_in (found[0], kStream) == std::string (kLarge, 'd'));
}

/* Laced blocks hold more than one frame; pixels that look like a block are
 * followed by none. */
TEST (LargeBlocks, OthersStayAsTheyAre)
{
  std::string laced = frame (kLarge, 'a');
  laced[3] = '\x02';
  for (const std::string &bytes : {cluster (element ("\xa3", laced)) + kEnd,
           element ("\xa3", frame (kLarge, 'a')) + "pixels"}) {
    LargeBlocks large;
    ebml::Source file = ebml::Source::of (bytes);
    EXPECT_TRUE (large.patches (file, 0, 4096).empty ());
  }
}

} // namespace
