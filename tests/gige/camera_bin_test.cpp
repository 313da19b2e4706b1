/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-camerasrc: what it sets, says and counts, and its clock. */
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <vector>

#include <gst/check/gsttestclock.h>

#include "received.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

/** A camera and a pipeline's clock that stands still from exposure to exposure,
 * each of which waits until dmdsync has passed the frame before on: frames
 * arrive when they are exposed, however slow the machine. */
class LockStep
{
public:
  explicit LockStep (GstClockTime period) : period_ (period) {}

  GstClock *clock () const { return GST_CLOCK (clock_.get ()); }
  /** From now on frames are sent. */
  void begin ()
  {
    const std::lock_guard guard (lock_);
    begun_ = true;
  }
  /** Watches for frames at @p element. */
  void await_at (GstElement *element)
  {
    const ObjectPtr<GstPad> pad (gst_element_get_static_pad (element, "sink"));
    gst_pad_add_probe (
        pad.get (), GST_PAD_PROBE_TYPE_BUFFER,
        [] (GstPad *, GstPadProbeInfo *, gpointer self) {
          static_cast<LockStep *> (self)->arrive ();
          return GST_PAD_PROBE_OK;
        },
        this, nullptr);
  }
  /** Whether to send the next frame; on the camera's thread. */
  bool expose ()
  {
    std::unique_lock guard (lock_);
    if (!begun_)
      return false;
    /* Where it waits in vain too often, it waits no more. */
    if (held_up_ < 5 && !more_.wait_for (guard, std::chrono::seconds (1),
                            [this] { return !under_way_; }))
      held_up_++;
    under_way_ = true;
    gst_test_clock_advance_time (clock_.get (), period_);
    return true;
  }
  /** Frames that did not arrive while the clock stood still, or not at all. */
  guint64 held_up () const
  {
    const std::lock_guard guard (lock_);
    return held_up_;
  }

private:
  void arrive ()
  {
    const std::lock_guard guard (lock_);
    under_way_ = false;
    more_.notify_all ();
  }

  const GstClockTime period_;
  const ObjectPtr<GstTestClock> clock_{
      GST_TEST_CLOCK (gst_test_clock_new_with_start_time (GST_SECOND))};
  mutable std::mutex lock_;
  std::condition_variable more_;
  bool begun_ = false;
  bool under_way_ = false;
  guint64 held_up_ = 0;
};

/* A live source holds frames until their times have come by the pipeline's
 * clock: those of a camera that is fast would seem to be right. */
TEST (CameraBin, ACameraThatIsFastIsNeitherHeldUpNorBelieved)
{
  constexpr GstClockTime kPeriod = 10 * GST_MSECOND;
  LockStep step (kPeriod);
  GigeCameraOptions options;
  options.drift = 400;
  const auto camera = open_camera (
      std::move (options), [&step] (std::uint64_t, ImageView<std::uint16_t>) {
        return step.expose ();
      });
  GstClockTime first = GST_CLOCK_TIME_NONE;
  GstClockTime last = 0;
  CameraPipeline pipeline (
      camera_bin ("100/1", "GRAY8", "num-buffers=300") + kSync,
      [&] (GstBuffer *buffer, const GstVideoInfo &) {
        last = GST_BUFFER_PTS (buffer);
        first = std::min (first, last);
      });
  gst_pipeline_use_clock (GST_PIPELINE (pipeline.get ()), step.clock ());
  step.await_at (pipeline.element ("sink").get ());
  pipeline.play ();
  step.begin ();
  EXPECT_EQ (pipeline.wait_end (), "end");
  const auto sync = pipeline.element ("sync");
  const StructurePtr stats (property<GstStructure *> (sync.get (), "stats"));
  double drift = 0;
  EXPECT_TRUE (gst_structure_get_double (stats.get (), "clock-drift", &drift));
  EXPECT_NEAR (drift, 400, 1) << "ppm";
  const guint64 lost = counter (pipeline, "frames-lost");
  EXPECT_LE (step.held_up (), lost);
  EXPECT_NEAR (double (last - first), double ((299 + lost) * kPeriod), 1000);
}

