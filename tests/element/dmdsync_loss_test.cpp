/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync with frames that are incomplete, packed, in reused memory, or at
 * another rate. */
#include <algorithm>

#include "base/packed_mono.h"
#include "sync_harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

constexpr GstClockTime kMs = GST_MSECOND;

BufferPtr
flat_frame (int level, GstClockTime pts)
{
  return frame_of (draw<std::uint8_t> (kSyncWidth, kSyncHeight,
                       [level] (int, int) { return level; }),
      pts);
}

/* A buffer of a camera's ring, which the camera may overwrite at any time. */
struct Ring {
  std::vector<guint8> bytes =
      std::vector<guint8> (kSyncWidth * kSyncHeight, 77);

  BufferPtr frame ()
  {
    BufferPtr buffer (gst_buffer_new_wrapped_full (GstMemoryFlags (0),
        bytes.data (), bytes.size (), 0, bytes.size (), nullptr, nullptr));
    GST_BUFFER_PTS (buffer.get ()) = 0;
    return buffer;
  }
  void write () { std::fill (bytes.begin (), bytes.end (), guint8 (5)); }
};

int
first_pixel (const BufferPtr &buffer, const CapsPtr &caps)
{
  return image_of<std::uint8_t> (buffer.get (), caps.get ()).at (3, 3);
}

TEST (DmdsyncLoss, AnIncompleteFrameIsCountedSaidAndFlaggedOrDropped)
{
  SyncHarness sync;
  sync.start ();
  sync.send_frames (0, 1);
  BufferPtr flagged = flat_frame (50, 40 * kMs);
  GST_BUFFER_FLAG_SET (flagged.get (), GST_BUFFER_FLAG_CORRUPTED);
  ASSERT_EQ (sync.push (std::move (flagged)), GST_FLOW_OK);
  BufferPtr cut = flat_frame (50, 80 * kMs);
  gst_buffer_set_size (cut.get (), 100);
  ASSERT_EQ (sync.push (std::move (cut)), GST_FLOW_OK);
  sync.send_frames (3, 4);

  EXPECT_FALSE (
      GST_BUFFER_FLAG_IS_SET (sync.pull ().get (), GST_BUFFER_FLAG_CORRUPTED));
  const BufferPtr second = sync.pull ();
  ASSERT_TRUE (second);
  EXPECT_TRUE (
      GST_BUFFER_FLAG_IS_SET (second.get (), GST_BUFFER_FLAG_CORRUPTED));
  const BufferPtr after = sync.pull ();
  ASSERT_TRUE (after);
  EXPECT_EQ (GST_BUFFER_OFFSET (after.get ()), 3u);
  EXPECT_TRUE (GST_BUFFER_FLAG_IS_SET (after.get (), GST_BUFFER_FLAG_DISCONT));
  EXPECT_EQ (sync.counter ("frames-incomplete"), 2u);
  EXPECT_EQ (sync.counter ("frames-lost"), 0u);

  MessagePtr said = sync.element_message ("dmdsync/frame-incomplete");
  EXPECT_EQ (uint64_field (said, "frame"), 1u);
  said = sync.element_message ("dmdsync/frame-incomplete");
  EXPECT_EQ (uint64_field (said, "frame"), 2u);
  EXPECT_EQ (uint64_field (said, "bytes"), 100u);
  said = sync.element_message ("dmdsync/frame-dropped");
  EXPECT_EQ (string_field (said, "reason"), "incomplete");

  const EventPtr gap = sync.pull_event (GST_EVENT_GAP);
  ASSERT_TRUE (gap);
  GstClockTime from = 0;
  GstClockTime length = 0;
  gst_event_parse_gap (gap.get (), &from, &length);
  EXPECT_EQ (from, 80 * kMs);
  EXPECT_EQ (length, 40 * kMs);
  GstGapFlags flags = GstGapFlags (0);
  gst_event_parse_gap_flags (gap.get (), &flags);
  EXPECT_EQ (flags, GST_GAP_FLAG_MISSING_DATA);
}

/* A source without a pool may write into memory that it has handed out. */
TEST (DmdsyncLoss, AFrameStaysWhatItIsWhenItsSourceWritesAgain)
{
  BufferPtr kept, part;
  CapsPtr caps;
  Ring ring;
  {
    SyncHarness sync;
    sync.start ();
    ASSERT_EQ (sync.push (ring.frame ()), GST_FLOW_OK);
    ring.write ();
    kept = sync.pull ();
    ASSERT_TRUE (kept);
    caps = sync.pad_caps ();
    EXPECT_EQ (first_pixel (kept, caps), 77);
    /* A part of it, as from a cropping element. */
    part.reset (
        gst_buffer_copy_region (kept.get (), GST_BUFFER_COPY_MEMORY, 100, 50));
    gst_element_set_state (sync.element (), GST_STATE_NULL);
  }
  /* Also when the element is gone. */
  EXPECT_EQ (first_pixel (kept, caps), 77);
  guint8 byte = 0;
  ASSERT_EQ (gst_buffer_extract (part.get (), 20, &byte, 1), 1u);
  EXPECT_EQ (byte, 77);
}

TEST (DmdsyncLoss, AFrameIsCopiedOnce)
{
  Ring ring;
  SyncHarness first;
  SyncHarness second;
  first.start ();
  second.start ();
  ASSERT_EQ (first.push (ring.frame ()), GST_FLOW_OK);
  BufferPtr frame = first.pull ();
  ASSERT_TRUE (frame);
  GstMemory *memory = gst_buffer_peek_memory (frame.get (), 0);
  ASSERT_EQ (second.push (std::move (frame)), GST_FLOW_OK);
  const BufferPtr out = second.pull ();
  ASSERT_TRUE (out);
  EXPECT_EQ (gst_buffer_peek_memory (out.get (), 0), memory);
}

