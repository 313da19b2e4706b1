/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-sim: a bench that simulates from a profile. */
#include "base/text.h"
#include "bench_file.h"
#include "common/tag.h"
#include "sim_harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr Extent kSize = {24, 16};

BenchProfile
noisy ()
{
  /* The same in each call, whatever the time is. */
  static const BenchProfile base = profile_of (kSize);
  BenchProfile profile = base;
  profile.conversion_gain = Measured{10.0, 0.1};
  profile.read_noise = Measured{5.0, 0.1};
  profile.psf_sigma = Measured{0.5, 0.01};
  profile.leak = Measured{0.01, 0.001};
  return profile;
}

/* One coded frame of a simulator with @properties. */
Image<std::uint8_t>
coded_by (const std::string &properties)
{
  SimHarness sim (properties);
  sim.start (kSize.width, kSize.height);
  for (int k = 0; k < 4; k++)
    EXPECT_EQ (sim.send (k, scene<std::uint8_t> (kSize.width, kSize.height, k)),
        GST_FLOW_OK);
  return sim.coded ();
}

void
expect_same (const std::string &properties, const std::string &others)
{
  const Image<std::uint8_t> one = coded_by (properties);
  const Image<std::uint8_t> other = coded_by (others);
  for (int y = 0; y < kSize.height; y++)
    for (int x = 0; x < kSize.width; x++)
      ASSERT_EQ (one.at (x, y), other.at (x, y))
          << properties << " at " << x << ", " << y;
}

std::string
error_of (const BenchProfile &profile, const std::string &properties = "")
{
  const BenchFile file (profile);
  SimHarness sim ("bench=" + file.path () + " " + properties);
  sim.start (kSize.width, kSize.height);
  EXPECT_EQ (sim.send (0), GST_FLOW_ERROR);
  return sim.error ();
}

/* Of 1.03 slots' white, 255 numbers of 10 electrons. */
TEST (SimProfile, SimulatesWhatWasMeasured)
{
  const BenchFile file (noisy ());
  const double full_well = 10.0 * 255 * 4 / 1.03;
  expect_same (
      "bench=" + file.path (), "schedule=sequential:2x2,leak=0.01 "
                               "psf-sigma=0.5 read-noise=5 full-well=" +
                                   real_text (full_well));
}

TEST (SimProfile, WhatIsSetByHandWins)
{
  const BenchFile file (noisy ());
  expect_same ("bench=" + file.path () +
                   " schedule=sequential:2x2,leak=0.1 full-well=0 psf-sigma=0",
      "schedule=sequential:2x2,leak=0.1");
  expect_same ("bench=" + file.path () +
                   " schedule=sequential:2x2,leak=0.1 full-well=900 "
                   "read-noise=0 psf-sigma=1",
      "schedule=sequential:2x2,leak=0.1 full-well=900 psf-sigma=1");
}

TEST (SimProfile, ItsTagHasTheProfile)
{
  const BenchFile file (noisy ());
  SimHarness sim ("bench=" + file.path ());
  sim.start (kSize.width, kSize.height);
  const EventPtr event = sim.pull_event (GST_EVENT_TAG);
  ASSERT_TRUE (event);
  GstTagList *tags = nullptr;
  gst_event_parse_tag (event.get (), &tags);
  const auto setup = setup_from_tags (tags);
  ASSERT_TRUE (setup && *setup);
  EXPECT_EQ (setup->value ().bench, noisy ());
  EXPECT_EQ (setup->value ().schedule, Schedule ());
}

TEST (SimProfile, RefusesFramesOfAnotherCamera)
{
  BenchProfile profile = noisy ();
  profile.camera.size = {8, 8};
  EXPECT_NE (error_of (profile).find ("The bench profile does not fit: the "
                                      "frames have 24x16 pixels, but"),
      std::string::npos);
  profile = noisy ();
  profile.bits = 12;
  EXPECT_NE (error_of (profile).find ("8 bits, but those of the bench profile "
                                      "have 12"),
      std::string::npos);
  EXPECT_NE (error_of (noisy (), "bits=7").find ("7 bits"), std::string::npos);
}

TEST (SimProfile, RefusesAProfileThatCannotBeRead)
{
  const ObjectPtr<GstElement> sim (GST_ELEMENT (gst_object_ref_sink (
      gst_element_factory_make ("codedexposure-sim", nullptr))));
  g_object_set (sim.get (), "bench", "no.json", nullptr);
  EXPECT_NE (
      refusal (sim.get (), GST_STATE_PAUSED)
          .find (
              "The bench property (or --bench) cannot be read: bench profile "
              "'no.json'"),
      std::string::npos);
  gst_element_set_state (sim.get (), GST_STATE_NULL);
}

} // namespace
