/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux in pipelines of real elements. */
#include "harness.h"

#include "common/meta.h"
#include "pipeline.h"
#include "schedule/sample_grid.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

/* Pictures and times of all buffers that pass a pad; a flush discards those
 * before it, as downstream does. */
template <typename Pixel>
class Watch
{
public:
  explicit Watch (ObjectPtr<GstPad> pad) : pad_ (std::move (pad))
  {
    gst_pad_add_probe (
        pad_.get (),
        static_cast<GstPadProbeType> (
            GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_FLUSH),
        [] (GstPad *from, GstPadProbeInfo *info, gpointer user_data) {
          auto *watch = static_cast<Watch *> (user_data);
          if (GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_BUFFER)
            watch->note (from, GST_PAD_PROBE_INFO_BUFFER (info));
          else if (GST_EVENT_TYPE (GST_PAD_PROBE_INFO_EVENT (info)) ==
                   GST_EVENT_FLUSH_STOP)
            watch->forget ();
          return GST_PAD_PROBE_OK;
        },
        this, nullptr);
  }
  std::vector<Image<Pixel>> images;
  std::vector<GstClockTime> times;

private:
  void note (GstPad *from, GstBuffer *buffer)
  {
    const CapsPtr caps (gst_pad_get_current_caps (from));
    images.push_back (image_of<Pixel> (buffer, caps.get ()));
    times.push_back (GST_BUFFER_PTS (buffer));
  }
  void forget ()
  {
    images.clear ();
    times.clear ();
  }
  ObjectPtr<GstPad> pad_;
};

struct BenchCase {
  const char *name;
  const char *schedule;
  const char *rate;
  const char *format;
  int frames;
};

class DemuxBench : public ::testing::TestWithParam<BenchCase>
{
};

INSTANTIATE_TEST_SUITE_P (Schedules, DemuxBench,
    ::testing::Values (
        BenchCase{"raster", "sequential:2x2", "100/1", "GRAY8", 40},
        BenchCase{"raster_ntsc", "sequential:2x2", "120000/1001", "GRAY8", 40},
        BenchCase{"raster_deep", "sequential:3x2", "150/1", "GRAY16_LE", 36},
        BenchCase{"lattice", "sequential:lattice:4/2", "100/1", "GRAY8", 40},
        BenchCase{"reordered", "sequential:lattice:8/3,order=bit-reversal",
            "200/1", "GRAY8", 40},
        BenchCase{"pilot", "sequential:2x2,pilot=8", "100/1", "GRAY8", 40}),
    [] (const auto &info) { return info.param.name; });

/* Point samples of every input frame, where the mirrors of its slot were. */
template <typename Pixel>
void
check_bench (const BenchCase &c)
{
  const Schedule schedule = *Schedule::from_preset (c.schedule);
  Pipeline pipeline (
      "videotestsrc pattern=ball num-buffers=" + std::to_string (c.frames) +
      " ! video/x-raw,format=" + c.format + ",width=66,height=50,framerate=" +
      c.rate + " ! codedexposure-sim name=sim schedule=\"" + c.schedule +
      "\" ! queue ! codedexposure-demux name=demux ! fakesink");
  Watch<Pixel> in (pipeline.pad ("sim", "sink"));
  Watch<Pixel> out (pipeline.pad ("demux", "src"));
  ASSERT_EQ (pipeline.play (), "");

  const SampleGrid grid (schedule);
  const Extent cell = grid.cell ();
  ASSERT_EQ (in.images.size (), std::size_t (c.frames));
  ASSERT_EQ (out.images.size (), in.images.size ());
  for (std::size_t i = 0; i < in.images.size (); i++) {
    SCOPED_TRACE (i);
    /* The demux computes times from that of the coded frame and the rate, both
     * rounded to a ns; the source rounds the time of each frame. */
    EXPECT_NEAR (double (out.times[i]), double (in.times[i]), 1.0);
    const int slot = int (i) % schedule.slots ();
    EXPECT_EQ (
        out.images[i], draw<Pixel> (out.images[i].width (),
                           out.images[i].height (), [&] (int x, int y) {
                             const Offset d = grid.offset (slot, x, y);
                             return in.images[i].at (
                                 x * cell.width + d.x, y * cell.height + d.y);
                           }));
  }
}

