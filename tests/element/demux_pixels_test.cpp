/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux: pixel values of the subframes, and saturated pixels of
 * the coded frames. */
#include "demux_schedule.h"

#include "common/messages.h"
#include "common/meta.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

/* --------------------------------------------------------------- pixels -- */

struct PixelCase {
  const char *name;
  const char *schedule;
  const char *method;
  Method in_force;
};

class DemuxPixels : public ::testing::TestWithParam<PixelCase>
{
};

INSTANTIATE_TEST_SUITE_P (Methods, DemuxPixels,
    ::testing::Values (
        PixelCase{"one_hot", "sequential:2x2", "auto", Method::kSelect},
        PixelCase{"lattice", "sequential:lattice:4/2", "auto", Method::kSelect},
        PixelCase{"reordered", "sequential:lattice:8/3,order=bit-reversal",
            "auto", Method::kSelect},
        PixelCase{"phase", "sequential:2x2,phase=1/0", "auto", Method::kSelect},
        PixelCase{"staircase", "staircase:2x2", "auto", Method::kDecode},
        PixelCase{
            "staircase_select", "staircase:2x2", "select", Method::kSelect},
        PixelCase{"staircase_rank", "staircase:3x3", "rank", Method::kRank},
        PixelCase{"diamond", "sequential:diamond:5", "auto", Method::kSelect}),
    [] (const auto &info) { return info.param.name; });

template <typename Pixel>
void
check_pixels (const PixelCase &c, const char *format)
{
  const Image<Pixel> coded = picture<Pixel> (40, 40);
  ElementHarness demux (std::string ("codedexposure-demux schedule=\"") +
                        c.schedule + "\" method=" + c.method);
  demux.set_caps (gray_caps (40, 40, "25/1", format));
  ASSERT_EQ (demux.push (frame_of (coded, 0)), GST_FLOW_OK) << demux.error ();
  EXPECT_EQ (method_in_force (demux), int (c.in_force));
  EXPECT_EQ (
      pull_images<Pixel> (demux), expected (c.schedule, coded, c.in_force));
}

TEST_P (DemuxPixels, EqualTheExtractors)
{
  check_pixels<std::uint8_t> (GetParam (), "GRAY8");
  check_pixels<std::uint16_t> (GetParam (), "GRAY16_LE");
}

TEST (DemuxPixels, SubframeIsTheElementThatIsOpenInItsSlot)
{
  ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
  demux.set_caps (gray_caps (24, 24));
  const auto coded = picture ();
  ASSERT_EQ (demux.push (frame_of (coded, 0)), GST_FLOW_OK);
  const auto subframes = pull_images (demux);
  ASSERT_EQ (subframes.size (), 4u);
  for (int k = 0; k < 4; k++)
    EXPECT_EQ (subframes[std::size_t (k)],
        draw<std::uint8_t> (12, 12, [&] (int x, int y) {
          return coded.at (2 * x + k % 2, 2 * y + k / 2);
        }));
}

TEST (DemuxPixels, GainAndInterpolationReachTheDecoder)
{
  ElementHarness demux (
      "codedexposure-demux schedule=staircase:2x2 gain=1 interpolate=false");
  demux.set_caps (gray_caps (8, 8));
  /* A static scene of value 10 in each slot: elements are 10, 20, 30, 40. */
  const auto coded = draw<std::uint8_t> (
      8, 8, [] (int x, int y) { return 10 * (1 + x % 2 + 2 * (y % 2)); });
  ASSERT_EQ (demux.push (frame_of (coded, 0)), GST_FLOW_OK);
  for (const auto &subframe : pull_images (demux))
    EXPECT_EQ (
        subframe, draw<std::uint8_t> (4, 4, [] (int, int) { return 10; }));
  g_object_set (demux.element (), "gain", 3.0, nullptr);
  ASSERT_EQ (demux.push (frame_of (coded, kPeriod)), GST_FLOW_OK);
  for (const auto &subframe : pull_images (demux))
    EXPECT_EQ (
        subframe, draw<std::uint8_t> (4, 4, [] (int, int) { return 30; }));
}

/* ----------------------------------------------------------- saturation -- */

class DemuxSaturation : public DemuxSchedule
{
protected:
  /* A second without saturation ends the sequence. */
  static constexpr int kCalmFrames = int (GST_SECOND / kPeriod);

  void push_frame (int frame, int saturated)
  {
    auto image = picture ();
    for (int i = 0; i < saturated; i++)
      image.at (i, 3) = 255;
    ASSERT_EQ (demux->push (frame_of (image, GstClockTime (frame) * kPeriod)),
        GST_FLOW_OK);
  }
  std::optional<Saturated> said () { return demux->posted<Saturated> (); }
};

TEST_F (DemuxSaturation, IsSaidWhenAStretchBeginsAndEnds)
{
  start ("schedule=sequential:2x2");
  push_frame (0, 0);
  EXPECT_FALSE (said ());
  push_frame (1, 3);
  push_frame (2, 5);
  push_frame (3, 1);
  const auto begun = said ();
  ASSERT_TRUE (begun);
  EXPECT_TRUE (begun->active);
  EXPECT_EQ (begun->pixels, 3u);
  EXPECT_EQ (begun->from, kPeriod);
  EXPECT_FALSE (said ());

  for (int frame = 4; frame < 3 + kCalmFrames; frame++)
    push_frame (frame, 0);
  EXPECT_FALSE (said ());
  push_frame (3 + kCalmFrames, 0);
  const auto ended = said ();
  ASSERT_TRUE (ended);
  EXPECT_FALSE (ended->active);
  EXPECT_EQ (ended->frames, 3u);
  EXPECT_EQ (ended->pixels, 5u);
  EXPECT_EQ (ended->from, kPeriod);
  EXPECT_EQ (ended->to, 3 * kPeriod);
  EXPECT_EQ (counter_of (demux->element (), "saturated-frames"), 3u);
}

