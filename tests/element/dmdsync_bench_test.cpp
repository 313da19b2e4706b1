/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync after the simulated bench whose mirrors it controls: a slip of the
 * DMD is detected, reported, flagged and corrected. */
#include <algorithm>
#include <cstdlib>

#include "dmd/simulated_dmd.h"
#include "sync_bench.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

constexpr const char *kOptics =
    " full-well=10000 read-noise=5 psf-sigma=0.5 seed=3 ";

/** A bench with a DMD that slips, and one that does not. */
struct Benches {
  Bench slipping;
  Bench steady;

  Benches (const std::string &schedule, const std::string &slips)
      : slipping (schedule, "codedexposure-sim dmd=sim:bench" +
                                std::string (kOptics) +
                                "! dmdsync name=sync device=sim:bench" + slips +
                                " schedule=" + schedule),
        steady (schedule,
            "codedexposure-sim schedule=" + schedule + kOptics + " ! identity")
  {
  }
};

std::string
pixels (const BufferPtr &buffer)
{
  if (!buffer)
    return "";
  std::string bytes (gst_buffer_get_size (buffer.get ()), '\0');
  gst_buffer_extract (buffer.get (), 0, bytes.data (), bytes.size ());
  return bytes;
}

/** Whether @p frame is flagged as one without synchronisation. */
bool
is_flagged (const BufferPtr &frame)
{
  const auto meta = get_frame_meta (frame.get ());
  const bool flagged = !meta || meta->locked == false;
  EXPECT_EQ (GST_BUFFER_FLAG_IS_SET (frame.get (), GST_BUFFER_FLAG_CORRUPTED),
      flagged);
  return flagged;
}

bool
is_known (const BufferPtr &frame)
{
  const auto meta = get_frame_meta (frame.get ());
  return meta && meta->locked == true;
}

/** Checks a run with a slip in frame @p at. */
void
expect_noticed_and_mended (
    Benches &benches, const Scene &scene, int at, int blind_frames)
{
  int flagged = 0;
  bool mended = false;
  for (int f = 0; f < 20'000 && !mended; f++) {
    const BufferPtr frame = benches.slipping.next (scene);
    const BufferPtr truth = benches.steady.next (scene);
    ASSERT_TRUE (frame && truth);
    EXPECT_EQ (GST_BUFFER_PTS (frame.get ()), GST_BUFFER_PTS (truth.get ()));
    EXPECT_EQ (GST_BUFFER_OFFSET (frame.get ()), guint64 (f));
    const bool right = pixels (frame) == pixels (truth);
    const bool is_bad = is_flagged (frame);
    EXPECT_TRUE (right || is_bad || (f >= at && f < at + blind_frames))
        << "frame " << f << " is wrong and not flagged";
    EXPECT_TRUE (right || !is_known (frame))
        << "frame " << f << " is wrong and known to be right";
    EXPECT_TRUE (!is_bad || f >= at) << "frame " << f << " is flagged";
    flagged += is_bad;
    mended = flagged > 0 && !is_bad;
  }
  EXPECT_TRUE (mended);

  /* And stays so. */
  for (int f = 0; f < 50; f++) {
    const BufferPtr frame = benches.slipping.next (scene);
    EXPECT_EQ (pixels (frame), pixels (benches.steady.next (scene)));
    EXPECT_FALSE (is_flagged (frame));
  }
  const auto slips = benches.slipping.messages ("dmdsync/slip");
  ASSERT_EQ (slips.size (), 1u);
  EXPECT_GE (uint64_field (slips[0], "frame"), guint64 (at));
  EXPECT_LE (uint64_field (slips[0], "frame"), guint64 (at + 2));
  EXPECT_EQ (benches.slipping.messages ("dmdsync/slip-over").size (), 1u);
  EXPECT_EQ (benches.slipping.counter ("slips"), 1u);
  EXPECT_EQ (benches.slipping.counter ("frames-lost"), 0u);
}

class StaircaseSlip : public ::testing::TestWithParam<std::pair<int, int>>
{
};

