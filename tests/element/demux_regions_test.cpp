/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux: schedules with regions, a pad for each. */
#include "harness.h"

#include <cmath>

#include "bench/bench.h"
#include "common/meta.h"
#include "common/tag.h"
#include "pipeline.h"
#include "schedule_tags.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

/* n = 4 in the background, 8 at (8, 4), 2 at (32, 12). */
constexpr char kSchedule[] = "sequential:2x2,region=16x8+8+4:sequential:4x2,"
                             "region=8x8+32+12:sequential:2x1";
constexpr int kWidth = 48, kHeight = 24;

std::string
line (const std::string &more = "")
{
  return "codedexposure-demux schedule=" + std::string (kSchedule) + " " + more;
}

int
pixel (int x, int y)
{
  return (7 * x + 31 * y) % 127 + 1;
}

BufferPtr
coded_frame (GstClockTime pts)
{
  return frame_of (draw<std::uint8_t> (kWidth, kHeight, pixel), pts);
}

ObjectPtr<GstPad>
request (ElementHarness &demux, const char *name)
{
  return ObjectPtr<GstPad> (
      gst_element_request_pad_simple (demux.element (), name));
}

TEST (DemuxRegions, HaveASizeARateAndTimesOfTheirOwn)
{
  for (const FrameRate rate : {FrameRate{25, 1}, FrameRate{30000, 1001}}) {
    const auto fps = [&] (int n) {
      return std::to_string (rate.num * n) + "/" + std::to_string (rate.den);
    };
    SCOPED_TRACE (fps (1));
    ElementHarness demux (line ());
    demux.request ("region_0");
    demux.request ("region_1");
    demux.set_caps (gray_caps (kWidth, kHeight, fps (1)));
    for (int f = 0; f < 3; f++)
      ASSERT_EQ (demux.push (coded_frame (GstClockTime (rate.time_of (f)))),
          GST_FLOW_OK);

    const struct {
      const char *pad;
      int n, width, height;
    } parts[] = {{"", 4, 24, 12}, {"region_0", 8, 4, 4}, {"region_1", 2, 4, 8}};
    for (const auto &part : parts) {
      SCOPED_TRACE (part.pad);
      const GstVideoInfo info = info_of (demux.pad_caps (part.pad).get ());
      EXPECT_EQ (info.width, part.width);
      EXPECT_EQ (info.height, part.height);
      EXPECT_EQ (info.par_n, part.n == 4 ? 1 : 2);
      EXPECT_EQ (info.par_d, 1);
      EXPECT_EQ (gint64 (info.fps_n) * rate.den,
          gint64 (rate.num) * part.n * info.fps_d);
      for (int i = 0; i < 3 * part.n; i++) {
        const BufferPtr buffer = demux.pull (part.pad);
        ASSERT_TRUE (buffer) << i;
        const int f = i / part.n, k = i % part.n;
        const auto at = [&] (int slot) {
          return GstClockTime (
              rate.time_of (f) + rate.time_of (0, slot, part.n));
        };
        EXPECT_EQ (GST_BUFFER_PTS (buffer.get ()), at (k));
        EXPECT_EQ (GST_BUFFER_DURATION (buffer.get ()), at (k + 1) - at (k));
        EXPECT_EQ (GST_BUFFER_OFFSET (buffer.get ()), guint64 (i));
        const auto meta = get_frame_meta (buffer.get ());
        ASSERT_TRUE (meta);
        EXPECT_EQ (meta->frame, guint64 (f));
        EXPECT_EQ (meta->subframe, k);
      }
      EXPECT_FALSE (demux.pull (part.pad));
    }
  }
}