TEST (CameraBin, ATriggerThatImposesAnotherRateIsSaid)
{
  GigeCameraOptions options;
  options.trigger_rate = 80;
  const auto camera = open_camera (options);
  CameraPipeline pipeline (camera_bin ("100/1", "GRAY8",
                               "num-buffers=70 trigger=dmd trigger-line=Line1 "
                               "trigger-edge=falling") +
                               kSync,
      [] (auto *, auto &) {});
  pipeline.play ();
  EXPECT_EQ (pipeline.wait_end (), "end");
  const auto said = std::find_if (pipeline.messages.begin (),
      pipeline.messages.end (), [] (const MessagePtr &message) {
        return gst_message_has_name (message.get (), "dmdsync/frame-rate");
      });
  ASSERT_NE (said, pipeline.messages.end ());
  double measured = 0;
  gst_structure_get_double (
      gst_message_get_structure (said->get ()), "measured", &measured);
  EXPECT_NEAR (measured, 80, 0.1);
}

TEST (CameraBin, ExposureAndLinesAreFeaturesOfTheCamera)
{
  GigeCameraOptions options;
  const auto camera = open_camera (
      options, [] (std::uint64_t, ImageView<std::uint16_t> picture) {
        for (int y = 0; y < picture.height; y++)
          std::fill_n (picture.row (y), picture.width, 200);
        return true;
      });
  int level = 0;
  CameraPipeline pipeline (
      camera_bin ("50/1", "GRAY8",
          "num-buffers=3 exposure-time=5000 trigger=camera "
          "trigger-edge=falling"),
      [&] (GstBuffer *buffer, const GstVideoInfo &info) {
        MappedFrame mapped (info, buffer, GST_MAP_READ);
        level = view_of<std::uint8_t> (mapped).at (9, 9);
      });
  pipeline.play ();
  EXPECT_EQ (pipeline.wait_end (), "end");
  EXPECT_EQ (level, 50) << "a quarter of the period's light";
}

/* aravissrc sets the frame rate first, which ends all triggers, and features
 * last. */
TEST (CameraBin, SetsTheCameraUpAsItsPropertiesSay)
{
  const struct {
    std::string format;
    std::string properties;
    std::string expected;
  } cases[] = {{"Mono8", "trigger=dmd", "trigger Line0 rising"},
      {"Mono16", "trigger=dmd trigger-line=Line1 trigger-edge=falling",
          "trigger Line1 falling"},
      {"Mono12", "trigger=camera trigger-line=Line0",
          "no trigger, Line0 puts out ExposureActive"},
      {"Mono12Packed", "trigger=camera trigger-edge=falling",
          "no trigger, Line1 puts out ExposureActive, inverted"},
      {"Mono12p", "trigger=dmd trigger-edge=falling", "trigger Line0 falling"},
      {"Mono8",
          "features=\"TriggerSelector=FrameStart TriggerSource=Line1 "
          "TriggerMode=On\"",
          "trigger Line1 rising"}};
  for (const auto &[format, properties, expected] : cases) {
    SCOPED_TRACE (format + " " + properties);
    std::mutex lock;
    std::string set;
    GigeCameraOptions options;
    options.trigger_rate = 50;
    options.set_up = [&] (const CameraSettings &settings) {
      const std::lock_guard guard (lock);
      set = camera_settings_text (settings);
    };
    const auto camera = open_camera (std::move (options));
    CameraPipeline pipeline (
        camera_bin ("50/1", format == "Mono8" ? "GRAY8" : "GRAY16_LE",
            "num-buffers=2 exposure-time=4000 pixel-format=" + format + " " +
                properties),
        [] (GstBuffer *frame, auto &) {
          const auto meta = get_frame_meta (frame);
          ASSERT_TRUE (meta);
          EXPECT_EQ (meta->exposure_duration, 4 * GST_MSECOND);
        });
    pipeline.play ();
    EXPECT_EQ (pipeline.wait_end (), "end");
    const std::lock_guard guard (lock);
    EXPECT_EQ (set,
        "256x192 " + format + ", 50 a second, exposure 4000 us, " + expected);
  }
}

