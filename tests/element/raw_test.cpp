/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-matroskamux and codedexposure-rawdec. */
#include "harness.h"
#include "pipeline.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr int kWidth = 7, kHeight = 3;

} // namespace

TEST (RawDecoder, PassesFramesWhoseFormatTheDemuxerKnows)
{
  ElementHarness h ("codedexposure-rawdec");
  const std::string caps =
      gray_caps (kWidth, kHeight, "30000/1001", "GRAY16_LE");
  h.set_caps (caps);
  const auto picture = draw<std::uint16_t> (
      kWidth, kHeight, [] (int x, int y) { return 4000 * x + y; });
  for (const GstClockTime pts : {GST_SECOND, 2 * GST_SECOND}) {
    EXPECT_EQ (h.push (frame_of (picture, pts)), GST_FLOW_OK);
    const BufferPtr out = h.pull ();
    EXPECT_TRUE (same_caps (h.pad_caps ().get (), caps));
    EXPECT_EQ (GST_BUFFER_PTS (out.get ()), pts);
    const auto image =
        image_of<std::uint16_t> (out.get (), h.pad_caps ().get ());
    for (int y = 0; y < kHeight; y++)
      for (int x = 0; x < kWidth; x++)
        EXPECT_EQ (image.at (x, y), picture.at (x, y));
  }
}

/* A live muxer does not wait for frames, and writes their lines before them. */
TEST (MatroskaMux, WaitsForLiveFrames)
{
  Pipeline pipeline ("videotestsrc is-live=true num-buffers=3 ! " +
                     gray_caps (kWidth, kHeight, "100/1", "GRAY8") +
                     " ! codedexposure-matroskamux name=mux ! fakesink");
  EXPECT_EQ (pipeline.play (), "");
  const QueryPtr query (gst_query_new_latency ());
  ASSERT_TRUE (
      gst_pad_query (pipeline.pad ("mux", "src").get (), query.get ()));
  gboolean live = TRUE;
  gst_query_parse_latency (query.get (), &live, nullptr, nullptr);
  EXPECT_FALSE (live);
}