TEST_P (StaircaseSlip, InsideTheExposureIsFlaggedInItsFrameAndMended)
{
  const auto [slot, by] = GetParam ();
  Benches benches ("staircase:2x2",
      ",slip-at=" + std::to_string (4 * 30 + slot) + ":" + std::to_string (by));
  expect_noticed_and_mended (benches, moving, 30, 0);
  const auto slips = benches.slipping.messages ("dmdsync/slip");
  ASSERT_EQ (slips.size (), 1u);
  EXPECT_EQ (uint64_field (slips[0], "frame"), 30u);
  EXPECT_EQ (uint64_field (slips[0], "pts"), 30 * 40 * GST_MSECOND);
  gboolean certain = FALSE;
  gst_structure_get_boolean (
      gst_message_get_structure (slips[0].get ()), "certain", &certain);
  EXPECT_TRUE (!certain || int_field (slips[0], "slots") == by);
}

INSTANTIATE_TEST_SUITE_P (Slots, StaircaseSlip,
    ::testing::Values (std::pair (1, 1), std::pair (2, 1), std::pair (3, 1),
        std::pair (1, -1), std::pair (2, -1), std::pair (3, -1)));

class PilotSlip : public ::testing::TestWithParam<std::pair<int, int>>
{
};

/* Also exactly between two exposures, where only the pilot shows the slip. */
TEST_P (PilotSlip, AnywhereIsNoticedWithinThreeFramesAndMended)
{
  const auto [slot, by] = GetParam ();
  Benches benches ("sequential:2x2,pilot=8",
      ",slip-at=" + std::to_string (4 * 30 + slot) + ":" + std::to_string (by));
  expect_noticed_and_mended (benches, kMains, 30, 2);
  const auto slips = benches.slipping.messages ("dmdsync/slip");
  ASSERT_EQ (slips.size (), 1u);
  EXPECT_EQ (int_field (slips[0], "slots"), by);
  EXPECT_LE (uint64_field (slips[0], "pts"), 32 * 40 * GST_MSECOND);
}

INSTANTIATE_TEST_SUITE_P (Slots, PilotSlip,
    ::testing::Values (std::pair (0, 1), std::pair (1, 1), std::pair (2, 1),
        std::pair (3, 1), std::pair (0, -1), std::pair (1, -1),
        std::pair (2, -1), std::pair (3, -1)));

TEST (DmdsyncBench, EverySlipOfManyIsMended)
{
  Bench bench ("staircase:2x2",
      "codedexposure-sim dmd=sim:many ! dmdsync name=sync "
      "device=sim:many,slip-at=41,slip-at=4003:-1,slip-at=8003:2 "
      "schedule=staircase:2x2");
  while (bench.frames () < 2500)
    ASSERT_TRUE (bench.next (moving));
  EXPECT_EQ (bench.messages ("dmdsync/slip").size (), 3u);
  EXPECT_EQ (bench.messages ("dmdsync/slip-over").size (), 3u);
  EXPECT_FALSE (is_flagged (bench.next (moving)));
}

TEST (DmdsyncBench, SceneAndLightRaiseNoAlarm)
{
  for (const char *schedule :
      {"staircase:2x2", "s-matrix:7x1", "sequential:2x2,pilot=8"}) {
    SCOPED_TRACE (schedule);
    Bench bench (schedule,
        "codedexposure-sim dmd=sim:calm" + std::string (kOptics) +
            "! dmdsync name=sync device=sim:calm schedule=" + schedule);
    for (int f = 0; f < 500; f++)
      EXPECT_FALSE (is_flagged (bench.next (kMains))) << f;
    EXPECT_TRUE (bench.messages ("dmdsync/slip").empty ());
    EXPECT_EQ (bench.messages ("dmdsync/locked").size (),
        Schedule::parse (schedule)->pilot_rows () > 0 ? 1u : 0u);
  }
}

/** The pictures of a film, one for each slot; it stores one at a time. */
class Film
{
public:
  explicit Film (const std::string &location)
      : pipeline_ (GST_ELEMENT (gst_object_ref_sink (gst_parse_launch (
            ("filesrc location=" + location +
                " ! decodebin ! videoconvert ! videoscale ! "
                "video/x-raw,format=GRAY8,width=" +
                std::to_string (kWidth) +
                ",height=" + std::to_string (kHeight) +
                " ! appsink name=film sync=false max-buffers=4")
                .c_str (),
            nullptr)))),
        film_ (gst_bin_get_by_name (GST_BIN (pipeline_.get ()), "film"))
  {
    gst_element_set_state (pipeline_.get (), GST_STATE_PLAYING);
  }
  ~Film () { gst_element_set_state (pipeline_.get (), GST_STATE_NULL); }

