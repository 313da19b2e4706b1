/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Buffers that do not hold the frame of their caps, in every element that reads
 * pixels: each is refused with the reason, and nothing outside of it is read.
 */
#include <functional>

#include "harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr int kWidth = 30, kHeight = 20;

struct Layout {
  gsize offset = 0;
  gint stride = kWidth;
  guint width = kWidth, height = kHeight;
};

/** @p size bytes at the start of a memory of @p held, with a video meta. */
BufferPtr
buffer_with (gsize size, gsize held, const Layout &layout)
{
  BufferPtr buffer (gst_buffer_new_allocate (nullptr, held, nullptr));
  gst_buffer_memset (buffer.get (), 0, 77, held);
  gst_buffer_set_size (buffer.get (), gssize (size));
  GST_BUFFER_PTS (buffer.get ()) = 0;
  gsize offsets[GST_VIDEO_MAX_PLANES] = {layout.offset};
  gint strides[GST_VIDEO_MAX_PLANES] = {layout.stride};
  gst_buffer_add_video_meta_full (buffer.get (), GST_VIDEO_FRAME_FLAG_NONE,
      GST_VIDEO_FORMAT_GRAY8, layout.width, layout.height, 1, offsets, strides);
  return buffer;
}

struct Case {
  const char *what;
  std::function<BufferPtr ()> make;
};

const Case kCases[] = {
    {"no video meta",
        [] {
          BufferPtr buffer (gst_buffer_new_allocate (nullptr, 639, nullptr));
          GST_BUFFER_PTS (buffer.get ()) = 0;
          return buffer;
        }},
    {"a byte too short", [] { return buffer_with (599, 599, {}); }},
    {"memory beyond the size", [] { return buffer_with (599, 4096, {}); }},
    {"offset", [] { return buffer_with (600, 600, {.offset = 1}); }},
    {"offset beyond all", [] { return buffer_with (600, 600, {~gsize (0)}); }},
    {"stride", [] { return buffer_with (600, 600, {.stride = 31}); }},
    {"rows that overlap",
        [] { return buffer_with (600, 600, {.stride = 29}); }},
    {"negative stride", [] { return buffer_with (600, 600, {.stride = -30}); }},
    {"fewer columns", [] { return buffer_with (600, 600, {.width = 29}); }},
    {"fewer rows", [] { return buffer_with (600, 600, {.height = 19}); }},
};

class ShortBuffers : public ::testing::TestWithParam<const char *>
{
};

TEST_P (ShortBuffers, AreRefusedWithTheReason)
{
  for (const Case &one : kCases) {
    SCOPED_TRACE (one.what);
    ElementHarness h (GetParam ());
    h.set_caps (gray_caps (kWidth, kHeight));
    EXPECT_EQ (h.push (one.make ()), GST_FLOW_ERROR);
    EXPECT_NE (h.error ().find (
                   "bytes cannot hold the 30x20 GRAY8 pixels of its caps"),
        std::string::npos);
    EXPECT_FALSE (h.pull ());
  }
}

INSTANTIATE_TEST_SUITE_P (Elements, ShortBuffers,
    ::testing::Values ("codedexposure-demux schedule=sequential:2x2",
        "codedexposure-fuse schedule=sequential:2x2", "codedexposure-keep",
        "codedexposure-recordmux", "codedexposure-recordmux codec=raw",
        "codedexposure-sim", "codedexposure-view bits=4", "subframestats"));

/* A frame may be in several memories. */
TEST (ShortBuffer, IsNotOneInTwoMemories)
{
  ElementHarness h ("codedexposure-view bits=4");
  h.set_caps (gray_caps (kWidth, kHeight));
  BufferPtr frame = buffer_with (600, 600, {});
  gst_buffer_memset (frame.get (), 0, 3, 600);
  BufferPtr first = buffer_with (600, 600, {});
  gst_buffer_remove_all_memory (first.get ());
  for (const int part : {0, 1}) {
    GstMemory *all = gst_buffer_peek_memory (frame.get (), 0);
    gst_buffer_append_memory (
        first.get (), gst_memory_copy (all, part * 250, part ? 350 : 250));
  }
  ASSERT_EQ (h.push (std::move (first)), GST_FLOW_OK) << h.error ();
  const BufferPtr shown = h.pull ();
  const auto image =
      image_of<std::uint8_t> (shown.get (), h.pad_caps ().get ());
  EXPECT_EQ (image.at (0, 0), 51);
  EXPECT_EQ (image.at (kWidth - 1, kHeight - 1), 51);
}

/* The last row is the first in memory. */
TEST (ShortBuffer, IsNotOneThatIsUpsideDown)
{
  ElementHarness h ("codedexposure-view bits=4");
  h.set_caps (gray_caps (kWidth, kHeight));
  BufferPtr frame =
      buffer_with (600, 600, {.offset = 600 - kWidth, .stride = -kWidth});
  gst_buffer_memset (frame.get (), 0, 0, 600);
  gst_buffer_memset (frame.get (), 600 - kWidth, 15, kWidth);
  ASSERT_EQ (h.push (std::move (frame)), GST_FLOW_OK) << h.error ();
  const BufferPtr shown = h.pull ();
  const auto image =
      image_of<std::uint8_t> (shown.get (), h.pad_caps ().get ());
  EXPECT_EQ (image.at (5, 0), 255);
  EXPECT_EQ (image.at (5, kHeight - 1), 0);
}

} // namespace
