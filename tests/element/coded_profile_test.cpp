/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux and codedexposure-fuse use the profile of the bench. */
#include "bench_file.h"
#include "common/tag.h"
#include "demux_schedule.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr Extent kFrame = {24, 24};

GstEvent *
tag_with (const BenchProfile &profile, const std::string &schedule)
{
  StreamSetup setup{schedule_of (schedule)};
  setup.bench = profile;
  return setup_to_event (setup);
}

/* What @element makes of two frames of the picture less @black; @profile, if
 * there is one, comes with the tag. */
std::vector<Image<std::uint8_t>>
pictures_of (const std::string &element, int black = 0,
    const std::optional<BenchProfile> &profile = {})
{
  ElementHarness filter (element);
  filter.set_caps (gray_caps (kFrame.width, kFrame.height));
  if (profile)
    filter.push_event (tag_with (*profile, "sequential:2x2"));
  const Image<std::uint8_t> whole = picture ();
  const auto light = draw<std::uint8_t> (kFrame.width, kFrame.height,
      [&] (int x, int y) { return std::max (0, whole.at (x, y) - black); });
  for (int frame = 0; frame < 2; frame++)
    EXPECT_EQ (
        filter.push (frame_of (light, GstClockTime (frame) * 40 * GST_MSECOND)),
        GST_FLOW_OK)
        << filter.error ();
  filter.push_event (gst_event_new_eos ());
  return pull_images (filter);
}

std::string
error_of (ElementHarness &demux)
{
  demux.set_caps (gray_caps (kFrame.width, kFrame.height));
  EXPECT_EQ (demux.push (frame_of (picture (), 0)), GST_FLOW_NOT_NEGOTIATED);
  return demux.error ();
}

TEST (CodedProfile, ItsBlackLevelIsNoLight)
{
  BenchProfile profile = profile_of (kFrame);
  profile.black_level = Measured{15.6, 0.1};
  const BenchFile file (profile);
  for (const std::string element :
      {"codedexposure-demux method=decode schedule=sequential:2x2",
          "codedexposure-fuse schedule=sequential:2x2"}) {
    const auto expected = pictures_of (element, 16);
    EXPECT_NE (pictures_of (element), expected);
    EXPECT_EQ (pictures_of (element + " bench=" + file.path ()), expected);
    EXPECT_EQ (pictures_of (element, 0, profile), expected) << "by the tag";
  }
}

TEST (CodedProfile, SaturatedPixelsStaySaturated)
{
  BenchProfile profile = profile_of (kFrame);
  profile.black_level = Measured{16, 0.1};
  ElementHarness demux ("codedexposure-demux");
  demux.set_caps (gray_caps (kFrame.width, kFrame.height));
  demux.push_event (tag_with (profile, "sequential:2x2"));
  ASSERT_EQ (
      demux.push (frame_of (
          draw<std::uint8_t> (24, 24, [] (int x, int) { return 255 - x; }), 0)),
      GST_FLOW_OK);
  EXPECT_EQ (pull_images (demux).at (0).at (0, 0), 255);
  EXPECT_EQ (counter_of (demux.element (), "saturated-frames"), 1u);
}

TEST (CodedProfile, ItsLeakIsThatOfTheSchedule)
{
  BenchProfile profile = profile_of (kFrame);
  profile.leak = Measured{0.02, 0.001};
  const auto leaky =
      pictures_of ("codedexposure-demux schedule=sequential:2x2,leak=0.02");
  EXPECT_EQ (pictures_of ("codedexposure-demux", 0, profile), leaky);
  const auto by_hand =
      pictures_of ("codedexposure-demux schedule=sequential:2x2,leak=0.1");
  EXPECT_EQ (
      pictures_of (
          "codedexposure-demux schedule=sequential:2x2,leak=0.1", 0, profile),
      by_hand);
}

TEST (CodedProfile, ItsNoiseIsThatOfFusion)
{
  BenchProfile profile = profile_of (kFrame);
  profile.conversion_gain = Measured{1.0, 0.01};
  profile.read_noise = Measured{5.0, 0.1};
  /* 255 electrons make white in one slot of four. */
  const auto told =
      pictures_of ("codedexposure-fuse schedule=sequential:2x2 full-well=1020 "
                   "read-noise=5");
  EXPECT_EQ (pictures_of ("codedexposure-fuse", 0, profile), told);
  const auto noise_free =
      pictures_of ("codedexposure-fuse schedule=sequential:2x2 full-well=0");
  EXPECT_NE (told, noise_free);
  EXPECT_EQ (
      pictures_of ("codedexposure-fuse full-well=0", 0, profile), noise_free)
      << "what is set by hand wins";
}