TEST (DemuxRegions, LightLastsForAllSlotsThatAMaskIsHeld)
{
  ElementHarness demux ("codedexposure-demux "
                        "schedule=sequential:2x2,active=4ms,switching=1ms,"
                        "region=16x8+8+4:sequential:4x2");
  demux.request ("region_0");
  demux.set_caps (gray_caps (kWidth, kHeight));
  ASSERT_EQ (demux.push (coded_frame (0)), GST_FLOW_OK);
  /* 8 slots of 5 ms; the background shows each of its masks for 2. */
  for (const auto &[pad, light, step] :
      {std::tuple ("", 9, 10), std::tuple ("region_0", 4, 5)}) {
    for (int k = 0; const BufferPtr buffer = demux.pull (pad); k++) {
      const auto meta = get_frame_meta (buffer.get ());
      ASSERT_TRUE (meta);
      EXPECT_EQ (meta->exposure_start, k * step * GST_MSECOND) << pad;
      EXPECT_EQ (meta->exposure_duration, light * GST_MSECOND) << pad;
    }
  }
}

TEST (DemuxRegions, GetTheirOwnPixelsAndLeaveBlackBehind)
{
  ElementHarness demux (line ("method=select"));
  demux.request ("region_0");
  demux.request ("region_1");
  demux.request ("subframe_3");
  demux.set_caps (gray_caps (kWidth, kHeight));
  ASSERT_EQ (demux.push (coded_frame (0)), GST_FLOW_OK);

  const auto wide = pull_images (demux, "region_0");
  ASSERT_EQ (wide.size (), 8u);
  for (int k = 0; k < 8; k++)
    EXPECT_EQ (
        wide[std::size_t (k)], draw<std::uint8_t> (4, 4, [&] (int x, int y) {
          return pixel (8 + 4 * x + k % 4, 4 + 2 * y + k / 4);
        }));
  const auto narrow = pull_images (demux, "region_1");
  ASSERT_EQ (narrow.size (), 2u);
  for (int k = 0; k < 2; k++)
    EXPECT_EQ (narrow[std::size_t (k)],
        draw<std::uint8_t> (4, 8,
            [&] (int x, int y) { return pixel (32 + 2 * x + k, 12 + y); }));

  const auto background = [] (int k) {
    return draw<std::uint8_t> (24, 12, [k] (int x, int y) {
      const bool covered =
          Rect{4, 2, 8, 4}.holds (x, y) || Rect{16, 6, 4, 4}.holds (x, y);
      return covered ? 0 : pixel (2 * x + k % 2, 2 * y + k / 2);
    });
  };
  const auto all = pull_images (demux);
  ASSERT_EQ (all.size (), 4u);
  for (int k = 0; k < 4; k++)
    EXPECT_EQ (all[std::size_t (k)], background (k));
  const auto one = pull_images (demux, "subframe_3");
  ASSERT_EQ (one.size (), 1u);
  EXPECT_EQ (one[0], background (3));
}

/* Slots of the region are half as long as those of the gain. */
TEST (DemuxRegions, AGainKeepsPartsAlike)
{
  ElementHarness demux (line ("method=decode gain=1"));
  demux.request ("region_0");
  demux.set_caps (gray_caps (kWidth, kHeight));
  ASSERT_EQ (demux.push (coded_frame (0)), GST_FLOW_OK);
  EXPECT_EQ (pull_images (demux)[0].at (0, 0), pixel (0, 0));
  EXPECT_EQ (pull_images (demux, "region_0")[0].at (0, 0), 2 * pixel (8, 4));
}

/* The bench, the tag, and brightness that does not depend on the region. */
TEST (DemuxRegions, ComeOutOfTheBenchAlikeInLight)
{
  Pipeline pipeline (
      "videotestsrc pattern=solid-color foreground-color=0xff969696 "
      "num-buffers=32 ! "
      "video/x-raw,format=GRAY8,width=48,height=24,framerate=200/1 ! "
      "codedexposure-sim schedule=" +
      std::string (kSchedule) +
      " ! codedexposure-demux name=demux ! queue ! fakesink "
      "demux.region_0 ! queue ! fakesink demux.region_1 ! queue ! fakesink");
  struct Seen {
    int buffers = 0;
    std::uint8_t corner = 0;
  };
  std::map<std::string, Seen> seen;
  for (const char *name : {"src", "region_0", "region_1"})
    gst_pad_add_probe (
        pipeline.pad ("demux", name).get (), GST_PAD_PROBE_TYPE_BUFFER,
        [] (GstPad *, GstPadProbeInfo *info, gpointer data) {
          auto *pad = static_cast<Seen *> (data);
          pad->buffers++;
          gst_buffer_extract (
              GST_PAD_PROBE_INFO_BUFFER (info), 0, &pad->corner, 1);
          return GST_PAD_PROBE_OK;
        },
        &seen[name], nullptr);
  ASSERT_EQ (pipeline.play (), "");
  EXPECT_EQ (seen["src"].buffers, 16);
  EXPECT_EQ (seen["region_0"].buffers, 32);
  EXPECT_EQ (seen["region_1"].buffers, 8);
  /* n = 2 has the most light and its white; rounding grows with the gain. */
  const int value = seen["region_1"].corner;
  EXPECT_GT (value, 120);
  EXPECT_NEAR (seen["src"].corner, value, 2);
  EXPECT_NEAR (seen["region_0"].corner, value, 4);
}

