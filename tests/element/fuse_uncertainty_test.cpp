/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-fuse: the pad of the uncertainty. */
#include "fuse_harness.h"

#include "common/meta.h"
#include "common/tag.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

/* What the library gives for the picture @number alone. */
std::vector<Image<std::uint16_t>>
expected_deviations (int number)
{
  auto fuser = Fuser<std::uint8_t>::make (
      schedule_of ("sequential:lattice:4/2"), kWidth, kHeight)
                   .value ();
  std::vector<Image<std::uint8_t>> fused (
      4, Image<std::uint8_t> (kWidth, kHeight));
  std::vector<Image<std::uint16_t>> deviations (
      4, Image<std::uint16_t> (kWidth, kHeight));
  EXPECT_TRUE (fuser.take (picture (number).view ()));
  EXPECT_TRUE (fuser.fuse (views_of (fused), {}, views_of (deviations)));
  return deviations;
}

/* Values of the frames that @harness has got. */
std::vector<Image<std::uint16_t>>
pull_deviations (GstHarness *harness, std::vector<GstClockTime> &times)
{
  std::vector<Image<std::uint16_t>> images;
  while (const BufferPtr buffer{gst_harness_try_pull (harness)}) {
    times.push_back (GST_BUFFER_PTS (buffer.get ()));
    auto &image = images.emplace_back (kWidth, kHeight);
    EXPECT_EQ (
        gst_buffer_get_size (buffer.get ()), gsize (2 * kWidth * kHeight));
    for (int y = 0; y < kHeight; y++)
      gst_buffer_extract (buffer.get (), gsize (2 * kWidth * y),
          image.view ().row (y), 2 * kWidth);
  }
  return images;
}

TEST_F (Fuse, UncertaintyHasSixteenBitsAndTheTimesOfTheFrames)
{
  fuse = std::make_unique<ElementHarness> (
      "codedexposure-fuse schedule=sequential:lattice:4/2");
  GstHarness *pad = fuse->request ("uncertainty");
  fuse->set_caps (gray_caps (kWidth, kHeight, "25/1", "GRAY8"));
  push (1);
  std::vector<GstClockTime> times;
  EXPECT_EQ (pull_deviations (pad, times), expected_deviations (1));
  std::vector<GstClockTime> fused_times;
  for (const BufferPtr &buffer : pull_all ())
    fused_times.push_back (GST_BUFFER_PTS (buffer.get ()));
  EXPECT_EQ (times, fused_times);
  const CapsPtr caps (gst_pad_get_current_caps (pad->sinkpad));
  GstVideoInfo info;
  ASSERT_TRUE (gst_video_info_from_caps (&info, caps.get ()));
  EXPECT_EQ (GST_VIDEO_INFO_FORMAT (&info), GST_VIDEO_FORMAT_GRAY16_LE);
  EXPECT_EQ (info.fps_n, 100);
}

/* Values of up to 65535, also where the camera has 12 bits. */
TEST_F (Fuse, UncertaintyHasSixteenSignificantBits)
{
  fuse = std::make_unique<ElementHarness> (
      "codedexposure-fuse schedule=sequential:lattice:4/2");
  GstHarness *pad = fuse->request ("uncertainty");
  fuse->set_caps (gray_caps (kWidth, kHeight, "25/1", "GRAY16_LE"));
  BufferPtr frame = frame_of (draw<std::uint16_t> (kWidth, kHeight,
                                  [] (int x, int y) { return 40 * (x + y); }),
      0);
  set_frame_meta (frame.get (), {.bits = 12});
  ASSERT_EQ (fuse->push (std::move (frame)), GST_FLOW_OK);
  for (const BufferPtr &buffer : pull_all ())
    EXPECT_EQ (get_frame_meta (buffer.get ())->bits, 12);
  const BufferPtr uncertain (gst_harness_try_pull (pad));
  ASSERT_TRUE (uncertain);
  EXPECT_EQ (get_frame_meta (uncertain.get ())->bits, 0);
}

TEST_F (Fuse, UncertaintyDoesNotChangeTheFrames)
{
  fuse = std::make_unique<ElementHarness> (
      "codedexposure-fuse schedule=sequential:lattice:4/2");
  fuse->request ("uncertainty");
  fuse->set_caps (gray_caps (kWidth, kHeight, "25/1", "GRAY8"));
  push (0);
  push (1);
  EXPECT_EQ (pull_images (), expected ("sequential:lattice:4/2", {0, 1}));
}

/* It begins with the next coded frame, which still has its history. */
TEST_F (Fuse, UncertaintyCanBeRequestedBetweenFrames)
{
  start ();
  push (0);
  GstHarness *pad = fuse->request ("uncertainty");
  push (1);
  std::vector<GstClockTime> times;
  EXPECT_EQ (pull_deviations (pad, times).size (), 4u);
  EXPECT_EQ (times.front (), kPeriod);
  EXPECT_EQ (pull_images (), expected ("sequential:lattice:4/2", {0, 1}));
  const EventPtr segment (
      gst_pad_get_sticky_event (pad->sinkpad, GST_EVENT_SEGMENT, 0));
  EXPECT_TRUE (segment);
}

TEST_F (Fuse, UncertaintySaysInItsProvenanceWhatItIs)
{
  fuse = std::make_unique<ElementHarness> (
      "codedexposure-fuse schedule=sequential:lattice:4/2");
  GstHarness *pad = fuse->request ("uncertainty");
  fuse->set_caps (gray_caps (kWidth, kHeight, "25/1", "GRAY8"));
  push (0);
  const EventPtr event (
      gst_pad_get_sticky_event (pad->sinkpad, GST_EVENT_TAG, 0));
  ASSERT_TRUE (event);
  GstTagList *tags = nullptr;
  gst_event_parse_tag (event.get (), &tags);
  const auto made = provenance_from_tags (tags);
  ASSERT_TRUE (made && *made);
  EXPECT_EQ (made->value ().method, "fuse fast, uncertainty");
}

/* An encoder of 8 bits cannot take it; fused frames still can have 8. */
TEST_F (Fuse, UncertaintyDoesNotRestrictTheCodedFrames)
{
  fuse = std::make_unique<ElementHarness> (
      "codedexposure-fuse schedule=sequential:lattice:4/2");
  fuse->request ("uncertainty");
  fuse->set_caps (gray_caps (kWidth, kHeight, "25/1", "GRAY8"));
  push (0);
  const ObjectPtr<GstPad> sink (
      gst_element_get_static_pad (fuse->element (), "sink"));
  const CapsPtr caps (gst_pad_query_caps (sink.get (), nullptr));
  for (const char *format : {"GRAY8", "GRAY16_LE"})
    EXPECT_TRUE (gst_caps_can_intersect (caps.get (),
        caps_of (gray_caps (kWidth, kHeight, "25/1", format)).get ()))
        << format;
}

TEST_F (Fuse, ThePadOfTheUncertaintyGoesWithItsElement)
{
  fuse = std::make_unique<ElementHarness> (
      "codedexposure-fuse schedule=sequential:lattice:4/2");
  fuse->request ("uncertainty");
  GstPad *pad = nullptr;
  {
    const ObjectPtr<GstPad> found (
        gst_element_get_static_pad (fuse->element (), "uncertainty"));
    ASSERT_TRUE (found);
    pad = found.get ();
    g_object_add_weak_pointer (
        G_OBJECT (pad), reinterpret_cast<gpointer *> (&pad));
  }
  fuse.reset ();
  EXPECT_EQ (pad, nullptr);
}

} // namespace
