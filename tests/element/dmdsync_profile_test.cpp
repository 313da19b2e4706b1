/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync: the profile of its bench. */
#include "bench_file.h"
#include "common/tag.h"
#include "sync_harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

constexpr Extent kSize = {kSyncWidth, kSyncHeight};

std::optional<BenchProfile>
tagged_profile (const EventPtr &event)
{
  if (!event)
    return std::nullopt;
  GstTagList *tags = nullptr;
  gst_event_parse_tag (event.get (), &tags);
  const auto setup = setup_from_tags (tags);
  return setup && *setup ? setup->value ().bench : std::nullopt;
}

BenchProfile
of_dmd (const std::string &serial)
{
  BenchProfile profile = profile_of (kSize);
  profile.dmd = BenchProfile::Device{.serial = serial, .size = {1024, 768}};
  return profile;
}

TEST (DmdsyncProfile, GoesDownstreamInTheTag)
{
  const BenchProfile own = of_dmd ("7");
  const BenchFile file (own);
  SyncHarness sync ("bench=" + file.path ());
  sync.start ();
  EXPECT_EQ (tagged_profile (sync.pull_event (GST_EVENT_TAG)), own);
  EXPECT_EQ (sync.warning (), "");
  /* A simulated bench upstream knows its own. */
  BenchProfile theirs = own;
  theirs.black_level = Measured{3, 1};
  StreamSetup setup;
  setup.bench = theirs;
  sync.push_event (setup_to_event (setup));
  EXPECT_EQ (tagged_profile (sync.pull_event (GST_EVENT_TAG)), theirs);
}

bool
says_off_beam (const EventPtr &event)
{
  const auto setup =
      event ? setup_from_tags (tags_of (event.get ())) : std::nullopt;
  return setup && *setup && setup->value ().off_beam;
}

TEST (DmdsyncBeam, ASecondCameraIsTaggedAndItsPhaseIsNotWatched)
{
  SyncHarness sync ("beam=off schedule=staircase:2x2");
  sync.start ();
  EXPECT_TRUE (says_off_beam (sync.pull_event (GST_EVENT_TAG)));
  EXPECT_EQ (sync.info (), "") << "no word of slips that cannot be seen";
  for (int i = 0; i < 4; i++) {
    ASSERT_EQ (sync.send (sync.time_of (i)), GST_FLOW_OK);
    const BufferPtr frame = sync.pull ();
    ASSERT_TRUE (frame);
    const auto meta = get_frame_meta (frame.get ());
    ASSERT_TRUE (meta);
    EXPECT_EQ (meta->frame, guint64 (i));
    EXPECT_FALSE (meta->locked.has_value ());
  }
}

TEST (DmdsyncBeam, EachCameraHasItsPartOfAProfileOfBoth)
{
  const BenchProfile first = of_dmd ("7");
  BenchProfile second = profile_of (kSize);
  second.black_level = Measured{12, 1};
  BenchProfile both = first;
  both.second = {second};
  const BenchFile file (both);
  for (const auto &[beam, own] :
      {std::pair ("beam=on", first), std::pair ("beam=off", second)}) {
    SyncHarness sync (std::string (beam) + " bench=" + file.path ());
    sync.start ();
    EXPECT_EQ (tagged_profile (sync.pull_event (GST_EVENT_TAG)), own) << beam;
  }
}

TEST (DmdsyncBeam, UpstreamMaySayIt)
{
  SyncHarness sync;
  sync.start ();
  EXPECT_FALSE (says_off_beam (sync.pull_event (GST_EVENT_TAG)));
  sync.push_event (setup_to_event ({.schedule = {}, .off_beam = true}));
  EXPECT_TRUE (says_off_beam (sync.pull_event (GST_EVENT_TAG)));
}

TEST (DmdsyncBeam, ASecondCameraDrivesNoDmd)
{
  const ObjectPtr<GstElement> sync (GST_ELEMENT (gst_object_ref_sink (
      gst_parse_launch ("dmdsync beam=off device=sim:beam", nullptr))));
  EXPECT_EQ (refusal (sync.get (), GST_STATE_READY),
      "beam=off with the DMD \"sim:beam\": a second camera drives none; leave "
      "device empty, and set it on the dmdsync of the first camera.");
}

TEST (DmdsyncProfile, ItsTriggerDelayMovesFramesBack)
{
  BenchProfile profile = profile_of (kSize);
  profile.trigger_delay = Measured{18400, 3000};
  const BenchFile file (profile);
  for (const auto &[settings, delay] :
      {std::pair ("", 18400), std::pair (" exposure-offset=500", 500)}) {
    SyncHarness sync ("bench=" + file.path () + settings);
    sync.start ();
    ASSERT_EQ (sync.send (sync.time_of (1)), GST_FLOW_OK);
    const BufferPtr frame = sync.pull ();
    ASSERT_TRUE (frame);
    EXPECT_EQ (
        GST_BUFFER_PTS (frame.get ()), sync.time_of (1) - GstClockTime (delay))
        << settings;
  }
}

TEST (DmdsyncProfile, OfAnotherDmdIsRefused)
{
  const BenchFile file (of_dmd ("7"));
  const auto state_with = [&] (const std::string &device) {
    const ObjectPtr<GstElement> sync (
        GST_ELEMENT (gst_object_ref_sink (gst_parse_launch (
            ("dmdsync device=" + device + " bench=" + file.path ()).c_str (),
            nullptr))));
    const auto changed = gst_element_set_state (sync.get (), GST_STATE_PAUSED);
    gst_element_set_state (sync.get (), GST_STATE_NULL);
    return changed;
  };
  EXPECT_NE (state_with ("sim:profile"), GST_STATE_CHANGE_FAILURE);
  EXPECT_NE (state_with ("sim:profile,serial=7"), GST_STATE_CHANGE_FAILURE);
  EXPECT_EQ (state_with ("sim:profile,serial=8"), GST_STATE_CHANGE_FAILURE);

  const ObjectPtr<GstElement> sync (
      GST_ELEMENT (gst_object_ref_sink (gst_parse_launch (
          ("dmdsync device=sim:profile,serial=8 bench=" + file.path ())
              .c_str (),
          nullptr))));
  gst_element_set_state (sync.get (), GST_STATE_READY);
  EXPECT_EQ (refusal (sync.get (), GST_STATE_PAUSED),
      "The bench profile does not fit: the bench profile is of the DMD with "
      "the serial number '7', but this is '8'; use the bench profile of this "
      "DMD, or measure the bench again");
  gst_element_set_state (sync.get (), GST_STATE_NULL);
}

TEST (DmdsyncProfile, OfOtherFramesIsRefused)
{
  const BenchFile file (profile_of ({32, 24}));
  SyncHarness sync ("bench=" + file.path ());
  sync.start ();
  EXPECT_NE (sync.send (0), GST_FLOW_OK);
  EXPECT_NE (
      sync.error ().find ("the frames have 64x48 pixels"), std::string::npos);
}

TEST (DmdsyncProfile, IsSaidToBeOld)
{
  BenchProfile profile = profile_of (kSize);
  profile.measured -= std::chrono::days (31);
  const BenchFile file (profile);
  SyncHarness sync ("bench=" + file.path ());
  sync.start ();
  EXPECT_NE (sync.warning ().find ("measured 31 days ago"), std::string::npos);
}

} // namespace
