/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync without a DMD: tags, caps and synchronisation of a stream. */
#include <array>

#include "common/tag.h"
#include "schedule_tags.h"
#include "sync_harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

constexpr GstClockTime kMs = GST_MSECOND;

std::optional<Schedule>
tagged_schedule (const EventPtr &event)
{
  if (!event)
    return std::nullopt;
  GstTagList *tags = nullptr;
  gst_event_parse_tag (event.get (), &tags);
  const auto schedule = schedule_from_tags (tags);
  if (!schedule || !*schedule)
    return std::nullopt;
  return schedule->value ();
}

TEST (DmdsyncTag, FollowsTheSegmentOnce)
{
  SyncHarness sync ("schedule=staircase:3x3");
  sync.start ();
  EXPECT_EQ (tagged_schedule (sync.pull_event (GST_EVENT_TAG)),
      *Schedule::parse ("staircase:3x3"));
  sync.send_frames (0, 2);
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  sync.push_event (gst_event_new_segment (&segment));
  sync.send_frames (2, 3);
  EXPECT_FALSE (sync.pull_event (GST_EVENT_TAG));
}

TEST (DmdsyncTag, ReplacesAnotherScheduleAndWarnsOnce)
{
  SyncHarness sync ("schedule=staircase:2x2");
  sync.start ();
  ASSERT_TRUE (sync.pull_event (GST_EVENT_TAG));
  for (int time = 0; time < 2; time++) {
    GstTagList *tags =
        schedule_to_tags (*Schedule::parse ("sequential:lattice:5/2"));
    gst_tag_list_add (tags, GST_TAG_MERGE_APPEND, GST_TAG_COMMENT,
        "left half defocused", GST_TAG_TITLE, "milk drop", nullptr);
    sync.push_event (gst_event_new_tag (tags));

    const EventPtr passed = sync.pull_event (GST_EVENT_TAG);
    EXPECT_EQ (tagged_schedule (passed), *Schedule::parse ("staircase:2x2"));
    GstTagList *kept = nullptr;
    gst_event_parse_tag (passed.get (), &kept);
    ASSERT_EQ (gst_tag_list_get_tag_size (kept, GST_TAG_COMMENT), 2u);
    gchar *text = nullptr;
    gst_tag_list_get_string_index (kept, GST_TAG_COMMENT, 1, &text);
    EXPECT_STREQ (CharPtr (text).get (), "left half defocused");
    gst_tag_list_get_string (kept, GST_TAG_TITLE, &text);
    EXPECT_STREQ (CharPtr (text).get (), "milk drop");
  }
  const std::string warning = sync.warning ();
  EXPECT_NE (warning.find ("sequential:lattice:5/2"), std::string::npos);
  EXPECT_NE (warning.find ("staircase:2x2"), std::string::npos);
  EXPECT_EQ (sync.warning (), "");
}

TEST (DmdsyncTag, KeepsTheMappingOfAnotherSchedule)
{
  SyncHarness sync ("schedule=staircase:2x2");
  sync.start ();
  ASSERT_TRUE (sync.pull_event (GST_EVENT_TAG));
  const Mapping mapping (Extent{64, 48});
  GstTagList *title = gst_tag_list_new (GST_TAG_TITLE, "milk drop", nullptr);
  for (GstEvent *event :
      {setup_to_event ({.schedule = *Schedule::parse ("sequential:2x2"),
                      .mapping = mapping,
                      .simulated = true}),
          gst_event_new_tag (title)}) {
    sync.push_event (event);
    const EventPtr passed = sync.pull_event (GST_EVENT_TAG);
    ASSERT_TRUE (passed);
    GstTagList *tags = nullptr;
    gst_event_parse_tag (passed.get (), &tags);
    const auto setup = setup_from_tags (tags);
    ASSERT_TRUE (setup && *setup);
    EXPECT_EQ (setup->value ().schedule, *Schedule::parse ("staircase:2x2"));
    EXPECT_EQ (setup->value ().mapping, mapping);
    EXPECT_TRUE (setup->value ().simulated);
    EXPECT_EQ (setup->value ().size, (Extent{64, 48}));
    EXPECT_EQ (setup->value ().rate, (FrameRate{25, 1}));
  }
}

TEST (DmdsyncTag, StaysAmongTagsThatComeLater)
{
  SyncHarness sync ("schedule=staircase:2x2");
  sync.start ();
  sync.push_event (gst_event_new_tag (
      gst_tag_list_new (GST_TAG_TITLE, "milk drop", nullptr)));
  const EventPtr sticky (
      gst_pad_get_sticky_event (sync.get ()->sinkpad, GST_EVENT_TAG, 0));
  EXPECT_EQ (tagged_schedule (sticky), *Schedule::parse ("staircase:2x2"));
  EXPECT_EQ (sync.warning (), "");
}

