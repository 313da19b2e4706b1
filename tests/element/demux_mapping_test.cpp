/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux with a mapping: by property and by tag, messages and
 * errors. */
#include <filesystem>
#include <fstream>

#include <unistd.h>

#include "common/messages.h"
#include "common/meta.h"
#include "common/tag.h"
#include "harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

constexpr int kWidth = 64, kHeight = 48;

/** Mapping of a camera that sees @p x, @p y mirrors further right and down. */
Mapping
shifted (double x, double y)
{
  const Extent size{kWidth, kHeight};
  const Result<Mapping> mapping = Mapping::make ({.camera = size,
      .mirrors = size,
      .homography = {1, 0, x, 0, 1, y, 0, 0, 1}});
  EXPECT_TRUE (mapping.ok ());
  return *mapping;
}

/** Pixel value of mirror (x, y). */
int
light (int x, int y)
{
  return (x * 7 + y * 13 + (x % 2 + 2 * (y % 2)) * 50) % 200 + 20;
}

/** Frame of a camera that sees (dx, dy) mirrors further. */
BufferPtr
frame (int dx, int dy)
{
  return frame_of (draw<std::uint8_t> (kWidth, kHeight,
                       [=] (int x, int y) {
                         const int u = x + dx, v = y + dy;
                         return u < kWidth && v < kHeight ? light (u, v) : 0;
                       }),
      0);
}

class DemuxMapping : public ::testing::Test
{
protected:
  ~DemuxMapping () override { std::filesystem::remove (path); }

  std::string save (const std::string &text)
  {
    std::ofstream (path) << text;
    return path.string ();
  }
  /** The first subframe of @p coded. */
  static Image<std::uint8_t> subframe (ElementHarness &demux, BufferPtr coded)
  {
    EXPECT_EQ (demux.push (std::move (coded)), GST_FLOW_OK);
    const BufferPtr out = demux.pull ();
    EXPECT_TRUE (out);
    return out ? image_of<std::uint8_t> (out.get (), demux.pad_caps ().get ())
               : Image<std::uint8_t> ();
  }
  static Image<std::uint8_t> aligned ()
  {
    ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
    demux.set_caps (gray_caps (kWidth, kHeight));
    return subframe (demux, frame (0, 0));
  }
  static std::string demux_with (const std::string &mapping)
  {
    return "codedexposure-demux schedule=sequential:2x2 mapping=" + mapping;
  }

  std::filesystem::path path =
      std::filesystem::temp_directory_path () /
      ("cexp-demux-mapping-" + std::to_string (getpid ()) + ".json");
};

} // namespace

TEST_F (DemuxMapping, OfAnAlignedBenchChangesNothing)
{
  ElementHarness demux (demux_with (save (shifted (0, 0).to_json ())));
  demux.set_caps (gray_caps (kWidth, kHeight));
  EXPECT_EQ (subframe (demux, frame (0, 0)), aligned ());
  const auto said = demux.posted<MirrorsSeen> ();
  ASSERT_TRUE (said);
  EXPECT_EQ (said->exact, guint64 (kWidth * kHeight));
  EXPECT_EQ (said->mixed, 0u);
  EXPECT_EQ (counter_of (demux.element (), "mirrors-mixed"), 0u);
}

TEST_F (DemuxMapping, FindsElementsThatStandElsewhere)
{
  ElementHarness demux (demux_with (save (shifted (5, 3).to_json ())));
  demux.set_caps (gray_caps (kWidth, kHeight));
  const Image<std::uint8_t> found = subframe (demux, frame (5, 3));
  const Image<std::uint8_t> wanted = aligned ();
  ASSERT_EQ (found.width (), wanted.width ());
  ASSERT_EQ (found.height (), wanted.height ());
  /* The camera does not see the first 5 columns and 3 rows of mirrors. */
  for (int y = 2; y < wanted.height (); y++)
    for (int x = 3; x < wanted.width (); x++)
      ASSERT_EQ (found.at (x, y), wanted.at (x, y)) << x << ", " << y;
  const auto said = demux.posted<MirrorsSeen> ();
  ASSERT_TRUE (said);
  EXPECT_EQ (said->exact, guint64 ((kWidth - 5) * (kHeight - 3)));
  EXPECT_EQ (
      said->unseen, guint64 (kWidth * kHeight - (kWidth - 5) * (kHeight - 3)));
  EXPECT_EQ (counter_of (demux.element (), "mirrors-unseen"), said->unseen);
}

