/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-view: display values for all depths. */
#include "common/meta.h"
#include "common/tag.h"
#include "harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr int kWidth = 7, kHeight = 3;

std::string
caps (const char *format)
{
  return gray_caps (kWidth, kHeight, "30000/1001", format);
}

/** The output for a picture with @p value everywhere. */
template <typename Pixel>
int
shown (const std::string &settings, int value, int meta_bits)
{
  ElementHarness h ("codedexposure-view " + settings);
  h.set_caps (caps (sizeof (Pixel) == 1 ? "GRAY8" : "GRAY16_LE"));
  BufferPtr picture = frame_of (
      draw<Pixel> (kWidth, kHeight, [value] (int, int) { return value; }),
      GST_SECOND);
  set_frame_meta (picture.get (), {.frame = 9, .bits = meta_bits});
  EXPECT_EQ (h.push (std::move (picture)), GST_FLOW_OK);
  const BufferPtr out = h.pull ();
  EXPECT_TRUE (same_caps (h.pad_caps ().get (), caps ("GRAY8")));
  EXPECT_EQ (GST_BUFFER_PTS (out.get ()), GST_SECOND);
  EXPECT_EQ (get_frame_meta (out.get ())->frame, 9u);
  const auto image = image_of<std::uint8_t> (out.get (), h.pad_caps ().get ());
  for (int y = 0; y < kHeight; y++)
    for (int x = 0; x < kWidth; x++)
      EXPECT_EQ (image.at (x, y), image.at (0, 0));
  return image.at (0, 0);
}

} // namespace

/* As in a recording without a track. */
TEST (View, BitsOfTheTagCountWhereFramesHaveNoMeta)
{
  ElementHarness h ("codedexposure-view");
  h.set_caps (caps ("GRAY16_LE"));
  StreamSetup setup;
  setup.bits = 12;
  const auto white = [&] {
    EXPECT_EQ (h.push (frame_of (draw<std::uint16_t> (kWidth, kHeight,
                                     [] (int, int) { return 4095; }),
                   0)),
        GST_FLOW_OK);
    const BufferPtr out = h.pull ();
    return int (
        image_of<std::uint8_t> (out.get (), h.pad_caps ().get ()).at (0, 0));
  };
  EXPECT_EQ (white (), 16);
  ASSERT_TRUE (h.push_event (setup_to_event (setup)));
  EXPECT_EQ (white (), 255);
  ASSERT_TRUE (h.push_event (gst_event_new_tag (
      gst_tag_list_new (GST_TAG_TITLE, "Another tag", nullptr))));
  EXPECT_EQ (white (), 255);
}

TEST (View, WhiteIsTheLargestValueOfTheBitsThatCount)
{
  for (const int bits : {1, 2, 7, 8, 9, 10, 12, 14, 15, 16}) {
    const int white = (1 << bits) - 1;
    const std::string set = "bits=" + std::to_string (bits);
    EXPECT_EQ (shown<std::uint16_t> (set, white, 0), 255) << bits;
    EXPECT_EQ (shown<std::uint16_t> ("", white, bits), 255) << bits;
    EXPECT_EQ (shown<std::uint16_t> ("", 0, bits), 0) << bits;
    const int half = white / 2;
    EXPECT_NEAR (
        shown<std::uint16_t> ("", half, bits), 255.0 * half / white, 0.51)
        << bits;
  }
  EXPECT_EQ (shown<std::uint16_t> ("", 65535, 0), 255);
  EXPECT_EQ (shown<std::uint16_t> ("", 32768, 0), 128);
}

TEST (View, TheUserKnowsBetterThanThePicture)
{
  EXPECT_EQ (shown<std::uint16_t> ("bits=10", 1023, 12), 255);
}

TEST (View, WhatIsBrighterThanWhiteIsWhite)
{
  EXPECT_EQ (shown<std::uint16_t> ("bits=10", 65535, 0), 255);
}

TEST (View, ADarkSceneIsStretchedToWhite)
{
  for (const int value : {0, 20, 40, 41, 200})
    EXPECT_NEAR (shown<std::uint8_t> ("white=40", value, 0),
        std::min (255.0, value * 255.0 / 40), 0.51)
        << value;
  EXPECT_NEAR (shown<std::uint16_t> ("white=1000", 500, 12), 127.5, 0.51);
  EXPECT_EQ (shown<std::uint16_t> ("bits=12 white=1000", 1000, 0), 255);
}

TEST (View, EightBitsStayAndFewerAreStretched)
{
  for (const int value : {0, 1, 127, 255}) {
    EXPECT_EQ (shown<std::uint8_t> ("", value, 0), value);
    EXPECT_EQ (shown<std::uint8_t> ("", value, 12), value);
    EXPECT_EQ (shown<std::uint8_t> ("bits=12", value, 0), value);
  }
  EXPECT_EQ (shown<std::uint8_t> ("bits=4", 15, 0), 255);
}

TEST (View, PassesEightBitsAsTheyAreAndTakesOtherCapsWhenTheyCome)
{
  ElementHarness h ("codedexposure-view");
  h.set_caps (caps ("GRAY8"));
  BufferPtr plain = frame_of (
      draw<std::uint8_t> (kWidth, kHeight, [] (int x, int y) { return x + y; }),
      0);
  GstBuffer *const same = plain.get ();
  ASSERT_EQ (h.push (std::move (plain)), GST_FLOW_OK);
  EXPECT_EQ (h.pull ().get (), same);

  h.set_caps (caps ("GRAY16_LE"));
  ASSERT_EQ (h.push (frame_of (draw<std::uint16_t> (kWidth, kHeight,
                                   [] (int, int) { return 65535; }),
                 0)),
      GST_FLOW_OK);
  const BufferPtr out = h.pull ();
  EXPECT_EQ (
      image_of<std::uint8_t> (out.get (), h.pad_caps ().get ()).at (6, 2), 255);
}

TEST (View, SaysThatAllBitsOfItsPicturesCount)
{
  ElementHarness h ("codedexposure-view");
  h.set_caps (caps ("GRAY16_LE"));
  BufferPtr picture = frame_of (
      draw<std::uint16_t> (kWidth, kHeight, [] (int, int) { return 4095; }), 0);
  set_frame_meta (picture.get (), {.bits = 12});
  ASSERT_EQ (h.push (std::move (picture)), GST_FLOW_OK);
  EXPECT_EQ (get_frame_meta (h.pull ().get ())->bits, 0);
}