/* Downstream keeps global tags and stream tags separate. */
TEST (DmdsyncTag, AnotherSizeIsSaidBeforeItsFirstFrame)
{
  SyncHarness sync;
  sync.start ();
  sync.send_frames (0, 1);
  ASSERT_TRUE (sync.pull_event (GST_EVENT_TAG));
  EXPECT_FALSE (sync.pull_event (GST_EVENT_TAG));
  sync.set_caps (gray_caps (32, 48));
  GstTagList *tags = nullptr;
  const EventPtr event = sync.pull_event (GST_EVENT_TAG);
  ASSERT_TRUE (event);
  gst_event_parse_tag (event.get (), &tags);
  const auto setup = setup_from_tags (tags);
  ASSERT_TRUE (setup && *setup);
  EXPECT_EQ (setup->value ().size, (Extent{32, 48}));
}

TEST (DmdsyncTag, KeepsTheScopeOfTheTagsThatItCorrects)
{
  for (const GstTagScope scope : {GST_TAG_SCOPE_GLOBAL, GST_TAG_SCOPE_STREAM}) {
    SyncHarness sync ("schedule=staircase:2x2");
    sync.start ();
    ASSERT_TRUE (sync.pull_event (GST_EVENT_TAG));
    GstTagList *tags = schedule_to_tags (*Schedule::parse ("sequential:2x2"));
    gst_tag_list_set_scope (tags, scope);
    sync.push_event (gst_event_new_tag (tags));
    const EventPtr passed = sync.pull_event (GST_EVENT_TAG);
    EXPECT_EQ (tagged_schedule (passed), *Schedule::parse ("staircase:2x2"));
    GstTagList *corrected = nullptr;
    gst_event_parse_tag (passed.get (), &corrected);
    EXPECT_EQ (gst_tag_list_get_scope (corrected), scope);
  }
}

TEST (DmdsyncTag, TheSameScheduleIsNoReasonToWarn)
{
  SyncHarness sync ("schedule=staircase:2x2");
  sync.start ();
  sync.push_event (schedule_to_event (*Schedule::parse ("staircase:2x2")));
  EXPECT_EQ (sync.warning (), "");
}

TEST (DmdsyncCaps, SlotsThatDoNotFitAreAnErrorWithTheNumbers)
{
  SyncHarness sync ("schedule=staircase:2x2,active=9.8ms,switching=0.2ms");
  sync.start ({25, 1});
  EXPECT_EQ (sync.error (), "");
  sync.start ({26, 1});
  EXPECT_NE (sync.send (0), GST_FLOW_OK);
  const std::string error = sync.error ();
  EXPECT_NE (error.find ("9.8ms"), std::string::npos) << error;
  EXPECT_NE (error.find ("26/1"), std::string::npos) << error;
}

TEST (DmdsyncCaps, ARateThatIsUnknownComesFromTheSlots)
{
  SyncHarness without ("schedule=staircase:2x2");
  without.set_caps ("video/x-raw,format=GRAY8,width=64,height=48");
  EXPECT_NE (without.send (0), GST_FLOW_OK);
  EXPECT_NE (without.error ().find ("framerate=25/1"), std::string::npos);

  SyncHarness with ("schedule=staircase:2x2,active=9.8ms,switching=0.2ms");
  with.set_caps ("video/x-raw,format=GRAY8,width=64,height=48,framerate=0/1");
  ASSERT_EQ (with.send (0), GST_FLOW_OK);
  ASSERT_EQ (with.send (80 * kMs), GST_FLOW_OK);
  EXPECT_EQ (with.error (), "");
  EXPECT_EQ (with.counter ("frames-lost"), 1u);
  const BufferPtr frame = with.pull ();
  ASSERT_TRUE (frame);
  EXPECT_EQ (GST_BUFFER_DURATION (frame.get ()), 40 * kMs);
}

TEST (DmdsyncCaps, NumbersGoOnWhenTheyChange)
{
  SyncHarness sync;
  sync.start ();
  sync.send_frames (0, 3);
  sync.set_caps ("video/x-raw,format=GRAY8,width=64,height=48,framerate=25/1,"
                 "pixel-aspect-ratio=2/1");
  ASSERT_EQ (sync.send (sync.time_of (3)), GST_FLOW_OK);
  for (guint64 number = 0; number < 4; number++) {
    const BufferPtr frame = sync.pull ();
    ASSERT_TRUE (frame);
    EXPECT_EQ (meta_of (frame).frame, number);
    EXPECT_EQ (GST_BUFFER_OFFSET (frame.get ()), number);
    EXPECT_EQ (has_flag (frame, GST_BUFFER_FLAG_DISCONT), number % 3 == 0);
  }
}

