/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-sim with a simulated DMD that the test controls. */
#include "dmd/simulated_dmd.h"
#include "mirrors.h"
#include "sim_harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

TEST (SimDmd, ParkedMirrorsAreDarkAndSaidOnce)
{
  const auto mirrors = SimulatedMirrors::find ("parked");
  SimHarness sim ("dmd=sim:parked");
  sim.start (2, 2);
  for (int k = 0; k < 8; k++)
    ASSERT_EQ (sim.send (k, 200), GST_FLOW_OK);
  EXPECT_EQ (sim.coded (), (flat<std::uint8_t> (2, 2, 0)));
  EXPECT_EQ (sim.coded (), (flat<std::uint8_t> (2, 2, 0)));
  EXPECT_NE (sim.warning ().find ("parked"), std::string::npos);
  EXPECT_EQ (sim.warning (), "");
}

TEST (SimDmd, FewerMirrorsThanPixelsAreRefused)
{
  const auto small = *open_simulated_dmd ("sim:small,size=4x2");
  SimHarness sim ("dmd=sim:small");
  sim.start (4, 4);
  EXPECT_EQ (sim.send (0, 200), GST_FLOW_ERROR);
  const std::string error = sim.error ();
  EXPECT_NE (error.find ("4x2 mirrors"), std::string::npos) << error;
  EXPECT_NE (error.find ("set size=4x4"), std::string::npos) << error;
}

TEST (SimDmd, MoreMirrorsThanPixelsAreUsed)
{
  const auto large = *open_simulated_dmd ("sim:large,size=8x4");
  SimHarness sim ("dmd=sim:large");
  sim.start (4, 4);
  EXPECT_EQ (sim.send (0, 200), GST_FLOW_OK);
}

TEST (SimDmd, ParkedMirrorsLeak)
{
  const auto mirrors = SimulatedMirrors::find ("leaking");
  mirrors->program (*Schedule::parse ("sequential:2x2,leak=0.25"));
  SimHarness sim ("dmd=sim:leaking");
  sim.start (2, 2);
  /* 4 slots of 0.25 x 140, where white needs 1.75 slots. */
  EXPECT_EQ (elements_of (sim, {140, 140, 140, 140}),
      (std::vector<int>{80, 80, 80, 80}));
}

TEST (SimDmd, ShowsWhatTheMirrorsWereProgrammedWith)
{
  const auto mirrors = SimulatedMirrors::find ("programmed");
  mirrors->program (*Schedule::parse ("staircase:2x2"));
  mirrors->start ();
  SimHarness sim ("dmd=sim:programmed schedule=sequential:3x3");
  sim.start (2, 2);
  EXPECT_EQ (elements_of (sim, {200, 100, 40, 20}),
      (std::vector<int>{50, 75, 85, 90}));
  EXPECT_EQ (sim.warning (), "");
}

TEST (SimDmd, SlipOfTheMirrorsIsSeen)
{
  const auto mirrors = SimulatedMirrors::find ("slipping");
  mirrors->program (Schedule ());
  mirrors->start ();
  mirrors->slip_at (4, 1);
  SimHarness sim ("dmd=sim:slipping");
  sim.start (2, 2);
  for (int k = 0; k < 8; k++)
    sim.send (k, 10 * (k + 1));
  EXPECT_EQ (sim.coded ().at (0, 0), 10);
  EXPECT_EQ (sim.coded ().at (0, 0), 60) << "one slot late";
}

TEST (SimDmd, SlotsAreCountedThroughGaps)
{
  const auto mirrors = SimulatedMirrors::find ("counting");
  mirrors->program (Schedule ());
  mirrors->start ();
  /* The first slot of coded frame 3. */
  mirrors->slip_at (12, 1);
  SimHarness sim ("dmd=sim:counting");
  sim.start (2, 2);
  for (int k : {0, 1, 2, 3, 8, 9, 10, 11, 12, 13, 14, 15})
    sim.send (k, 10 + k);
  EXPECT_EQ (sim.coded ().at (0, 0), 10);
  EXPECT_EQ (sim.coded ().at (0, 0), 18) << "coded frame 2";
  EXPECT_EQ (sim.coded ().at (0, 0), 23) << "coded frame 3 has slipped";
}