/* For caps of 16 bits, aravissrc sets Mono16. */
TEST (CameraBin, ACameraOfMoreThan8BitsNeedsNoMono16)
{
  for (const char *format : {"Mono10", "Mono10Packed", "Mono10p", "Mono12",
           "Mono12Packed", "Mono12p"}) {
    SCOPED_TRACE (format);
    GigeCameraOptions options;
    options.bits = significant_bits (*parse_mono_format (format));
    options.features = {{"GammaEnable", "false"}}; // it has no deeper format
    const int mask = (1 << options.bits) - 1;
    const auto camera = open_camera (options);
    int frames = 0, known = 0;
    CameraPipeline pipeline (
        camera_bin ("100/1", "GRAY16_LE",
            std::string ("num-buffers=3 pixel-format=") + format),
        [&] (GstBuffer *buffer, const GstVideoInfo &info) {
          frames++;
          EXPECT_EQ (get_frame_meta (buffer)->bits, options.bits);
          for (std::uint64_t frame = 0; frame < 100; frame++)
            known +=
                wrong_pixels<std::uint16_t> (buffer, info, frame, mask) == 0;
        });
    pipeline.play ();
    EXPECT_EQ (pipeline.wait_end (), "end");
    EXPECT_EQ (frames, 3);
    EXPECT_EQ (known, 3) << "each is one frame of the scene";
  }
}

/* A plain aravissrc keeps the camera that is no more. */
TEST (CameraBin, ACameraThatRestartsServesTheNextRun)
{
  std::size_t came = 0;
  CameraPipeline pipeline (
      camera_bin ("100/1", "GRAY8", "num-buffers=12") + kSync,
      [&] (GstBuffer *, const GstVideoInfo &) { came++; });
  for (int run = 0; run < 2; run++) {
    SCOPED_TRACE (run);
    const auto camera = open_camera ({});
    came = 0;
    pipeline.play ();
    EXPECT_EQ (pipeline.wait_end (), "end");
    pipeline.stop ();
    EXPECT_EQ (came + counter (pipeline, "frames-early"), 12u);
    EXPECT_GE (came, 10u);
    EXPECT_EQ (counter (pipeline, "frames-lost"), 0u);
  }
}

TEST (CameraBin, LeavesNoSourceBehind)
{
  const auto camera = open_camera ({});
  bool gone = false;
  {
    /* Without a property of the child, which GStreamer's parser would keep. */
    CameraPipeline pipeline (
        "codedexposure-camerasrc name=camera camera-name=127.0.0.1 "
        "num-buffers=3 ! ",
        [] (auto *, auto &) {});
    const auto bin = pipeline.element ("camera");
    const ObjectPtr<GstElement> source (
        gst_bin_get_by_name (GST_BIN (bin.get ()), "source"));
    g_object_weak_ref (
        G_OBJECT (source.get ()),
        [] (gpointer gone, GObject *) { *static_cast<bool *> (gone) = true; },
        &gone);
    pipeline.play ();
    EXPECT_EQ (pipeline.wait_end (), "end");
  }
  EXPECT_TRUE (gone);
}

/** What the bus says first of a run with @p properties. */
std::string
said_of (const std::string &properties)
{
  CameraPipeline pipeline (
      "codedexposure-camerasrc name=camera " + properties + " ! ",
      [] (auto *, auto &) {});
  pipeline.play ();
  const std::string error = pipeline.wait_end ();
  pipeline.stop ();
  return error;
}

TEST (CameraBin, WhatCannotBeIsAnErrorThatNamesTheRemedy)
{
  const struct {
    const char *properties;
    const char *value;
    const char *remedy;
  } cases[] = {{"pixel-format=Mono14", "Mono14", "it is Mono8, Mono10"},
      {"trigger=dmd trigger-line=\"Line 0\"", "Line 0", "camera show"},
      {"trigger-line=Line1", "Line1", "trigger=dmd"},
      {"features=\"Gain=1 PixelFormat=Mono12p\"", "PixelFormat=Mono12p",
          "pixel-format=Mono12p"},
      {"camera-name=127.0.0.9", "127.0.0.9", "find camera"}};
  for (const auto &[properties, value, remedy] : cases) {
    SCOPED_TRACE (properties);
    const std::string error = said_of (properties);
    EXPECT_NE (error.find (value), error.npos) << error;
    EXPECT_NE (error.find (remedy), error.npos) << error;
  }
}

TEST (CameraBin, AFeatureThatTheCameraHasNotIsAnError)
{
  const auto camera = open_camera ({});
  const std::string error =
      said_of ("camera-name=127.0.0.1 features=NoSuchFeature=1");
  EXPECT_NE (error.find ("NoSuchFeature"), error.npos) << error;
}