/** A frame as a camera packs it; aravissrc fills rows up to four bytes. */
BufferPtr
packed_frame (MonoFormat format, const Image<std::uint16_t> &values)
{
  const gsize row = (row_bytes (format, values.width ()) + 3) / 4 * 4;
  BufferPtr packed (gst_buffer_new_and_alloc (row * gsize (values.height ())));
  GstMapInfo map;
  EXPECT_TRUE (gst_buffer_map (packed.get (), &map, GST_MAP_WRITE));
  EXPECT_TRUE (pack_mono (format, values.view (),
      {map.data, int (row), values.height (), std::ptrdiff_t (row)})
                   .ok ());
  gst_buffer_unmap (packed.get (), &map);
  GST_BUFFER_PTS (packed.get ()) = 0;
  return packed;
}

TEST (DmdsyncLoss, PackedPixelsAreUnpackedWithoutAShift)
{
  for (const MonoFormat format :
      {MonoFormat::mono10_packed, MonoFormat::mono12_packed,
          MonoFormat::mono10p, MonoFormat::mono12p, MonoFormat::mono12})
    for (const int width : {64, 66}) {
      SCOPED_TRACE (std::string (mono_format_text (format)) + " " +
                    std::to_string (width));
      SyncHarness sync (
          std::string ("pixel-format=") + mono_format_text (format));
      sync.set_caps (gray_caps (width, kSyncHeight, "25/1", "GRAY16_LE"));
      const int mask = (1 << significant_bits (format)) - 1;
      Image<std::uint16_t> values (width, kSyncHeight);
      for (int y = 0; y < kSyncHeight; y++)
        for (int x = 0; x < width; x++)
          values.at (x, y) = std::uint16_t ((x * 37 + y * 211) & mask);
      ASSERT_EQ (sync.push (packed_frame (format, values)), GST_FLOW_OK);
      const BufferPtr out = sync.pull ();
      ASSERT_TRUE (out);
      const auto caps = sync.pad_caps ();
      const auto image = image_of<std::uint16_t> (out.get (), caps.get ());
      for (int y = 0; y < kSyncHeight; y++)
        for (int x = 0; x < width; x++)
          ASSERT_EQ (image.at (x, y), values.at (x, y)) << x << "," << y;
      EXPECT_EQ (get_frame_meta (out.get ())->bits, significant_bits (format));
    }
}

/* White in 10 or 12 bits is white for the demux, and nothing is brighter. */
TEST (DmdsyncLoss, PackedFramesAreDecodedWithinTheirBits)
{
  for (const MonoFormat format :
      {MonoFormat::mono10_packed, MonoFormat::mono12_packed,
          MonoFormat::mono10p, MonoFormat::mono12p}) {
    SCOPED_TRACE (mono_format_text (format));
    const int white = (1 << significant_bits (format)) - 1;
    const std::string caps =
        gray_caps (kSyncWidth, kSyncHeight, "25/1", "GRAY16_LE");
    SyncHarness sync (std::string ("schedule=staircase:2x2 pixel-format=") +
                      mono_format_text (format));
    sync.set_caps (caps);
    /* All light in slot 2: elements 2 and 3 are white. */
    ASSERT_EQ (sync.push (packed_frame (format,
                   draw<std::uint16_t> (kSyncWidth, kSyncHeight,
                       [white] (int, int y) { return y % 2 ? white : 0; }))),
        GST_FLOW_OK);

    ElementHarness demux ("codedexposure-demux schedule=staircase:2x2 "
                          "method=decode");
    demux.set_caps (caps);
    ASSERT_EQ (demux.push (sync.pull ()), GST_FLOW_OK);
    for (int slot = 0; slot < 4; slot++) {
      SCOPED_TRACE (slot);
      const BufferPtr out = demux.pull ();
      ASSERT_TRUE (out);
      const auto image =
          image_of<std::uint16_t> (out.get (), demux.pad_caps ().get ());
      EXPECT_EQ (image.at (9, 9), slot == 2 ? white : 0);
      const FrameMeta meta = *get_frame_meta (out.get ());
      EXPECT_EQ (meta.bits, significant_bits (format));
      EXPECT_EQ (meta.saturated, guint64 (kSyncWidth * kSyncHeight / 2));
    }
  }
}

TEST (DmdsyncLoss, APixelFormatThatDoesNotFitTheCapsIsAnError)
{
  for (const char *format : {"Mono12p", "Mono14"}) {
    SyncHarness sync (std::string ("pixel-format=") + format);
    sync.start ();
    EXPECT_NE (sync.send (0), GST_FLOW_OK);
    EXPECT_NE (sync.error ().find (format), std::string::npos);
  }
}

TEST (DmdsyncLoss, AnotherRateThanThatOfTheCapsIsSaid)
{
  SyncHarness sync;
  sync.start ();
  for (int k = 0; k < 200; k++)
    ASSERT_EQ (sync.send (GstClockTime (k) * GST_SECOND / 24), GST_FLOW_OK);
  const MessagePtr said = sync.element_message ("dmdsync/frame-rate");
  ASSERT_TRUE (said);
  double measured = 0;
  EXPECT_TRUE (gst_structure_get_double (
      gst_message_get_structure (said.get ()), "measured", &measured));
  EXPECT_NEAR (measured, 24, 0.01);
  EXPECT_NE (sync.warning ().find ("24 a second, the caps say 25/1"),
      std::string::npos);
  EXPECT_FALSE (sync.element_message ("dmdsync/frame-rate"));
}

} // namespace