TEST_F (DemuxMapping, KeepsWithinTheBitsThatFramesSay)
{
  ElementHarness demux (demux_with (save (shifted (0.3, 0.3).to_json ())));
  demux.set_caps (gray_caps (kWidth, kHeight, "25/1", "GRAY16_LE"));
  BufferPtr coded = frame_of (
      draw<std::uint16_t> (kWidth, kHeight,
          [] (int x, int y) { return (x / 6 + y / 6) % 2 ? 4095 : 0; }),
      0);
  gst::set_frame_meta (coded.get (), {.bits = 12});
  ASSERT_EQ (demux.push (std::move (coded)), GST_FLOW_OK);
  int largest = 0;
  for (int k = 0; k < 4; k++) {
    const BufferPtr out = demux.pull ();
    ASSERT_TRUE (out);
    const auto image =
        image_of<std::uint16_t> (out.get (), demux.pad_caps ().get ());
    for (int y = 0; y < image.height (); y++)
      for (int x = 0; x < image.width (); x++)
        largest = std::max (largest, int (image.at (x, y)));
  }
  EXPECT_EQ (largest, 4095) << "sharpened edges are clamped to what fits";
}

TEST_F (DemuxMapping, SaysThatPixelsSeeSeveralMirrors)
{
  ElementHarness demux (demux_with (save (shifted (0.5, 0.5).to_json ())));
  demux.set_caps (gray_caps (kWidth, kHeight));
  subframe (demux, frame (0, 0));
  const auto said = demux.posted<MirrorsSeen> ();
  ASSERT_TRUE (said);
  EXPECT_EQ (said->exact, 0u);
  EXPECT_GT (said->mixed, guint64 ((kWidth - 2) * (kHeight - 2)));
  EXPECT_EQ (counter_of (demux.element (), "mirrors-mixed"), said->mixed);
}

TEST_F (DemuxMapping, ComesWithTheTag)
{
  ElementHarness demux ("codedexposure-demux");
  demux.set_caps (gray_caps (kWidth, kHeight));
  ASSERT_TRUE (demux.push_event (setup_to_event ({Schedule (), {}})));
  EXPECT_EQ (subframe (demux, frame (0, 0)), aligned ());
  while (demux.pull ())
    ;
  ASSERT_TRUE (
      demux.push_event (setup_to_event ({Schedule (), shifted (5, 3)})));
  const Image<std::uint8_t> found = subframe (demux, frame (5, 3));
  EXPECT_EQ (found.at (10, 10), aligned ().at (10, 10));
  EXPECT_EQ (found.at (0, 0), 0);
}

TEST_F (DemuxMapping, OfOtherFramesIsRefused)
{
  ElementHarness demux (demux_with (save (shifted (0, 0).to_json ())));
  demux.set_caps (gray_caps (kWidth, kHeight + 2));
  EXPECT_EQ (demux.push (frame_of (draw<std::uint8_t> (kWidth, kHeight + 2,
                                       [] (int, int) { return 0; }),
                 0)),
      GST_FLOW_NOT_NEGOTIATED);
  EXPECT_EQ (
      demux.error (), "The mapping " + path.string () +
                          " is for frames of 64x48 pixels, but these have "
                          "64x50. Measure a new mapping with moirecalib or "
                          "\"codedexposure calibrate\".");
}

TEST_F (DemuxMapping, OfOtherFramesInTheTagIsLeftOut)
{
  ElementHarness demux ("codedexposure-demux");
  demux.set_caps (gray_caps (kWidth, kHeight + 2));
  demux.push_event (setup_to_event ({Schedule (), shifted (5, 3)}));
  EXPECT_EQ (demux.push (frame_of (draw<std::uint8_t> (kWidth, kHeight + 2,
                                       [] (int, int) { return 0; }),
                 0)),
      GST_FLOW_OK);
  EXPECT_NE (demux.warning ().find ("Do not scale or crop coded frames"),
      std::string::npos);
}

TEST_F (DemuxMapping, ThatCannotBeReadIsAnError)
{
  for (const char *text : {"{}", "nonsense"}) {
    ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
    demux.set_caps (gray_caps (kWidth, kHeight));
    g_object_set (demux.element (), "mapping", save (text).c_str (), nullptr);
    EXPECT_EQ (demux.push (frame (0, 0)), GST_FLOW_NOT_NEGOTIATED);
    EXPECT_EQ (demux.error ().find (
                   "The mapping property (or --mapping) cannot be read: "),
        0u);
  }
}

TEST_F (DemuxMapping, IsReadAgainWhenARunBegins)
{
  const std::string path = save ("nonsense");
  const ObjectPtr<GstElement> demux (GST_ELEMENT (gst_object_ref_sink (
      gst_element_factory_make ("codedexposure-demux", nullptr))));
  g_object_set (demux.get (), "mapping", path.c_str (), nullptr);
  EXPECT_EQ (gst_element_set_state (demux.get (), GST_STATE_READY),
      GST_STATE_CHANGE_FAILURE);
  EXPECT_EQ (save (shifted (1, 0).to_json ()), path);
  EXPECT_EQ (gst_element_set_state (demux.get (), GST_STATE_READY),
      GST_STATE_CHANGE_SUCCESS);
  gst_element_set_state (demux.get (), GST_STATE_NULL);
}