TEST (CodedProfile, ItsMappingIsUsed)
{
  BenchProfile profile = profile_of (kFrame);
  profile.mapping =
      *Mapping::make ({kFrame, kFrame, {1, 0, 3, 0, 1, 0, 0, 0, 1}});
  ElementHarness demux ("codedexposure-demux");
  demux.set_caps (gray_caps (kFrame.width, kFrame.height));
  demux.push_event (tag_with (profile, "sequential:2x2"));
  ASSERT_EQ (demux.push (frame_of (picture (), 0)), GST_FLOW_OK);
  EXPECT_EQ (counter_of (demux.element (), "mirrors-unseen"), 3u * 24u);
}

/* Text and file mean the same, and the property wins over the tag. */
TEST (CodedProfile, CanBeAText)
{
  BenchProfile profile = profile_of (kFrame);
  profile.leak = Measured{0.03, 0.001};
  ElementHarness demux ("codedexposure-demux");
  g_object_set (
      demux.element (), "bench", profile.to_json ().c_str (), nullptr);
  demux.set_caps (gray_caps (kFrame.width, kFrame.height));
  profile.leak = Measured{0.05, 0.001};
  demux.push_event (tag_with (profile, "sequential:2x2"));
  ASSERT_EQ (demux.push (frame_of (picture (), 0)), GST_FLOW_OK);
  EXPECT_EQ (in_force (demux), "sequential:2x2,leak=0.03");
  EXPECT_EQ (demux.warning (), "");
}

TEST (CodedProfile, OfAnotherBenchIsRefused)
{
  BenchProfile profile = profile_of ({24, 20});
  {
    ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
    g_object_set (
        demux.element (), "bench", profile.to_json ().c_str (), nullptr);
    EXPECT_NE (error_of (demux).find ("The bench profile does not fit: the "
                                      "frames have 24x24 pixels"),
        std::string::npos);
  }
  profile = profile_of (kFrame, 12);
  {
    ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
    g_object_set (
        demux.element (), "bench", profile.to_json ().c_str (), nullptr);
    EXPECT_NE (
        error_of (demux).find ("the frames have 8 bits"), std::string::npos);
  }
  profile = profile_of (kFrame);
  profile.camera.serial = "A";
  ElementHarness demux ("codedexposure-demux");
  g_object_set (
      demux.element (), "bench", profile.to_json ().c_str (), nullptr);
  demux.set_caps (gray_caps (kFrame.width, kFrame.height));
  profile.camera.serial = "B";
  demux.push_event (tag_with (profile, "sequential:2x2"));
  EXPECT_EQ (demux.push (frame_of (picture (), 0)), GST_FLOW_NOT_NEGOTIATED);
  EXPECT_NE (demux.error ().find ("serial number 'A', but this is 'B'"),
      std::string::npos);
}

/* Frames that were cropped on purpose are decoded with the schedule property,
 * and the tag cannot be changed. */
TEST (CodedProfile, OfTheTagIsLeftOutForCroppedFrames)
{
  BenchProfile profile = profile_of ({48, 24});
  profile.leak = Measured{0.05, 0.001};
  ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
  demux.set_caps (gray_caps (kFrame.width, kFrame.height));
  demux.push_event (tag_with (profile, "sequential:2x2"));
  ASSERT_EQ (demux.push (frame_of (picture (), 0)), GST_FLOW_OK);
  EXPECT_EQ (in_force (demux), "sequential:2x2");
  EXPECT_NE (demux.warning ().find ("is not used: the frames have 24x24"),
      std::string::npos);
}

TEST (CodedProfile, IsSaidToBeOldOnce)
{
  BenchProfile profile = profile_of (kFrame);
  profile.measured -= std::chrono::days (40);
  ElementHarness demux ("codedexposure-demux schedule=sequential:2x2");
  g_object_set (
      demux.element (), "bench", profile.to_json ().c_str (), nullptr);
  for (const char *rate : {"25/1", "50/1"}) {
    demux.set_caps (gray_caps (kFrame.width, kFrame.height, rate));
    ASSERT_EQ (demux.push (frame_of (picture (), 0)), GST_FLOW_OK);
  }
  EXPECT_NE (demux.warning ().find ("measured 40 days ago"), std::string::npos);
  EXPECT_EQ (demux.warning ().find ("measured"), std::string::npos);
  /* That of a recording was measured when it was made. */
  ElementHarness later ("codedexposure-demux");
  later.set_caps (gray_caps (kFrame.width, kFrame.height));
  later.push_event (tag_with (profile, "sequential:2x2"));
  ASSERT_EQ (later.push (frame_of (picture (), 0)), GST_FLOW_OK);
  EXPECT_EQ (later.warning (), "");
}

} // namespace
