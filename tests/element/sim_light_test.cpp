/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-sim: pixel values of coded frames. */
#include <algorithm>
#include <cmath>

#include "schedule/schedule.h"
#include "sim_harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

struct Code {
  const char *preset;
  int multiple; ///< input frames a slot
};

class SimLight : public ::testing::TestWithParam<Code>
{
};

/* The mean of the input frames in slots that are on, rounded half up. */
template <typename Pixel>
void
expect_exact (const Code &code, const std::string &format, int num, int den)
{
  const Schedule schedule = *Schedule::parse (code.preset);
  const int slots = schedule.slots (), inputs = slots * code.multiple;
  const int width = 21, height = 10;
  SimHarness sim ("schedule=" + std::string (code.preset));
  gst_harness_set_sink_caps_str (
      sim.get (), gray_caps (width, height,
                      std::to_string (num) + "/" + std::to_string (den), format)
                      .c_str ());
  sim.start (width, height, num * inputs, den, format);

  for (int frame = 0; frame < 3; frame++) {
    for (int k = frame * inputs; k < (frame + 1) * inputs; k++) {
      EXPECT_FALSE (sim.pull ()) << "before its last input frame";
      ASSERT_EQ (sim.send (k, scene<Pixel> (width, height, k)), GST_FLOW_OK);
    }
    const Image<Pixel> coded = sim.coded<Pixel> ();
    const int budget = schedule.code ().max_on_slots () * code.multiple;
    for (int y = 0; y < height; y++)
      for (int x = 0; x < width; x++) {
        std::int64_t light = 0;
        for (int i = 0; i < inputs; i++)
          if (schedule.code ().on (
                  schedule.element_at (x, y), i / code.multiple))
            light += scene<Pixel> (width, height, frame * inputs + i).at (x, y);
        ASSERT_EQ (coded.at (x, y), (2 * light + budget) / (2 * budget))
            << "frame " << frame << " at " << x << ", " << y;
      }
  }
}

TEST_P (SimLight, IsExactIn8Bits)
{
  expect_exact<std::uint8_t> (GetParam (), "GRAY8", 25, 1);
  expect_exact<std::uint8_t> (GetParam (), "GRAY8", 30000, 1001);
}

TEST_P (SimLight, IsExactIn16Bits)
{
  expect_exact<std::uint16_t> (GetParam (), "GRAY16_LE", 25, 1);
}

INSTANTIATE_TEST_SUITE_P (Codes, SimLight,
    ::testing::Values (Code{"sequential:2x2", 1}, Code{"sequential:2x2", 2},
        Code{"sequential:2x2", 3}, Code{"staircase:2x2", 1},
        Code{"staircase:2x2", 2},
        Code{"sequential:lattice:8/3,order=bit-reversal", 1},
        Code{"staircase:lattice:8/3", 1}, Code{"staircase:3x3", 1},
        Code{"s-matrix:lattice:7/2", 1}));

TEST (SimLight, ReadsStridesFromTheVideoMeta)
{
  const int width = 6, height = 4, padded = 32;
  SimHarness sim;
  sim.start (width, height);
  for (int k = 0; k < 4; k++) {
    const Image<std::uint8_t> picture = scene<std::uint8_t> (width, height, k);
    BufferPtr buffer (
        gst_buffer_new_allocate (nullptr, padded * height, nullptr));
    gst_buffer_memset (buffer.get (), 0, 99, padded * height);
    for (int y = 0; y < height; y++)
      gst_buffer_fill (
          buffer.get (), y * padded, picture.view ().row (y), width);
    gsize offsets[GST_VIDEO_MAX_PLANES] = {0};
    gint strides[GST_VIDEO_MAX_PLANES] = {padded};
    gst_buffer_add_video_meta_full (buffer.get (), GST_VIDEO_FRAME_FLAG_NONE,
        GST_VIDEO_FORMAT_GRAY8, width, height, 1, offsets, strides);
    GST_BUFFER_PTS (buffer.get ()) = sim.time (k);
    ASSERT_EQ (sim.push (std::move (buffer)), GST_FLOW_OK);
  }
  const Image<std::uint8_t> coded = sim.coded ();
  const Schedule schedule;
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      EXPECT_EQ (coded.at (x, y),
          scene<std::uint8_t> (width, height, schedule.element_at (x, y))
              .at (x, y));
}

