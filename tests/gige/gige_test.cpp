/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A camera in software, read by codedexposure-camerasrc and by the unmodified
 * aravissrc, with dmdsync behind them. */
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <latch>
#include <map>
#include <mutex>

#include <gst/check/gsttestclock.h>

#include "base/packed_mono.h"
#include "camera_rig.h"
#include "linked_elements.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

const auto *const linked =
    ::testing::AddGlobalTestEnvironment (new LinkedElements);

/** Pixels of @p buffer that are not those of the scene's frame. */
template <typename Pixel>
int
wrong_pixels (GstBuffer *buffer, const GstVideoInfo &info, std::uint64_t frame,
    int mask, int shift = 0)
{
  MappedFrame mapped (info, buffer, GST_MAP_READ);
  if (!mapped)
    return -1;
  const auto view = view_of<Pixel> (mapped);
  int wrong = 0;
  for (int y = 0; y < view.height; y++)
    for (int x = 0; x < view.width; x++)
      wrong += view.at (x, y) != ((scene_pixel (frame, x, y) & mask) << shift);
  return wrong;
}

/** What came behind dmdsync, each frame compared with the scene's frame of its
 * number. Nobody knows of frames that are lost before the first one, and those
 * that were exposed before the stream's time 0 have a number but do not come.
 */
struct Received {
  guint64 scene = 0;             // first frame of the camera's
  std::map<guint64, int> frames; // by number, how often
  std::vector<guint64> order;
  guint64 first_frame = 0; // of the camera, that is number 0
  int wrong = 0;

  void take (GstBuffer *buffer, const GstVideoInfo &info)
  {
    const guint64 number = GST_BUFFER_OFFSET (buffer);
    if (order.empty ()) {
      guint64 frame = number;
      while (frame < number + 100 &&
             wrong_pixels<std::uint8_t> (buffer, info, scene + frame, 255) > 0)
        frame++;
      first_frame = frame - number;
    }
    frames[number]++;
    order.push_back (number);
    wrong += wrong_pixels<std::uint8_t> (
                 buffer, info, scene + first_frame + number, 255) != 0;
  }
};

/** Frames that dmdsync was given, and that are not lost on purpose. */
guint64
came (const CameraPipeline &pipeline, const Received &received)
{
  return received.order.size () + counter (pipeline, "frames-early");
}

guint64
sum_of (const CameraPipeline &pipeline, const char *message, const char *field)
{
  guint64 sum = 0;
  for (const MessagePtr &said : pipeline.messages) {
    const GstStructure *structure = gst_message_get_structure (said.get ());
    guint64 value = 0;
    if (structure && gst_structure_has_name (structure, message) &&
        gst_structure_get_uint64 (structure, field, &value))
      sum += value;
  }
  return sum;
}

constexpr const char *kSync = "dmdsync name=sync timestamp-at=device-clock ! ";

/** Tests of both sources. */
class Gige : public ::testing::TestWithParam<bool>
{
protected:
  static bool is_bin () { return GetParam (); }
  static std::string source (const std::string &rate, const std::string &format,
      const std::string &more = "")
  {
    return is_bin () ? camera_bin (rate, format, more)
                     : camera_source (rate, format, more);
  }
};

INSTANTIATE_TEST_SUITE_P (Sources, Gige, ::testing::Bool (),
    [] (const auto &info) { return info.param ? "bin" : "aravissrc"; });

TEST_P (Gige, EveryPixelOfEveryFrameArrives)
{
  const auto camera = open_camera ({});
  Received received;
  CameraPipeline pipeline (source ("100/1", "GRAY8", "num-buffers=100") + kSync,
      [&] (auto *buffer, auto &info) { received.take (buffer, info); });
  pipeline.play ();
  EXPECT_EQ (pipeline.wait_end (), "end");
  EXPECT_EQ (came (pipeline, received), 100u);
  EXPECT_EQ (received.wrong, 0);
  EXPECT_EQ (counter (pipeline, "frames-lost"), 0u);
}