TEST (DemuxRegions, AreServedInTheOrderOfTime)
{
  ElementHarness demux (line ());
  demux.request ("region_1");
  demux.request ("region_0");
  std::vector<std::pair<GstClockTime, std::string>> order;
  for (const char *name : {"src", "region_0", "region_1"}) {
    const ObjectPtr<GstPad> pad (
        gst_element_get_static_pad (demux.element (), name));
    gst_pad_add_probe (
        pad.get (), GST_PAD_PROBE_TYPE_BUFFER,
        [] (GstPad *from, GstPadProbeInfo *info, gpointer data) {
          static_cast<decltype (order) *> (data)->emplace_back (
              GST_BUFFER_PTS (GST_PAD_PROBE_INFO_BUFFER (info)) / GST_MSECOND,
              GST_PAD_NAME (from));
          return GST_PAD_PROBE_OK;
        },
        &order, nullptr);
  }
  demux.set_caps (gray_caps (kWidth, kHeight));
  ASSERT_EQ (demux.push (coded_frame (0)), GST_FLOW_OK);
  const decltype (order) expected = {{0, "src"}, {0, "region_0"},
      {0, "region_1"}, {5, "region_0"}, {10, "src"}, {10, "region_0"},
      {15, "region_0"}, {20, "src"}, {20, "region_0"}, {20, "region_1"},
      {25, "region_0"}, {30, "src"}, {30, "region_0"}, {35, "region_0"}};
  EXPECT_EQ (order, expected);
}

TEST (DemuxRegions, PadsThatNoRegionStandsBehindAreRefused)
{
  for (const char *schedule : {"sequential:2x2", kSchedule}) {
    ElementHarness demux (
        "codedexposure-demux schedule=" + std::string (schedule));
    const ObjectPtr<GstPad> pad = request (demux, "region_2");
    ASSERT_TRUE (pad); // the schedule is not known yet
    demux.set_caps (gray_caps (kWidth, kHeight));
    EXPECT_EQ (demux.push (coded_frame (0)), GST_FLOW_NOT_NEGOTIATED);
    const std::string error = demux.error ();
    EXPECT_NE (error.find ("Pad region_2 was requested"), std::string::npos)
        << error;
    EXPECT_NE (error.find (schedule == kSchedule ? "region_0 to region_1"
                                                 : "has no regions"),
        std::string::npos)
        << error;
  }
  ElementHarness demux (line ());
  EXPECT_TRUE (request (demux, "region_63"));
  EXPECT_FALSE (request (demux, "region_64"));
  EXPECT_NE (demux.warning ().find ("region_63"), std::string::npos);
  EXPECT_FALSE (request (demux, "region_-1"));
  const ObjectPtr<GstPad> lowest = request (demux, "region_%u");
  ASSERT_TRUE (lowest);
  EXPECT_STREQ (GST_PAD_NAME (lowest.get ()), "region_0");
}