TEST_P (DemuxBench, GivesThePointSamplesOfTheInput)
{
  if (std::string (GetParam ().format) == "GRAY8")
    check_bench<std::uint8_t> (GetParam ());
  else
    check_bench<std::uint16_t> (GetParam ());
}

TEST (DemuxPipeline, PrerollsWithAQueueAfterEveryPad)
{
  Pipeline pipeline (
      "videotestsrc num-buffers=40 ! "
      "video/x-raw,format=GRAY8,width=64,height=48,framerate=100/1 ! "
      "codedexposure-sim ! codedexposure-demux name=demux "
      "demux.src ! queue ! fakesink sync=true name=all "
      "demux.subframe_0 ! queue ! fakesink sync=true "
      "demux.subframe_3 ! queue ! fakesink sync=true "
      "demux.coded ! queue ! fakesink sync=true");
  Watch<std::uint8_t> all (pipeline.pad ("demux", "src"));
  Watch<std::uint8_t> first (pipeline.pad ("demux", "subframe_0"));
  Watch<std::uint8_t> coded (pipeline.pad ("demux", "coded"));
  ASSERT_EQ (pipeline.play (), "");
  EXPECT_EQ (all.images.size (), 40u);
  EXPECT_EQ (coded.images.size (), 10u);
  ASSERT_EQ (first.images.size (), 10u);
  for (std::size_t i = 0; i < 10; i++)
    EXPECT_EQ (first.images[i], all.images[4 * i]);
}

TEST (DemuxPipeline, SubframesRunThroughConvertersAndKeepTheirMeta)
{
  Pipeline pipeline (
      "videotestsrc num-buffers=8 ! "
      "video/x-raw,format=GRAY8,width=64,height=48,framerate=100/1 ! "
      "codedexposure-sim ! codedexposure-demux ! videoconvertscale ! "
      "video/x-raw,format=I420,width=128,height=96 ! queue ! "
      "identity name=last ! fakesink");
  std::vector<std::pair<guint64, int>> seen;
  gst_pad_add_probe (
      pipeline.pad ("last", "sink").get (), GST_PAD_PROBE_TYPE_BUFFER,
      [] (GstPad *, GstPadProbeInfo *info, gpointer user_data) {
        const auto meta = get_frame_meta (GST_PAD_PROBE_INFO_BUFFER (info));
        EXPECT_TRUE (meta);
        if (meta)
          static_cast<decltype (seen) *> (user_data)->emplace_back (
              meta->frame, meta->subframe);
        return GST_PAD_PROBE_OK;
      },
      &seen, nullptr);
  ASSERT_EQ (pipeline.play (), "");
  EXPECT_EQ (seen, (std::vector<std::pair<guint64, int>>{{0, 0}, {0, 1}, {0, 2},
                       {0, 3}, {1, 0}, {1, 1}, {1, 2}, {1, 3}}));
}

TEST (DemuxPipeline, TwoInOneProcessDoNotKnowOfEachOther)
{
  Pipeline pipeline (
      "videotestsrc num-buffers=36 ! "
      "video/x-raw,format=GRAY8,width=72,height=72,framerate=900/1 ! tee "
      "name=t "
      "t. ! queue ! codedexposure-sim schedule=sequential:2x2 ! "
      "codedexposure-demux name=four ! fakesink async=false "
      "t. ! queue ! codedexposure-sim schedule=sequential:3x3 ! "
      "codedexposure-demux name=nine ! fakesink async=false");
  ASSERT_EQ (pipeline.play (), "");
  const auto in_force = [&] (const char *name) {
    return text_property (pipeline[name].get (), "schedule-in-force");
  };
  const auto frames = [&] (const char *name) {
    return counter_of (pipeline[name].get (), "frames-in");
  };
  EXPECT_EQ (in_force ("four"), "sequential:2x2");
  EXPECT_EQ (in_force ("nine"), "sequential:3x3");
  EXPECT_EQ (frames ("four"), 9u);
  EXPECT_EQ (frames ("nine"), 4u);
}