TEST_F (DemuxSaturation, IsOneStretchWhereFramesFlicker)
{
  start ("schedule=sequential:2x2");
  for (int frame = 0; frame < 4 * kCalmFrames; frame++)
    push_frame (frame, frame % kCalmFrames == 0 ? 1 : 0);
  const auto begun = said ();
  ASSERT_TRUE (begun);
  EXPECT_TRUE (begun->active);
  EXPECT_FALSE (said ());
  demux->push_event (gst_event_new_eos ());
  const auto ended = said ();
  ASSERT_TRUE (ended);
  EXPECT_EQ (ended->frames, 4u);
  EXPECT_EQ (ended->to, 3 * kCalmFrames * kPeriod);
}

TEST_F (DemuxSaturation, EosEndsAStretch)
{
  start ("schedule=sequential:2x2");
  push_frame (0, 1);
  ASSERT_TRUE (said ());
  demux->push_event (gst_event_new_eos ());
  const auto ended = said ();
  ASSERT_TRUE (ended);
  EXPECT_FALSE (ended->active);
  EXPECT_EQ (ended->frames, 1u);
}

TEST_F (DemuxSaturation, AFlushEndsAStretch)
{
  start ("schedule=sequential:2x2");
  push_frame (0, 1);
  push_frame (1, 2);
  ASSERT_TRUE (said ());
  demux->push_event (gst_event_new_flush_start ());
  demux->push_event (gst_event_new_flush_stop (TRUE));
  const auto ended = said ();
  ASSERT_TRUE (ended);
  EXPECT_FALSE (ended->active);
  EXPECT_EQ (ended->frames, 2u);
  EXPECT_EQ (ended->pixels, 2u);
  EXPECT_EQ (ended->from, 0u);
  EXPECT_EQ (ended->to, kPeriod);
}

/* A repeated frame has no information on the light. */
TEST_F (DemuxSaturation, FramesThatFillAGapDoNotCount)
{
  start ("schedule=sequential:2x2");
  push_frame (0, 1);
  auto image = picture ();
  image.at (0, 0) = 255;
  BufferPtr filler = frame_of (image, kPeriod);
  GST_BUFFER_FLAG_SET (filler.get (), GST_BUFFER_FLAG_GAP);
  ASSERT_EQ (demux->push (std::move (filler)), GST_FLOW_OK);
  demux->push_event (gst_event_new_eos ());
  ASSERT_TRUE (said ());
  const auto ended = said ();
  ASSERT_TRUE (ended);
  EXPECT_EQ (ended->frames, 1u);
  EXPECT_EQ (ended->to, 0u);
  EXPECT_EQ (counter_of (demux->element (), "saturated-frames"), 1u);
}

TEST_F (DemuxSaturation, IsCountedInTheMetaOfTheSubframes)
{
  start ("schedule=sequential:2x2");
  push_frame (0, 7);
  for (int k = 0; k < 4; k++) {
    const BufferPtr subframe = demux->pull ();
    ASSERT_TRUE (subframe);
    EXPECT_EQ (get_frame_meta (subframe.get ())->saturated, 7u);
  }
}

TEST_F (DemuxSaturation, IsJudgedByTheSignificantBits)
{
  demux = std::make_unique<ElementHarness> (
      "codedexposure-demux schedule=sequential:2x2 bits=12");
  demux->set_caps (gray_caps (24, 24, "25/1", "GRAY16_LE"));
  auto image = draw<std::uint16_t> (24, 24, [] (int, int) { return 4094; });
  ASSERT_EQ (demux->push (frame_of (image, 0)), GST_FLOW_OK);
  EXPECT_FALSE (said ());
  image.at (2, 2) = 4095;
  ASSERT_EQ (demux->push (frame_of (image, kPeriod)), GST_FLOW_OK);
  const auto begun = said ();
  ASSERT_TRUE (begun);
  EXPECT_EQ (begun->pixels, 1u);
}

TEST_F (DemuxSaturation, IsJudgedByTheBitsThatFramesSay)
{
  demux = std::make_unique<ElementHarness> (
      "codedexposure-demux schedule=sequential:2x2");
  demux->set_caps (gray_caps (24, 24, "25/1", "GRAY16_LE"));
  const auto image =
      draw<std::uint16_t> (24, 24, [] (int, int) { return 1023; });
  const int bits[] = {12, 10, 0};
  const guint64 saturated[] = {0, 24 * 24, 0};
  for (int k = 0; k < 3; k++) {
    BufferPtr frame = frame_of (image, GstClockTime (k) * kPeriod);
    set_frame_meta (frame.get (), {.frame = guint64 (k), .bits = bits[k]});
    ASSERT_EQ (demux->push (std::move (frame)), GST_FLOW_OK);
    for (int slot = 0; slot < 4; slot++)
      EXPECT_EQ (
          get_frame_meta (demux->pull ().get ())->saturated, saturated[k])
          << bits[k] << " bits";
  }
}

} // namespace