TEST (DemuxRegions, APadThatComesLateIsToldEverything)
{
  ElementHarness demux (line ());
  demux.push_event (gst_event_new_stream_start ("stream"));
  demux.set_caps (gray_caps (kWidth, kHeight));
  ASSERT_EQ (demux.push (coded_frame (0)), GST_FLOW_OK);
  demux.request ("region_1");
  ASSERT_EQ (demux.push (coded_frame (40 * GST_MSECOND)), GST_FLOW_OK);
  const EventPtr start = demux.pull_event (GST_EVENT_STREAM_START, "region_1");
  ASSERT_TRUE (start);
  const gchar *id = nullptr;
  gst_event_parse_stream_start (start.get (), &id);
  EXPECT_STREQ (id, "stream/region_1");
  ASSERT_TRUE (demux.pull_event (GST_EVENT_CAPS, "region_1"));
  ASSERT_TRUE (demux.pull_event (GST_EVENT_SEGMENT, "region_1"));
  const BufferPtr first = demux.pull ("region_1");
  ASSERT_TRUE (first);
  EXPECT_EQ (GST_BUFFER_PTS (first.get ()), 40 * GST_MSECOND);
  EXPECT_TRUE (GST_BUFFER_IS_DISCONT (first.get ()));
  demux.release ("region_1");
  EXPECT_EQ (demux.push (coded_frame (80 * GST_MSECOND)), GST_FLOW_OK);
}

TEST (DemuxRegions, FollowAScheduleThatComesLater)
{
  ElementHarness demux ("codedexposure-demux");
  demux.request ("region_0");
  demux.push_event (gst_event_new_stream_start ("stream"));
  demux.set_caps (gray_caps (kWidth, kHeight));
  const auto schedule = Schedule::from_preset (kSchedule);
  ASSERT_TRUE (schedule.ok ());
  demux.push_event (schedule_to_event (*schedule));
  ASSERT_EQ (demux.push (coded_frame (0)), GST_FLOW_OK);
  EXPECT_EQ (pull_images (demux, "region_0").size (), 8u);
  EXPECT_EQ (text_property (demux.element (), "schedule-in-force"), kSchedule);

  /* The same region with another code: its pad renegotiates. */
  g_object_set (demux.element (), "schedule",
      "sequential:2x2,region=16x8+8+4:sequential:2x2", nullptr);
  ASSERT_EQ (demux.push (coded_frame (40 * GST_MSECOND)), GST_FLOW_OK);
  const auto images = pull_images (demux, "region_0");
  ASSERT_EQ (images.size (), 4u);
  EXPECT_EQ (images[0].width (), 8);
}

TEST (DemuxRegions, FlushAndEndReachThem)
{
  ElementHarness demux (line ());
  demux.request ("region_0");
  demux.set_caps (gray_caps (kWidth, kHeight));
  ASSERT_EQ (demux.push (coded_frame (0)), GST_FLOW_OK);
  while (demux.pull ("region_0")) {
  }
  demux.push_event (gst_event_new_flush_start ());
  demux.push_event (gst_event_new_flush_stop (TRUE));
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  demux.push_event (gst_event_new_segment (&segment));
  ASSERT_EQ (demux.push (coded_frame (GST_SECOND)), GST_FLOW_OK);
  const BufferPtr first = demux.pull ("region_0");
  ASSERT_TRUE (first);
  EXPECT_TRUE (GST_BUFFER_IS_DISCONT (first.get ()));
  demux.push_event (gst_event_new_eos ());
  EXPECT_TRUE (demux.pull_event (GST_EVENT_EOS, "region_0"));
}

TEST (DemuxRegions, BindTheRateAndTheirSizeOnly)
{
  ElementHarness demux (line ());
  const ObjectPtr<GstPad> pad = request (demux, "region_0");
  demux.set_caps (gray_caps (kWidth, kHeight));
  const CapsPtr caps (gst_pad_query_caps (pad.get (), nullptr));
  EXPECT_TRUE (gst_caps_can_intersect (
      caps.get (), caps_of (gray_caps (4, 4, "200/1")).get ()))
      << text_of (caps.get ());
  for (const char *wrong : {"100/1", "25/1"})
    EXPECT_FALSE (gst_caps_can_intersect (
        caps.get (), caps_of (gray_caps (4, 4, wrong)).get ()));
  EXPECT_FALSE (gst_caps_can_intersect (
      caps.get (), caps_of (gray_caps (24, 12, "200/1")).get ()));
}