TEST (DemuxPipeline, TwelveBitsAreKnownAllTheWay)
{
  Pipeline pipeline (
      "videotestsrc num-buffers=8 pattern=white ! "
      "video/x-raw,format=GRAY16_LE,width=16,height=16,framerate=100/1 ! "
      "codedexposure-sim bits=12 gain=16 ! dmdsync ! codedexposure-demux "
      "name=demux ! "
      "subframestats name=stats post-messages=false ! "
      "codedexposure-view name=view ! videoconvert ! "
      "video/x-raw,format=GRAY16_LE ! videoconvert ! "
      "video/x-raw,format=GRAY8 ! subframestats name=converted ! fakesink");
  Watch<std::uint16_t> raw (pipeline.pad ("demux", "src"));
  Watch<std::uint8_t> seen (pipeline.pad ("view", "src"));
  ASSERT_EQ (pipeline.play (), "");
  ASSERT_EQ (raw.images.size (), 8u);
  ASSERT_EQ (seen.images.size (), 8u);
  EXPECT_EQ (raw.images.back ().at (3, 5), 4095);
  EXPECT_EQ (seen.images.back ().at (3, 5), 255);
  const auto saturated = [&] (const char *name) {
    return property<guint64> (pipeline[name].get (), "saturated-frames");
  };
  EXPECT_EQ (counter_of (pipeline["demux"].get (), "saturated-frames"), 2u);
  EXPECT_EQ (saturated ("stats"), 8u);
  EXPECT_EQ (saturated ("converted"), 8u);
}

TEST (DemuxPipeline, SeekStartsANewStretchOfTime)
{
  Pipeline pipeline (
      "videotestsrc num-buffers=400 ! "
      "video/x-raw,format=GRAY8,width=64,height=48,framerate=25/1 ! "
      "codedexposure-demux name=demux schedule=sequential:2x2 ! queue ! "
      "fakesink name=sink");
  const ObjectPtr<GstElement> sink = pipeline["sink"];
  const ObjectPtr<GstElement> demux = pipeline["demux"];
  GstObject *top = GST_OBJECT_PARENT (demux.get ());
  gst_element_set_state (GST_ELEMENT (top), GST_STATE_PAUSED);
  ASSERT_EQ (
      gst_element_get_state (GST_ELEMENT (top), nullptr, nullptr, kPatience),
      GST_STATE_CHANGE_SUCCESS);
  Watch<std::uint8_t> out (pipeline.pad ("demux", "src"));
  ASSERT_TRUE (gst_element_seek (GST_ELEMENT (top), 1.0, GST_FORMAT_TIME,
      GST_SEEK_FLAG_FLUSH, GST_SEEK_TYPE_SET, 4 * GST_SECOND, GST_SEEK_TYPE_SET,
      5 * GST_SECOND));
  ASSERT_EQ (pipeline.play (), "");
  ASSERT_EQ (out.times.size (), 100u);
  EXPECT_EQ (out.times.front (), 4 * GST_SECOND);
  EXPECT_EQ (out.times.back (), 5 * GST_SECOND - 10 * GST_MSECOND);
  EXPECT_EQ (counter_of (demux.get (), "frames-lost"), 0u);
}

TEST (DemuxPipeline, ErrorReachesTheBusOnceAndStopsThePipeline)
{
  Pipeline pipeline (
      "videotestsrc ! video/x-raw,format=GRAY8,width=64,height=48,"
      "framerate=0/1 ! codedexposure-demux schedule=sequential:2x2 ! "
      "fakesink");
  EXPECT_NE (pipeline.play ().find ("frame-rate"), std::string::npos);
}

} // namespace