  void draw (ImageView<std::uint8_t> out)
  {
    GstSample *sample = gst_app_sink_pull_sample (GST_APP_SINK (film_.get ()));
    ASSERT_TRUE (sample) << "the film is over";
    const Image<std::uint8_t> picture = image_of<std::uint8_t> (
        gst_sample_get_buffer (sample), gst_sample_get_caps (sample));
    gst_sample_unref (sample);
    for (int y = 0; y < out.height; y++)
      std::copy_n (picture.view ().row (y), out.width, out.row (y));
  }

private:
  ObjectPtr<GstElement> pipeline_, film_;
};

TEST (DmdsyncBench, OnRealFootageOnlyTheSlipIsASlip)
{
  const char *clip = std::getenv ("SAMPLE_CLIP");
  if (!clip || !g_file_test (clip, G_FILE_TEST_EXISTS))
    GTEST_SKIP () << "the sample clip was not fetched";
  for (const std::string schedule :
      {"staircase:2x2", "sequential:2x2,pilot=8"}) {
    SCOPED_TRACE (schedule);
    Film film (clip);
    const Scene scene = [&] (std::int64_t, ImageView<std::uint8_t> out) {
      film.draw (out);
    };
    Bench bench (schedule,
        "codedexposure-sim dmd=sim:film" + std::string (kOptics) +
            "! dmdsync name=sync device=sim:film,slip-at=402 schedule=" +
            schedule);
    for (int f = 0; f < 190; f++)
      ASSERT_TRUE (bench.next (scene));
    const auto slips = bench.messages ("dmdsync/slip");
    ASSERT_EQ (slips.size (), 1u);
    EXPECT_EQ (uint64_field (slips[0], "frame"), 100u);
    EXPECT_EQ (int_field (slips[0], "slots"), 1);
    EXPECT_EQ (bench.messages ("dmdsync/slip-over").size (), 1u);
  }
}

TEST (DmdsyncBench, WithoutAPilotAOneHotCodeHidesASlipAndSaysSoFirst)
{
  Bench bench ("sequential:2x2",
      "codedexposure-sim dmd=sim:blind ! "
      "dmdsync name=sync device=sim:blind,slip-at=42 schedule=sequential:2x2");
  for (int f = 0; f < 30; f++)
    EXPECT_EQ (get_frame_meta (bench.next (still).get ())->locked, std::nullopt)
        << f;
  EXPECT_TRUE (bench.messages ("dmdsync/slip").empty ());
  EXPECT_TRUE (bench.messages ("dmdsync/locked").empty ());
}

TEST (DmdsyncBench, AStaircaseHidesASlipBetweenTwoExposures)
{
  Bench bench ("staircase:2x2",
      "codedexposure-sim dmd=sim:between ! dmdsync name=sync "
      "device=sim:between,slip-at=40 schedule=staircase:2x2");
  for (int f = 0; f < 30; f++)
    EXPECT_EQ (get_frame_meta (bench.next (still).get ())->locked, std::nullopt)
        << f;
  EXPECT_TRUE (bench.messages ("dmdsync/locked").empty ());
}

TEST (DmdsyncBench, AFailedRestartIsAnError)
{
  Bench bench ("staircase:2x2",
      "codedexposure-sim dmd=sim:dead ! dmdsync name=sync "
      "device=sim:dead,slip-at=42,fail=restart schedule=staircase:2x2");
  for (int f = 0; f < 11; f++)
    ASSERT_TRUE (bench.next (still));
  EXPECT_NE (bench.wait_error ().find ("restart failed"), std::string::npos);
  EXPECT_FALSE (SimulatedMirrors::find ("dead")->running ());
}

TEST (DmdsyncBench, FlagsReachTheSubframes)
{
  Bench bench ("staircase:2x2",
      "codedexposure-sim dmd=sim:flags ! dmdsync name=sync "
      "device=sim:flags,slip-at=22 schedule=staircase:2x2 ! "
      "codedexposure-demux");
  for (int f = 0; f < 6; f++)
    bench.expose (still);
  for (int k = 0; k < 24; k++) {
    const BufferPtr subframe = bench.pull ();
    ASSERT_TRUE (subframe);
    EXPECT_EQ (
        GST_BUFFER_PTS (subframe.get ()), guint64 (k) * 10 * GST_MSECOND);
    EXPECT_EQ (
        GST_BUFFER_FLAG_IS_SET (subframe.get (), GST_BUFFER_FLAG_CORRUPTED),
        k >= 20);
  }
}

} // namespace
