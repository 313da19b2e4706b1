/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A camera in software, read by codedexposure-camerasrc and by the unmodified
 * aravissrc, with dmdsync behind them. */
#include <algorithm>
#include <latch>

#include "base/packed_mono.h"
#include "received.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

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
  EXPECT_EQ (counter (pipeline, "frames-lost"), 6u);
  EXPECT_EQ (sum_of (pipeline, "codedexposure/frames-lost", "count"), 7u);
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
  EXPECT_EQ (sum_of (pipeline, "codedexposure/frames-lost", "count"), lost);
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

} // namespace
