/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-scene: exact times, both depths, and the drawn pictures. */
#include <vector>

#include "bench/scene.h"
#include "harness.h"
#include "pipeline.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

/** The pictures that the element makes with these caps. */
std::vector<BufferPtr>
pictures (const char *scene, const std::string &caps, int count)
{
  const HarnessPtr h (gst_harness_new_parse (
      ("codedexposure-scene scene=" + std::string (scene)).c_str ()));
  gst_harness_set_sink_caps_str (h.get (), caps.c_str ());
  gst_harness_play (h.get ());
  std::vector<BufferPtr> buffers;
  for (int k = 0; k < count; k++)
    buffers.emplace_back (gst_harness_pull (h.get ()));
  return buffers;
}

TEST (SceneElement, TimesAreExactAtNtscRates)
{
  const auto buffers =
      pictures ("candle", gray_caps (16, 12, "120000/1001"), 5);
  const auto time_of = [] (guint64 k) {
    return gst_util_uint64_scale (k, 1001 * GST_SECOND, 120000);
  };
  for (guint64 k = 0; k < 5; k++) {
    EXPECT_EQ (GST_BUFFER_PTS (buffers[k].get ()), time_of (k));
    EXPECT_EQ (
        GST_BUFFER_DURATION (buffers[k].get ()), time_of (k + 1) - time_of (k));
    EXPECT_EQ (GST_BUFFER_OFFSET (buffers[k].get ()), k);
  }
}

TEST (SceneElement, DrawsTheSceneThatIsAskedForInBothDepths)
{
  struct {
    const char *name;
    SceneKind kind;
  } const scenes[] = {{"candle", SceneKind::kCandle},
      {"blown-out", SceneKind::kBlownOut}, {"pour", SceneKind::kPour}};
  for (const auto &[name, kind] : scenes) {
    SCOPED_TRACE (name);
    Image<float> light (50, 30);
    SyntheticScene::make (kind, {50, 30})->draw (0.6, light.view ());
    const auto level = [&] (float white) {
      return [&light, white] (
                 int x, int y) { return int (light.at (x, y) * white + 0.5f); };
    };
    /* The fourth picture at 5 a second. */
    const std::string caps8 = gray_caps (50, 30, "5/1");
    const std::string caps16 = gray_caps (50, 30, "5/1", "GRAY16_LE");
    EXPECT_EQ (image_of<guint8> (
                   pictures (name, caps8, 4)[3].get (), caps_of (caps8).get ()),
        draw<guint8> (50, 30, level (255.0f)));
    EXPECT_EQ (image_of<guint16> (pictures (name, caps16, 4)[3].get (),
                   caps_of (caps16).get ()),
        draw<guint16> (50, 30, level (65535.0f)));
  }
}

TEST (SceneElement, BeginsAgainAfterTheTimeToRepeat)
{
  const std::string caps = gray_caps (50, 30, "25/1");
  const auto image = [&] (const BufferPtr &picture) {
    return image_of<guint8> (picture.get (), caps_of (caps).get ());
  };
  const auto once = pictures ("pour", caps, 15);
  const auto again = pictures ("pour repeat=400000000", caps, 15);
  for (unsigned k = 0; k < 15; k++) {
    EXPECT_EQ (image (again[k]), image (once[k % 10])) << k;
    EXPECT_EQ (
        GST_BUFFER_PTS (again[k].get ()), GST_BUFFER_PTS (once[k].get ()));
  }
  EXPECT_NE (image (once[10]), image (once[0]));
}

TEST (SceneElement, StandsInForTheBenchUnlessToldOtherwise)
{
  const HarnessPtr h (gst_harness_new_parse ("codedexposure-scene"));
  gst_harness_play (h.get ());
  const BufferPtr first (gst_harness_pull (h.get ()));
  const CapsPtr caps (gst_pad_get_current_caps (h->sinkpad));
  const GstVideoInfo info = info_of (caps.get ());
  EXPECT_EQ (info.width, 768);
  EXPECT_EQ (info.height, 576);
  EXPECT_EQ (info.fps_n, 100);
  EXPECT_EQ (info.fps_d, 1);
}

TEST (SceneElement, WantsAFrameRate)
{
  Pipeline pipeline ("codedexposure-scene num-buffers=1 ! "
                     "video/x-raw,framerate=0/1 ! fakesink");
  EXPECT_EQ (pipeline.play (),
      "A scene that moves needs a frame rate: write one behind it, such as "
      "video/x-raw,framerate=100/1.");
}

} // namespace