TEST (DemuxRegions, ThatTheFrameDoesNotHoldAreSaid)
{
  ElementHarness demux (line ());
  demux.set_caps (gray_caps (40, 19));
  EXPECT_EQ (demux.push (frame_of (draw<std::uint8_t> (40, 19, pixel), 0)),
      GST_FLOW_NOT_NEGOTIATED);
  const std::string error = demux.error ();
  EXPECT_NE (error.find ("region 1, 8x8+32+12"), std::string::npos) << error;
  EXPECT_NE (error.find ("40x19"), std::string::npos) << error;
}

TEST (DemuxRegions, ThatTheBenchDoesNotHoldAreSaid)
{
  ElementHarness sim ("codedexposure-sim schedule=" + std::string (kSchedule));
  sim.set_caps (gray_caps (40, 19, "200/1"));
  EXPECT_NE (
      sim.push (frame_of (draw<std::uint8_t> (40, 19, pixel), 0)), GST_FLOW_OK);
  const std::string error = sim.error ();
  EXPECT_NE (error.find ("region 1, 8x8+32+12"), std::string::npos) << error;
}

TEST (DemuxRegions, AreNotForgottenByWhoeverSeesTheBackgroundOnly)
{
  ElementHarness demux (line ());
  demux.set_caps (gray_caps (kWidth, kHeight));
  ASSERT_EQ (demux.push (coded_frame (0)), GST_FLOW_OK);
  const MessagePtr info = demux.message (GST_MESSAGE_INFO);
  ASSERT_TRUE (info);
  GError *error = nullptr;
  gst_message_parse_info (info.get (), &error, nullptr);
  EXPECT_NE (std::string (error->message).find ("region_0 to region_1"),
      std::string::npos)
      << error->message;
  g_error_free (error);
}

/* The pilot may be saturated. */
TEST (DemuxRegions, PixelsOfThePilotAreNotCountedAsSaturated)
{
  constexpr int kPilot = 4;
  ElementHarness demux ("codedexposure-demux schedule=sequential:2x2,pilot=4,"
                        "region=16x8+8+4:sequential:4x2");
  demux.request ("region_0");
  demux.set_caps (gray_caps (kWidth, kHeight));
  const auto frame = draw<std::uint8_t> (kWidth, kHeight, [] (int x, int y) {
    const bool white = (x == 9 && y == 5) || (x == 0 && y < 2);
    return white || y >= kHeight - kPilot ? 255 : 100;
  });
  ASSERT_EQ (demux.push (frame_of (frame, 0)), GST_FLOW_OK);
  for (const char *pad : {"", "region_0"}) {
    const BufferPtr buffer = demux.pull (pad);
    ASSERT_TRUE (buffer);
    EXPECT_EQ (get_frame_meta (buffer.get ())->saturated, 3u) << pad;
  }
}

/** A camera, possibly misaligned, and mirrors with two regions. */
class MappedRegions : public ::testing::Test
{
protected:
  static constexpr int kSide = 96;

  Mapping mapping (const Alignment &alignment, double psf_sigma) const
  {
    return mapping (camera_to_mirrors (alignment, kSide, kSide), psf_sigma);
  }
  Mapping mapping (const Homography &homography, double psf_sigma = 0.0) const
  {
    const auto made = Mapping::make ({.camera = {kSide, kSide},
        .mirrors = {kSide, kSide},
        .homography = homography,
        .psf_sigma = psf_sigma});
    EXPECT_TRUE (made.ok ());
    return *made;
  }
  /** Coded frames of a texture that moves by 3 pixels in an exposure. */
  Image<std::uint8_t> coded (const BenchOptions &options, int number) const
  {
    auto bench = OpticalBench::make (kSide, kSide, options);
    bench->begin (schedule);
    for (int slot = 0; slot < schedule.slots (); slot++) {
      const double shift = 3.0 * (number + double (slot) / schedule.slots ());
      const auto light = draw<std::uint8_t> (kSide, kSide, [=] (int x, int y) {
        return int (120 + 50 * std::sin (0.5 * (x - shift) + 0.3 * y) +
                    30 * std::sin (0.8 * y));
      });
      bench->expose (light.view (), slot, 1.0);
    }
    Image<std::uint8_t> frame (kSide, kSide);
    bench->read_out (std::uint64_t (number), frame.view ());
    return frame;
  }
  /** The subframes of each pad. */
  std::map<std::string, std::vector<Image<std::uint8_t>>> parts (
      const std::vector<Image<std::uint8_t>> &frames,
      std::optional<Mapping> mapping = std::nullopt) const
  {
    ElementHarness demux ("codedexposure-demux");
    demux.request ("region_0");
    demux.request ("region_1");
    demux.push_event (gst_event_new_stream_start ("stream"));
    demux.set_caps (gray_caps (kSide, kSide, "30000/1001"));
    demux.push_event (setup_to_event ({schedule, mapping}));
    for (std::size_t i = 0; i < frames.size (); i++)
      EXPECT_EQ (
          demux.push (frame_of (frames[i], i * GST_SECOND * 1001 / 30000)),
          GST_FLOW_OK);
    std::map<std::string, std::vector<Image<std::uint8_t>>> images;
    for (const char *pad : {"", "region_0", "region_1"})
      images[pad] = pull_images (demux, pad);
    return images;
  }

