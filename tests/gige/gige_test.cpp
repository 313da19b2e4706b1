/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync behind the unmodified aravissrc, which reads a camera in software. */
#include <condition_variable>
#include <cstdlib>
#include <latch>
#include <map>
#include <mutex>

#include <gst/check/gsttestclock.h>

#include "camera/packed_mono.h"
#include "camera_rig.h"
#include "linked_elements.h"

namespace
{

using namespace cexp;
using namespace cexp::test;

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

TEST (Gige, EveryPixelOfEveryFrameArrives)
{
  const auto camera = open_camera ({});
  Received received;
  CameraPipeline pipeline (
      camera_source ("100/1", "GRAY8", "num-buffers=100") + kSync,
      [&] (auto *buffer, auto &info) { received.take (buffer, info); });
  pipeline.play ();
  EXPECT_EQ (pipeline.wait_end (), "end");
  EXPECT_EQ (came (pipeline, received), 100u);
  EXPECT_EQ (received.wrong, 0);
  EXPECT_EQ (counter (pipeline, "frames-lost"), 0u);
}

TEST (Gige, WideFormatsKeepTheirBits)
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
    CameraPipeline pipeline (camera_source ("100/1", "GRAY16_LE",
                                 "num-buffers=10 features=\"PixelFormat=" +
                                     std::string (format) + "\""),
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
 * each of which waits until the frame before has reached dmdsync: frames arrive
 * when they are exposed, however slow the machine. */
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
TEST (Gige, ACameraThatIsFastIsNeitherHeldUpNorBelieved)
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
      camera_source ("100/1", "GRAY8", "num-buffers=300") + kSync,
      [&] (GstBuffer *buffer, const GstVideoInfo &) {
        last = GST_BUFFER_PTS (buffer);
        first = std::min (first, last);
      });
  gst_pipeline_use_clock (GST_PIPELINE (pipeline.get ()), step.clock ());
  step.await_at (pipeline.element ("sync").get ());
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

TEST (Gige, EveryFaultIsAccountedFor)
{
  GigeCameraOptions options;
  ASSERT_TRUE (options.faults
                   .add ("lose@10:3 incomplete@20 duplicate@30 late@40 "
                         "delay@50:12ms")
                   .ok ());
  const auto camera = open_camera (std::move (options));
  Received received;
  CameraPipeline pipeline (
      camera_source ("100/1", "GRAY8", "num-buffers=60") + kSync,
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

TEST (Gige, WithOnePercentOfThePacketsLostEveryGapIsAccountedFor)
{
  GigeCameraOptions options;
  options.packet_loss = 0.01;
  const auto camera = open_camera (options);
  Received received;
  CameraPipeline pipeline (
      camera_source ("100/1", "GRAY8", "num-buffers=100") + kSync,
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
TEST (Gige, FramesThatAreKeptStayWhatTheyAre)
{
  const auto camera = open_camera ({});
  std::vector<BufferPtr> kept;
  GstVideoInfo info;
  CameraPipeline pipeline (
      camera_source ("100/1", "GRAY8", "num-buffers=60 num-arv-buffers=20") +
          kSync + "queue max-size-buffers=20 ! ",
      [&] (GstBuffer *buffer, const GstVideoInfo &of_sink) {
        info = of_sink;
        kept.emplace_back (gst_buffer_ref (buffer));
      });
  pipeline.play ();
  EXPECT_EQ (pipeline.wait_end (), "end");
  const guint64 held = counter (pipeline, "frames-held");
  const guint64 spoilt = counter (pipeline, "frames-spoilt");
  const guint64 early = counter (pipeline, "frames-early");
  pipeline.stop ();
  Received received;
  for (const BufferPtr &buffer : kept)
    received.take (buffer.get (), info);
  EXPECT_EQ (received.frames.size () + early, 60u);
  /* A machine that is too busy to copy in time says so. */
  EXPECT_LE (received.wrong, int (spoilt));
  EXPECT_LT (spoilt, held);
  EXPECT_GT (held, 20u);
}

TEST (Gige, PackedFormatsAreUnpackedWithTheirBits)
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
        camera_source ("100/1", "GRAY16_LE",
            "num-buffers=5 features=\"PixelFormat=" + std::string (format) +
                "\"") +
            "dmdsync name=sync timestamp-at=device-clock pixel-format=" +
            format + " ! ",
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

TEST (Gige, ATriggerThatImposesAnotherRateIsSaid)
{
  GigeCameraOptions options;
  options.trigger_rate = 80;
  const auto camera = open_camera (options);
  CameraPipeline pipeline (
      camera_source ("100/1", "GRAY8",
          "num-buffers=70 features=\"TriggerSelector=FrameStart "
          "TriggerSource=Line1 TriggerActivation=FallingEdge "
          "TriggerMode=On\"") +
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

TEST (Gige, ExposureAndLinesAreFeaturesOfTheCamera)
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
      camera_source ("50/1", "GRAY8",
          "num-buffers=3 exposure=5000 features=\"TriggerSelector=FrameStart "
          "TriggerMode=Off LineSelector=Line1 LineMode=Output "
          "LineSource=ExposureActive LineInverter=true\""),
      [&] (GstBuffer *buffer, const GstVideoInfo &info) {
        MappedFrame mapped (info, buffer, GST_MAP_READ);
        level = view_of<std::uint8_t> (mapped).at (9, 9);
      });
  pipeline.play ();
  EXPECT_EQ (pipeline.wait_end (), "end");
  EXPECT_EQ (level, 50) << "a quarter of the period's light";
}

/* As pipelines/record sets cameras up: aravissrc sets the frame rate first,
 * which ends all triggers, and features last. */
TEST (Gige, TheCameraIsSetUpAsItsSourceSays)
{
  const std::string by_dmd = "TriggerSelector=FrameStart TriggerSource=";
  const std::string by_camera =
      "TriggerSelector=FrameStart TriggerMode=Off LineSelector=";
  const struct {
    std::string format;
    std::string features;
    std::string expected;
  } cases[] = {
      {"Mono8", by_dmd + "Line0 TriggerActivation=RisingEdge TriggerMode=On",
          "trigger Line0 rising"},
      {"Mono16", by_dmd + "Line1 TriggerActivation=FallingEdge TriggerMode=On",
          "trigger Line1 falling"},
      {"Mono12",
          by_camera + "Line0 LineMode=Output LineSource=ExposureActive "
                      "LineInverter=false",
          "no trigger, Line0 puts out ExposureActive"},
      {"Mono12Packed",
          by_camera + "Line1 LineMode=Output LineSource=ExposureActive "
                      "LineInverter=true",
          "no trigger, Line1 puts out ExposureActive, inverted"},
      {"Mono12p", by_dmd + "Line0 TriggerActivation=FallingEdge TriggerMode=On",
          "trigger Line0 falling"}};
  for (const auto &[format, features, expected] : cases) {
    SCOPED_TRACE (format);
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
        camera_source ("50/1", format == "Mono8" ? "GRAY8" : "GRAY16_LE",
            "num-buffers=2 exposure=4000 features=\"" + features +
                " PixelFormat=" + format + "\""),
        [] (auto *, auto &) {});
    pipeline.play ();
    EXPECT_EQ (pipeline.wait_end (), "end");
    const std::lock_guard guard (lock);
    EXPECT_EQ (set,
        "256x192 " + format + ", 50 a second, exposure 4000 us, " + expected);
  }
}

TEST (Gige, ACameraThatStopsIsAnErrorAndACleanStop)
{
  GigeCameraOptions options;
  ASSERT_TRUE (options.faults.add ("stop@20").ok ());
  const auto camera = open_camera (std::move (options));
  Received received;
  CameraPipeline pipeline (camera_source () + kSync,
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

TEST (Gige, ACameraThatRestartsIsLockedAtOnceInTheNextRun)
{
  std::vector<bool> locked;
  CameraPipeline pipeline (
      camera_source ("100/1", "GRAY8", "num-buffers=12") + kSync,
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
TEST (Gige, TwoCamerasSideBySide)
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
  CameraPipeline one (camera_source ("50/1", "GRAY8", "num-buffers=50") + kSync,
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

TEST (Gige, AnAddressThatIsNotHereIsAnError)
{
  GigeCameraOptions options;
  options.address = "192.0.2.1";
  const auto camera = GigeCamera::open (
      options, [] (std::uint64_t, ImageView<std::uint16_t>) { return true; });
  ASSERT_FALSE (camera.ok ());
  EXPECT_NE (camera.error ().message.find ("'192.0.2.1'"), std::string::npos);
}

} // namespace