TEST (SimLight, SwitchingTakesItsTimeButNoWhite)
{
  SimHarness sim ("schedule=sequential:2x2,active=4ms,switching=6ms");
  gst_harness_set_sink_caps_str (sim.get (), gray_caps (2, 2).c_str ());
  sim.start (2, 2, 200, 1);
  /* Slots are active for 4 ms of the first of their two frames of 5 ms. */
  EXPECT_EQ (elements_of (sim, {255, 1, 101, 2, 50, 3, 77, 4}),
      (std::vector<int>{255, 101, 50, 77}));
}

TEST (SimLight, SlotsThatSpanInputFramesMixThem)
{
  SimHarness sim ("schedule=sequential:2x2,readout=10ms");
  sim.start (2, 2);
  /* Slots of 7.5 ms over frames of 10 ms; the last frame falls into readout. */
  EXPECT_EQ (elements_of (sim, {30, 90, 210, 255}),
      (std::vector<int>{30, 70, 130, 210}));
}

TEST (SimLight, ShutMirrorsLeak)
{
  SimHarness sim ("schedule=sequential:2x2,leak=0.1");
  sim.start (2, 2);
  /* (own + 0.1 others) / 1.3 */
  EXPECT_EQ (
      elements_of (sim, {130, 0, 0, 26}), (std::vector<int>{102, 12, 12, 30}));
}

TEST (SimLight, TheOtherBeamHasTheRestOfTheLight)
{
  SimHarness sim ("schedule=sequential:2x2 beam=off");
  sim.start (2, 2);
  /* The mean of the three slots in which the mirror is off. */
  EXPECT_EQ (elements_of (sim, {30, 90, 210, 0}),
      (std::vector<int>{100, 80, 40, 110}));
}

TEST (SimLight, MirrorsAreOffBetweenTheMasks)
{
  SimHarness sim (
      "schedule=sequential:2x2,active=4ms,switching=6ms beam=off gain=0.5");
  gst_harness_set_sink_caps_str (sim.get (), gray_caps (2, 2).c_str ());
  sim.start (2, 2, 200, 1);
  /* Slots have 4 ms of the first of two frames of 5 ms; all mirrors are off for
   * a quarter of a slot in it and for 5/4 of a slot in the other, which makes
   * 118. A half of a fourth of (64 + 0 + 96 + 118), ... */
  EXPECT_EQ (elements_of (sim, {32, 8, 64, 16, 0, 0, 96, 32}),
      (std::vector<int>{35, 31, 39, 27}));
}

TEST (SimLight, WhiteStaysWhite)
{
  for (const char *schedule : {"sequential:2x2,leak=0.1", "sequential:2x2",
           "sequential:2x2,active=4ms,switching=1ms",
           "sequential:2x2,readout=11ms"}) {
    SimHarness sim ("schedule=" + std::string (schedule));
    sim.start (2, 2);
    EXPECT_EQ (elements_of (sim, {255, 255, 255, 255}),
        (std::vector<int>{255, 255, 255, 255}))
        << schedule;
  }
}

TEST (SimLight, GainBitsAndShiftAreInForce)
{
  SimHarness sim ("gain=2 bits=6 shift-x=1 shift-y=-1");
  sim.start (4, 4);
  for (int k = 0; k < 4; k++)
    ASSERT_EQ (sim.send (k, 100 * (k == 2)), GST_FLOW_OK);
  const Image<std::uint8_t> coded = sim.coded ();
  /* Element 2 is mirror (0, 1), which pixel (-1, 2) sees; gain 2 gives half of
   * what white makes: 63 * 100 / 255 / 2. */
  EXPECT_EQ (coded.at (1, 2), 12);
  EXPECT_EQ (coded.at (0, 2), 0);
  EXPECT_EQ (coded.at (1, 1), 0);
  EXPECT_EQ (coded.at (3, 2), 0) << "dark beyond the mirrors";
}