TEST (DmdsyncCaps, RowsMayBeAsFarApartAsAFrameSays)
{
  constexpr int kOdd = 30, kRows = 20;
  SyncHarness sync;
  sync.set_caps (gray_caps (kOdd, kRows, "25/1"));
  const auto push = [&] (gsize size, int number) {
    BufferPtr frame (gst_buffer_new_and_alloc (size));
    gsize offsets[GST_VIDEO_MAX_PLANES] = {0};
    gint strides[GST_VIDEO_MAX_PLANES] = {kOdd};
    gst_buffer_add_video_meta_full (frame.get (), GST_VIDEO_FRAME_FLAG_NONE,
        GST_VIDEO_FORMAT_GRAY8, kOdd, kRows, 1, offsets, strides);
    GST_BUFFER_PTS (frame.get ()) = GstClockTime (number) * 40 * kMs;
    return sync.push (std::move (frame));
  };
  ASSERT_EQ (push (kOdd * kRows, 0), GST_FLOW_OK);
  EXPECT_TRUE (sync.pull ());
  ASSERT_EQ (push (kOdd * kRows - 1, 1), GST_FLOW_OK);
  EXPECT_FALSE (sync.pull ());
  EXPECT_EQ (sync.counter ("frames-incomplete"), 1u);
}

TEST (DmdsyncCaps, AFrameThatCannotHoldThePilotIsAnError)
{
  SyncHarness sync ("schedule=sequential:2x2,pilot=4");
  sync.set_caps (gray_caps (16, 48));
  EXPECT_NE (sync.send (0), GST_FLOW_OK);
  EXPECT_NE (sync.error ().find ("16x48"), std::string::npos);
}

TEST (DmdsyncPhase, TellsWhatCanBeSeen)
{
  const std::pair<const char *, const char *> cases[] = {
      {"sequential:2x2", "never"}, {"staircase:2x2", "in-the-frame"},
      {"s-matrix:7x1", "in-the-frame"}, {"staircase:16x16", "never"},
      {"sequential:2x2,pilot=8", "always"}};
  for (const auto &[schedule, expected] : cases) {
    SCOPED_TRACE (schedule);
    SyncHarness sync ("schedule=" + std::string (schedule));
    GValue value = G_VALUE_INIT;
    g_object_get_property (
        G_OBJECT (sync.element ()), "slip-observable", &value);
    const auto *klass =
        G_ENUM_CLASS (g_type_class_peek (G_VALUE_TYPE (&value)));
    EXPECT_STREQ (g_enum_get_value (const_cast<GEnumClass *> (klass),
                      g_value_get_enum (&value))
                      ->value_nick,
        expected);
    g_value_unset (&value);
    EXPECT_EQ (bool (sync.message (GST_MESSAGE_INFO)),
        std::string (expected) != "always")
        << "what cannot be seen is said beforehand";
  }
}

/** Levels of staircase:2x2 when synchronised, and with a slip of one slot from
 * slot 2 on. */
constexpr std::array<int, 4> kInPhase{50, 100, 150, 200};
constexpr std::array<int, 4> kSlipped{50, 150, 200, 200};

TEST (DmdsyncPhase, ASlipIsFlaggedInItsFrameAndStaysWithoutADmd)
{
  SyncHarness sync ("schedule=staircase:2x2");
  sync.start ();
  for (int k = 0; k < 6; k++)
    ASSERT_EQ (
        sync.send_levels (sync.time_of (k), k == 3 ? kSlipped : kInPhase),
        GST_FLOW_OK);
  for (int k = 0; k < 6; k++) {
    SCOPED_TRACE (k);
    const BufferPtr frame = sync.pull ();
    ASSERT_TRUE (frame);
    EXPECT_EQ (
        meta_of (frame).locked, k < 3 ? std::nullopt : std::optional (false));
    EXPECT_EQ (meta_of (frame).slip, k < 3 ? 0 : 1);
    EXPECT_EQ (has_flag (frame, GST_BUFFER_FLAG_CORRUPTED), k >= 3);
  }
  const MessagePtr slip = sync.element_message ("dmdsync/slip");
  EXPECT_EQ (uint64_field (slip, "frame"), 3u);
  EXPECT_EQ (uint64_field (slip, "pts"), 120 * kMs);
  EXPECT_EQ (int_field (slip, "slots"), 1);
  EXPECT_FALSE (sync.element_message ("dmdsync/slip"));
  EXPECT_FALSE (sync.get_property<gboolean> ("locked"));
  EXPECT_EQ (sync.counter ("slips"), 1u);
}