TEST_P (Gige, WideFormatsKeepTheirBits)
{
  const struct {
    int bits;
    const char *format;
  } cases[] = {{16, "Mono16"}, {12, "Mono12"}, {10, "Mono10"}};
  for (const auto &[bits, format] : cases) {
    SCOPED_TRACE (format);
    GigeCameraOptions options;
    options.bits = bits;
    const auto camera = open_camera (options);
    std::uint64_t frames = 0;
    std::uint64_t first = 0;
    int wrong = 0;
    const std::string assigned = std::string ("PixelFormat=") + format;
    CameraPipeline pipeline (
        source ("100/1", "GRAY16_LE",
            "num-buffers=10 " + (is_bin ()
                                        ? std::string ("pixel-format=") + format
                                        : "features=" + assigned)),
        [&] (auto *buffer, auto &info) {
          const int mask = (1 << bits) - 1;
          const auto differs = [&] (std::uint64_t frame) {
            return wrong_pixels<std::uint16_t> (buffer, info, frame, mask) != 0;
          };
          while (frames == 0 && first < 100 && differs (first))
            first++;
          wrong += differs (first + frames++);
        });
    pipeline.play ();
    EXPECT_EQ (pipeline.wait_end (), "end");
    EXPECT_EQ (frames, 10u);
    EXPECT_EQ (wrong, 0);
  }
}

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

TEST_P (Gige, EveryFaultIsAccountedFor)
{
  GigeCameraOptions options;
  ASSERT_TRUE (options.faults
                   .add ("lose@10:3 incomplete@20 duplicate@30 late@40 "
                         "delay@50:12ms")
                   .ok ());
  const auto camera = open_camera (std::move (options));
  Received received;
  CameraPipeline pipeline (source ("100/1", "GRAY8", "num-buffers=60") + kSync,
      [&] (auto *buffer, auto &info) { received.take (buffer, info); });
  pipeline.play ();
  EXPECT_EQ (pipeline.wait_end (), "end");

  /* Numbers count from the first frame that came. */
  const guint64 first = received.first_frame;
  ASSERT_LT (first, 10u);
  EXPECT_EQ (received.wrong, 0);
  for (const guint64 lost : {10, 11, 12, 20, 31, 42})
    EXPECT_FALSE (received.frames.contains (lost - first)) << lost;
  const auto late =
      std::find (received.order.begin (), received.order.end (), 40 - first);
  ASSERT_NE (late, received.order.end ());
  EXPECT_EQ (*(late - 1), 41 - first);
  EXPECT_EQ (counter (pipeline, "frames-lost"), 7u);
  EXPECT_EQ (sum_of (pipeline, "dmdsync/frames-lost", "count"), 7u);
  EXPECT_EQ (counter (pipeline, "frames-late"), 1u);
  EXPECT_EQ (sum_of (pipeline, "dmdsync/frame-late", "frame"), 40 - first);
  EXPECT_EQ (counter (pipeline, "frames-duplicate"), 1u);
  EXPECT_EQ (sum_of (pipeline, "dmdsync/frame-dropped", "frame"), 30 - first);
}

TEST_P (Gige, WithOnePercentOfThePacketsLostEveryGapIsAccountedFor)
{
  GigeCameraOptions options;
  options.packet_loss = 0.01;
  const auto camera = open_camera (options);
  Received received;
  CameraPipeline pipeline (source ("100/1", "GRAY8", "num-buffers=100") + kSync,
      [&] (auto *buffer, auto &info) { received.take (buffer, info); });
  pipeline.play ();
  EXPECT_EQ (pipeline.wait_end (), "end");

  EXPECT_EQ (came (pipeline, received), 100u);
  EXPECT_EQ (received.wrong, 0);
  const guint64 lost = received.order.back () + 1 - 100;
  EXPECT_GT (lost, 0u) << "36 packets a frame";
  EXPECT_EQ (counter (pipeline, "frames-lost"), lost);
  EXPECT_EQ (sum_of (pipeline, "dmdsync/frames-lost", "count"), lost);
}