TEST (SimDmd, FollowsAScheduleThatIsProgrammedLater)
{
  const auto mirrors = SimulatedMirrors::find ("later");
  SimHarness sim ("dmd=sim:later");
  sim.start (2, 2);
  for (int k = 0; k < 4; k++)
    sim.send (k, 200);
  EXPECT_EQ (sim.coded (), (flat<std::uint8_t> (2, 2, 0)));
  mirrors->program (*Schedule::parse ("sequential:2x1"));
  mirrors->start ();
  for (int k = 4; k < 8; k++)
    sim.send (k, k);
  EXPECT_EQ (sim.coded ().at (1, 0), 5);
  EXPECT_EQ (sim.coded ().at (1, 0), 7);
}

TEST (SimDmd, ScheduleThatComesWithANewStreamEndsTheExposure)
{
  const auto mirrors = SimulatedMirrors::find ("new stream");
  mirrors->program (*Schedule::parse ("sequential:2x2"));
  mirrors->start ();
  SimHarness sim ("dmd=\"sim:new stream\"");
  sim.start (2, 2);
  sim.send_range (0, 2);
  mirrors->program (*Schedule::parse ("sequential:2x1"));
  mirrors->start ();
  sim.push_event (gst_event_new_stream_start ("new"));
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  sim.push_event (gst_event_new_segment (&segment));
  sim.send_range (0, 2);
  EXPECT_EQ (sim.counter ("frames-dropped"), 1u);
  EXPECT_EQ (sim.counter ("frames-out"), 1u);
}

TEST (SimDmd, ShowsTheMasksOfAllRegions)
{
  const char *text = "staircase:2x2,pilot=2,region=8x4+4+2:sequential:4x2";
  const auto mirrors = SimulatedMirrors::find ("regions");
  mirrors->program (*Schedule::parse (text));
  mirrors->start ();
  SimHarness driven ("dmd=sim:regions");
  SimHarness alone ("schedule=" + std::string (text));
  for (SimHarness *sim : {&driven, &alone}) {
    sim->start (32, 12, 200);
    for (int k = 0; k < 24; k++)
      ASSERT_EQ (sim->send (k, 10 * (k % 8)), GST_FLOW_OK);
  }
  for (int frame = 0; frame < 3; frame++) {
    const auto coded = driven.coded ();
    EXPECT_EQ (coded, alone.coded ()) << "frame " << frame;
    /* 8 slots make white; the region's are open in one, the background's
     * darkest in two. */
    EXPECT_EQ (coded.at (4, 3), 5);
    EXPECT_EQ (coded.at (11, 3), 9);
    EXPECT_EQ (coded.at (0, 0), 1);
    EXPECT_EQ (coded.at (1, 1), 35);
  }
}

TEST (SimDmd, PilotTakesTwoFramesForItsMasks)
{
  const Schedule schedule = *Schedule::parse ("staircase:2x2,pilot=2");
  const auto mirrors = SimulatedMirrors::find ("pilot");
  mirrors->program (schedule);
  mirrors->start ();
  SimHarness driven ("dmd=sim:pilot");
  SimHarness alone ("schedule=staircase:2x2,pilot=2");
  const int width = 32, height = 4;
  for (SimHarness *sim : {&driven, &alone}) {
    sim->start (width, height);
    for (int k = 0; k < 12; k++)
      sim->send (k, 200);
    for (int frame = 0; frame < 3; frame++) {
      Image<std::uint8_t> light (width, height), mask (width, height);
      for (int slot = 0; slot < 4; slot++) {
        expected_mask (schedule, slot + 4 * (frame % 2), mask.view ());
        for (int y = 0; y < height; y++)
          for (int x = 0; x < width; x++)
            light.at (x, y) =
                std::uint8_t (light.at (x, y) + 50 * mask.at (x, y));
      }
      EXPECT_EQ (sim->coded (), light) << "frame " << frame;
    }
  }
}

} // namespace