TEST (CameraBin, TimesCountFromTheArrivalOfTheFirstFrame)
{
  const auto camera = open_camera ({});
  std::vector<GstClockTime> times;
  GstClockTime arrival = 0;
  CameraPipeline pipeline (camera_bin ("100/1", "GRAY8", "num-buffers=20"),
      [&] (GstBuffer *buffer, const GstVideoInfo &) {
        EXPECT_NE (buffer->pool, nullptr);
        if (times.empty ())
          arrival = gst_element_get_current_running_time (pipeline.get ());
        times.push_back (GST_BUFFER_PTS (buffer));
      });
  pipeline.play ();
  EXPECT_EQ (pipeline.wait_end (), "end");
  ASSERT_EQ (times.size (), 20u);
  EXPECT_LE (times.front (), arrival);
  EXPECT_GT (times.front (), 0u) << "a camera takes a while to start";
  EXPECT_TRUE (std::is_sorted (times.begin (), times.end ()));
}

/* A search is a broadcast on every network of the machine. */
TEST (CameraBin, IsNotSearchedForByProgramsThatListVideoSources)
{
  const ObjectPtr<GstDeviceMonitor> monitor (gst_device_monitor_new ());
  for (const auto &[classes, asked] : {std::pair{"Source/Video", false},
           {"Video/Source", false}, {"Source/GenICam", true}}) {
    const guint filter =
        gst_device_monitor_add_filter (monitor.get (), classes, nullptr);
    gchar **providers = gst_device_monitor_get_providers (monitor.get ());
    EXPECT_EQ (providers &&
                   g_strv_contains (providers, "codedexposure-cameraprovider"),
        asked)
        << classes;
    g_strfreev (providers);
    if (filter != 0)
      gst_device_monitor_remove_filter (monitor.get (), filter);
  }
}

TEST (CameraBin, IsListedAsADevice)
{
  const auto camera = open_camera ({});
  const ObjectPtr<GstDeviceMonitor> monitor (gst_device_monitor_new ());
  gst_device_monitor_add_filter (monitor.get (), "Source/GenICam", nullptr);
  const ObjectPtr<GstBus> bus (gst_device_monitor_get_bus (monitor.get ()));
  ASSERT_TRUE (gst_device_monitor_start (monitor.get ()));
  /* Cameras are said as they are found: nobody waits for the search. */
  EXPECT_TRUE (MessagePtr (gst_bus_timed_pop_filtered (
      bus.get (), 20 * GST_SECOND, GST_MESSAGE_DEVICE_ADDED)));
  GList *devices = gst_device_monitor_get_devices (monitor.get ());
  gst_device_monitor_stop (monitor.get ());
  int found = 0;
  for (GList *at = devices; at; at = at->next) {
    auto *device = GST_DEVICE (at->data);
    const StructurePtr facts (gst_device_get_properties (device));
    const gchar *serial =
        facts ? gst_structure_get_string (facts.get (), "serial") : nullptr;
    if (g_strcmp0 (serial, "CE01") != 0)
      continue;
    found++;
    EXPECT_STREQ (gst_structure_get_string (facts.get (), "vendor"), "Aravis");
    EXPECT_STREQ (gst_structure_get_string (facts.get (), "model"), "Fake");
    EXPECT_STREQ (
        gst_structure_get_string (facts.get (), "address"), "127.0.0.1");
    const CharPtr name (gst_device_get_display_name (device));
    EXPECT_STREQ (name.get (), "Aravis Fake CE01");
    const CapsPtr caps (gst_device_get_caps (device));
    EXPECT_TRUE (gst_caps_can_intersect (
        caps.get (), caps_of (gray_caps (64, 48)).get ()));
    const ObjectPtr<GstElement> element (GST_ELEMENT (
        gst_object_ref_sink (gst_device_create_element (device, "camera"))));
    ASSERT_TRUE (element);
    const CharPtr camera_name (
        property<gchar *> (element.get (), "camera-name"));
    EXPECT_STREQ (camera_name.get (), "Aravis-Fake-CE01");
    EXPECT_TRUE (gst_device_reconfigure_element (device, element.get ()));
  }
  g_list_free_full (devices, gst_object_unref);
  EXPECT_EQ (found, 1);
}

} // namespace