/* aravissrc gives memory to its camera again that it has handed out. */
TEST_P (Gige, FramesThatAreKeptStayWhatTheyAre)
{
  const auto camera = open_camera ({});
  std::vector<BufferPtr> kept;
  GstVideoInfo info;
  CameraPipeline pipeline (
      source ("100/1", "GRAY8",
          "num-buffers=60 " + std::string (is_bin () ? "source::" : "") +
              "num-arv-buffers=20") +
          kSync + "queue max-size-buffers=20 ! ",
      [&] (GstBuffer *buffer, const GstVideoInfo &of_sink) {
        info = of_sink;
        kept.emplace_back (gst_buffer_ref (buffer));
      });
  pipeline.play ();
  EXPECT_EQ (pipeline.wait_end (), "end");
  const guint64 early = counter (pipeline, "frames-early");
  pipeline.stop ();
  Received received;
  for (const BufferPtr &buffer : kept)
    received.take (buffer.get (), info);
  EXPECT_EQ (received.frames.size () + early, 60u);
  EXPECT_EQ (received.wrong, 0);
}

TEST_P (Gige, PackedFormatsAreUnpackedWithTheirBits)
{
  for (const char *format :
      {"Mono10Packed", "Mono12Packed", "Mono10p", "Mono12p"}) {
    SCOPED_TRACE (format);
    GigeCameraOptions options;
    options.bits = significant_bits (*parse_mono_format (format));
    const int mask = (1 << options.bits) - 1;
    const auto camera = open_camera (options);
    guint64 frames = 0;
    std::uint64_t first = 0; // of the camera, that is number 0
    int wrong = 0;
    CameraPipeline pipeline (
        source ("100/1", "GRAY16_LE",
            std::string ("num-buffers=5 ") +
                (is_bin () ? "pixel-format=" : "features=PixelFormat=") +
                format) +
            "dmdsync name=sync timestamp-at=device-clock " +
            (is_bin () ? "" : std::string ("pixel-format=") + format) + " ! ",
        [&] (auto *buffer, auto &info) {
          const guint64 number = GST_BUFFER_OFFSET (buffer);
          const auto differs = [&] (std::uint64_t frame) {
            return wrong_pixels<std::uint16_t> (buffer, info, frame, mask) != 0;
          };
          while (frames == 0 && first < 100 && differs (first + number))
            first++;
          frames++;
          wrong += differs (first + number);
          EXPECT_EQ (get_frame_meta (buffer)->bits,
              significant_bits (*parse_mono_format (format)));
        });
    pipeline.play ();
    EXPECT_EQ (pipeline.wait_end (), "end");
    EXPECT_EQ (frames + counter (pipeline, "frames-early"), 5u);
    EXPECT_EQ (wrong, 0);
  }
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
        [] (auto *, auto &) {});
    pipeline.play ();
    EXPECT_EQ (pipeline.wait_end (), "end");
    const std::lock_guard guard (lock);
    EXPECT_EQ (set,
        "256x192 " + format + ", 50 a second, exposure 4000 us, " + expected);
  }
}

TEST_P (Gige, ACameraThatStopsIsAnErrorAndACleanStop)
{
  GigeCameraOptions options;
  ASSERT_TRUE (options.faults.add ("stop@20").ok ());
  const auto camera = open_camera (std::move (options));
  Received received;
  CameraPipeline pipeline (source ("100/1", "GRAY8") + kSync,
      [&] (auto *buffer, auto &info) { received.take (buffer, info); });
  pipeline.play ();
  const std::string error = pipeline.wait_end ();
  EXPECT_NE (error.find ("data stream error"), std::string::npos) << error;
  EXPECT_EQ (came (pipeline, received) + received.first_frame, 20u);
  EXPECT_EQ (received.wrong, 0);
  /* The error comes first, why it came after it. */
  const MessagePtr warning = pipeline.wait (GST_MESSAGE_WARNING);
  ASSERT_TRUE (warning);
  EXPECT_NE (CameraPipeline::error_text (warning).find ("gets no trigger"),
      std::string::npos);
  pipeline.stop ();
}