std::vector<std::uint8_t>
noisy_bytes (const std::string &properties)
{
  SimHarness sim ("full-well=1000 read-noise=4 psf-sigma=0.5 " + properties);
  sim.start (40, 30);
  std::vector<std::uint8_t> bytes;
  for (int k = 0; k < 8; k++)
    EXPECT_EQ (sim.send (k, 120), GST_FLOW_OK);
  for (int frame = 0; frame < 2; frame++) {
    const Image<std::uint8_t> coded = sim.coded ();
    for (int y = 0; y < 30; y++)
      bytes.insert (
          bytes.end (), coded.view ().row (y), coded.view ().row (y) + 40);
  }
  return bytes;
}

TEST (SimLight, SameSeedGivesTheSameBytes)
{
  const auto bytes = noisy_bytes ("seed=7");
  EXPECT_EQ (bytes, noisy_bytes ("seed=7"));
  EXPECT_NE (bytes, noisy_bytes ("seed=8"));
  EXPECT_FALSE (
      std::equal (bytes.begin (), bytes.begin () + 1200, bytes.begin () + 1200))
      << "every frame has noise of its own";
}

TEST (SimLight, NoiseIsThatOfTheLightOfASlot)
{
  SimHarness sim ("full-well=10000 read-noise=5");
  sim.start (200, 200);
  for (int k = 0; k < 4; k++)
    ASSERT_EQ (sim.send (k, 102), GST_FLOW_OK);
  const Image<std::uint8_t> coded = sim.coded ();
  double sum = 0, squares = 0;
  for (int y = 0; y < 200; y++)
    for (int x = 0; x < 200; x++) {
      sum += coded.at (x, y);
      squares += coded.at (x, y) * coded.at (x, y);
    }
  /* 102 of 255 in a slot of four: 1000 electrons, 0.102 numbers each. */
  const double mean = sum / 40000, variance = squares / 40000 - mean * mean;
  EXPECT_NEAR (mean, 102, 5 * 3.3 / 200);
  const double expected = 0.102 * 0.102 * (1000 + 25) + 1.0 / 12;
  EXPECT_NEAR (variance, expected, 5 * expected * std::sqrt (2 / 40000.0));
}

TEST (SimLight, OpticsChangeWithTheNextCodedFrame)
{
  SimHarness sim;
  sim.start (2, 2);
  sim.send (0, 200);
  g_object_set (sim.element (), "gain", 2.0, nullptr);
  for (int k = 1; k < 8; k++)
    sim.send (k, 200);
  EXPECT_EQ (sim.coded ().at (0, 0), 200);
  EXPECT_EQ (sim.coded ().at (0, 0), 100);
}

TEST (SimLight, ScheduleChangesWithTheNextCodedFrame)
{
  SimHarness sim;
  sim.start (2, 2);
  sim.send (0, 200);
  g_object_set (sim.element (), "schedule", "staircase:2x1", nullptr);
  for (int k = 1; k < 6; k++)
    sim.send (k, k == 4 ? 100 : 0);
  EXPECT_EQ (sim.coded (), (draw<std::uint8_t> (2, 2, [] (int x, int y) {
    return x == 0 && y == 0 ? 200 : 0;
  })));
  EXPECT_EQ (sim.coded (), (draw<std::uint8_t> (2, 2, [] (int, int) {
    return 50;
  }))) << "two slots";
  int num = 0, den = 0;
  const CapsPtr caps = sim.pad_caps ();
  gst_structure_get_fraction (
      gst_caps_get_structure (caps.get (), 0), "framerate", &num, &den);
  EXPECT_EQ (std::pair (num, den), std::pair (50, 1));
}

} // namespace