TEST (DmdsyncPhase, FramesOutOfPhaseCanBeSkipped)
{
  SyncHarness sync ("schedule=staircase:2x2 on-unlock=skip");
  sync.start ();
  for (int k = 0; k < 5; k++)
    ASSERT_EQ (
        sync.send_levels (sync.time_of (k), k == 3 ? kSlipped : kInPhase),
        GST_FLOW_OK);
  int passed = 0;
  while (sync.pull ())
    passed++;
  EXPECT_EQ (passed, 3);
  EXPECT_EQ (sync.counter ("frames-skipped"), 2u);
  EXPECT_EQ (
      string_field (sync.element_message ("dmdsync/frame-dropped"), "reason"),
      "not-locked");
  GstClockTime from = 0;
  const EventPtr gap = sync.pull_event (GST_EVENT_GAP);
  ASSERT_TRUE (gap);
  gst_event_parse_gap (gap.get (), &from, nullptr);
  EXPECT_EQ (from, 120 * kMs);
}

TEST (DmdsyncPhase, TheFrameAfterSkippedOnesIsDiscont)
{
  SyncHarness sync ("schedule=staircase:2x2 on-unlock=skip");
  sync.start ();
  for (int k = 0; k < 6; k++) {
    if (k == 5)
      gst_util_set_object_arg (G_OBJECT (sync.element ()), "on-unlock", "keep");
    ASSERT_EQ (
        sync.send_levels (sync.time_of (k), k == 3 ? kSlipped : kInPhase),
        GST_FLOW_OK);
  }
  std::vector<guint64> disconts;
  while (const BufferPtr frame = sync.pull ())
    if (has_flag (frame, GST_BUFFER_FLAG_DISCONT))
      disconts.push_back (GST_BUFFER_OFFSET (frame.get ()));
  EXPECT_EQ (disconts, (std::vector<guint64>{0, 5}));
}

TEST (DmdsyncPhase, FramesOutOfPhaseCanEndTheStream)
{
  SyncHarness sync ("schedule=staircase:2x2 on-unlock=error");
  sync.start ();
  for (int k = 0; k < 3; k++)
    ASSERT_EQ (sync.send_levels (sync.time_of (k), kInPhase), GST_FLOW_OK);
  EXPECT_EQ (sync.send_levels (sync.time_of (3), kSlipped), GST_FLOW_ERROR);
  EXPECT_NE (sync.error ().find ("frame 3"), std::string::npos);
}

TEST (DmdsyncPhase, AOneHotCodeNeverSaysSlip)
{
  SyncHarness sync ("schedule=sequential:2x2");
  sync.start ();
  const std::array<int, 4> doubled{200, 100, 100, 0};
  for (int k = 0; k < 6; k++)
    ASSERT_EQ (sync.send_levels (sync.time_of (k),
                   k == 3 ? doubled : std::array<int, 4>{100, 100, 100, 100}),
        GST_FLOW_OK);
  EXPECT_FALSE (sync.element_message ("dmdsync/slip"));
}

TEST (DmdsyncPhase, APilotThatCannotBeReadIsSaidOnce)
{
  SyncHarness sync ("schedule=sequential:2x2,pilot=4");
  sync.start ();
  sync.send_frames (0, 100);
  while (const BufferPtr frame = sync.pull ())
    EXPECT_EQ (meta_of (frame).locked, std::nullopt);
  const std::string warning = sync.warning ();
  EXPECT_NE (warning.find ("4 rows, the last of"), warning.npos) << warning;
  EXPECT_NE (warning.find ("region= of the device"), warning.npos) << warning;
  EXPECT_EQ (sync.warning (), "");
}

TEST (DmdsyncPhase, WithoutADmdAndAPilotItIsUnknown)
{
  for (const char *schedule : {"sequential:2x2", "staircase:2x2"}) {
    SCOPED_TRACE (schedule);
    SyncHarness sync (std::string ("on-unlock=skip schedule=") + schedule);
    sync.start ();
    for (int k = 0; k < 3; k++) {
      ASSERT_EQ (sync.send_levels (sync.time_of (k), kInPhase), GST_FLOW_OK);
      const BufferPtr frame = sync.pull ();
      ASSERT_TRUE (frame);
      EXPECT_EQ (meta_of (frame).locked, std::nullopt);
      EXPECT_FALSE (has_flag (frame, GST_BUFFER_FLAG_CORRUPTED));
    }
    EXPECT_FALSE (sync.element_message ("dmdsync/locked"));
    EXPECT_FALSE (sync.get_property<gboolean> ("locked"));
    GstStructure *stats = nullptr;
    g_object_get (sync.element (), "stats", &stats, nullptr);
    EXPECT_FALSE (gst_structure_has_field (stats, "locked"));
    gst_structure_free (stats);
  }
}

} // namespace