  Schedule schedule =
      *Schedule::from_preset ("sequential:2x2,region=36x27+13+9:staircase:3x3,"
                              "region=32x32+53+26:sequential:lattice:4/2");
};

/** PSNR of pixels at least @p border from the border. */
double
mean_square (const std::vector<Image<std::uint8_t>> &a,
    const std::vector<Image<std::uint8_t>> &b, int border)
{
  EXPECT_EQ (a.size (), b.size ());
  double squares = 0.0, count = 0.0;
  for (std::size_t k = 0; k < a.size (); k++)
    for (int y = border; y < a[k].height () - border; y++)
      for (int x = border; x < a[k].width () - border; x++) {
        squares += std::pow (double (a[k].at (x, y)) - b[k].at (x, y), 2);
        count += 1.0;
      }
  return squares / count;
}

TEST_F (MappedRegions, OfAMisalignedBenchAreAsTrueAsOfAnAlignedOne)
{
  BenchOptions straight;
  straight.psf_sigma = 0.4;
  straight.full_well = 10000;
  straight.read_noise = 5;
  BenchOptions askew = straight;
  askew.alignment = {0.4, 0.4, 0.5, 1.01};
  std::vector<Image<std::uint8_t>> truth, aligned, seen;
  for (int i = 0; i < 3; i++) {
    truth.push_back (coded ({}, i));
    aligned.push_back (coded (straight, i));
    seen.push_back (coded (askew, i));
  }
  const auto exact = parts (truth), wanted = parts (aligned),
             unmapped = parts (seen),
             mapped = parts (seen, mapping (askew.alignment, 0.4));
  const double within = std::pow (10.0, 0.03); // 0.3 dB
  for (const auto &[pad, images] : exact) {
    SCOPED_TRACE (pad);
    const int border = pad.empty () ? 4 : 0; // that the camera may not see
    const double error = mean_square (wanted.at (pad), images, border);
    EXPECT_LT (mean_square (mapped.at (pad), images, border), error * within);
    EXPECT_GT (mean_square (unmapped.at (pad), images, border), error * 2);
  }
}

/* A region is a rectangle of mirrors, however the camera sees them. */
TEST_F (MappedRegions, OfACameraThatIsTurnedAreFoundExactly)
{
  const std::vector frames = {coded ({}, 0), coded ({}, 1)};
  const auto wanted = parts (frames);
  constexpr double kLast = kSide - 1;
  const Homography turned[] = {{-1, 0, kLast, 0, -1, kLast, 0, 0, 1},
      {0, 1, 0, -1, 0, kLast, 0, 0, 1}, {-1, 0, kLast, 0, 1, 0, 0, 0, 1}};
  for (const Homography &h : turned) {
    std::vector<Image<std::uint8_t>> seen;
    for (const auto &frame : frames)
      seen.push_back (draw<std::uint8_t> (kSide, kSide, [&] (int x, int y) {
        return frame.at (
            int (h[0] * x + h[1] * y + h[2]), int (h[3] * x + h[4] * y + h[5]));
      }));
    EXPECT_EQ (parts (seen, mapping (h)), wanted);
    EXPECT_NE (parts (seen), wanted);
  }
}

} // namespace