/* A plain aravissrc keeps the camera that is no more. */
TEST (CameraBin, ACameraThatRestartsIsLockedAtOnceInTheNextRun)
{
  std::vector<bool> locked;
  CameraPipeline pipeline (
      camera_bin ("100/1", "GRAY8", "num-buffers=12") + kSync,
      [&] (GstBuffer *buffer, const GstVideoInfo &) {
        locked.push_back (get_frame_meta (buffer)->locked);
      });
  for (int run = 0; run < 2; run++) {
    SCOPED_TRACE (run);
    const auto camera = open_camera ({});
    locked.clear ();
    pipeline.play ();
    EXPECT_EQ (pipeline.wait_end (), "end");
    pipeline.stop ();
    ASSERT_EQ (locked.size () + counter (pipeline, "frames-early"), 12u);
    ASSERT_GE (locked.size (), 10u);
    EXPECT_TRUE (locked[9]);
    EXPECT_EQ (counter (pipeline, "frames-lost"), 0u);
  }
}

/* A packet socket hears every camera until its filter is set: none sends before
 * the sockets of both streams are there, which are opened while they pause. */
TEST (GigeCamera, TwoCamerasSideBySide)
{
  constexpr int kCameras = 2;
  std::latch asked (kCameras);
  std::uint64_t before[kCameras] = {}; // frames of which nothing is sent
  const auto shoot = [&] (std::size_t which, std::uint64_t scene) {
    return [&asked, &silent = before[which], scene] (
               std::uint64_t frame, ImageView<std::uint16_t> picture) {
      if (frame == 0)
        asked.count_down ();
      if (!asked.try_wait ()) {
        silent = frame + 1;
        return false;
      }
      for (int y = 0; y < picture.height; y++)
        for (int x = 0; x < picture.width; x++)
          picture.at (x, y) = scene_pixel (frame - silent + scene, x, y) & 255;
      return true;
    };
  };
  const auto first = open_camera ({}, shoot (0, 0));
  GigeCameraOptions options;
  options.address = "127.0.0.2";
  options.serial = "CE02";
  const auto second = open_camera (options, shoot (1, 1000));
  Received of_first;
  Received of_second;
  of_second.scene = 1000;
  CameraPipeline one (camera_bin ("50/1", "GRAY8", "num-buffers=50") + kSync,
      [&] (auto *buffer, auto &info) { of_first.take (buffer, info); });
  std::string line = camera_source ("50/1", "GRAY8", "num-buffers=50") + kSync;
  line.replace (line.find ("127.0.0.1"), 9, "127.0.0.2");
  CameraPipeline other (
      line, [&] (auto *buffer, auto &info) { of_second.take (buffer, info); });
  one.pause ();
  other.pause ();
  asked.wait ();
  one.play ();
  other.play ();
  EXPECT_EQ (one.wait_end (), "end");
  EXPECT_EQ (other.wait_end (), "end");
  EXPECT_EQ (came (one, of_first), 50u);
  EXPECT_EQ (of_first.wrong, 0);
  EXPECT_EQ (came (other, of_second), 50u);
  EXPECT_EQ (of_second.wrong, 0);
}

TEST (GigeCamera, AnAddressThatIsNotHereIsAnError)
{
  GigeCameraOptions options;
  options.address = "192.0.2.1";
  const auto camera = GigeCamera::open (
      options, [] (std::uint64_t, ImageView<std::uint16_t>) { return true; });
  ASSERT_FALSE (camera.ok ());
  EXPECT_NE (camera.error ().message.find ("'192.0.2.1'"), std::string::npos);
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
      {"trigger=dmd trigger-line=\"Line 0\"", "Line 0", "arv-tool-0.8"},
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

TEST (CameraBin, IsListedAsADevice)
{
  const auto camera = open_camera ({});
  const ObjectPtr<GstDeviceMonitor> monitor (gst_device_monitor_new ());
  gst_device_monitor_add_filter (monitor.get (), "Source/Video", nullptr);
  ASSERT_TRUE (gst_device_monitor_start (monitor.get ()));
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
