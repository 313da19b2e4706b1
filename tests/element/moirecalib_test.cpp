/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* moirecalib after a simulated bench: readings, states and the mapping; and its
 * errors without a dmdsync. */
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "calibrate/gratings.h"
#include "common/events.h"
#include "common/tag.h"
#include "mapping_error.h"
#include "sync_bench.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

/** Frames are exposed as fast as they can be, and threads may have to wait for
 * their turn meanwhile. */
constexpr int kPatience = 30'000;

void
white (std::int64_t, ImageView<std::uint8_t> out)
{
  for (int y = 0; y < out.height; y++)
    std::fill_n (out.row (y), out.width, std::uint8_t (200));
}

double
double_field (const MessagePtr &message, const char *name)
{
  double value = NAN;
  EXPECT_TRUE (gst_structure_get_double (
      gst_message_get_structure (message.get ()), name, &value))
      << name;
  return value;
}

constexpr Alignment kStand{
    .shift_x = 0.4, .shift_y = -0.3, .rotation = 0.5, .scale = 1.01};
constexpr const char *kOptics =
    "full-well=10000 read-noise=5 psf-sigma=0.5 seed=3 shift-x=0.4 "
    "shift-y=-0.3 rotation=0.5 scale=1.01 ";

class MoireCalibTest : public ::testing::Test
{
protected:
  void begin (const std::string &settings, const std::string &camera = "")
  {
    bench.emplace ("sequential:2x2",
        "codedexposure-sim name=bench dmd=sim:calib " + std::string (kOptics) +
            camera + "! dmdsync name=sync device=sim:calib,size=" +
            std::to_string (kWidth) + "x" + std::to_string (kHeight) +
            " ! moirecalib name=calib " + settings);
    calib = bench->find ("calib");
  }
  /** Exposes frames until a message of that name is posted; returns the last
   * one. */
  MessagePtr wait_for (const char *name, const std::string &state = "")
  {
    for (int i = 0; i < kPatience; i++) {
      last = bench->next (white);
      auto said = bench->messages (name);
      if (!said.empty () &&
          (state.empty () || string_field (said.back (), "state") == state))
        return std::move (said.back ());
    }
    ADD_FAILURE () << name << " never came";
    return nullptr;
  }

  std::optional<Bench> bench;
  ObjectPtr<GstElement> calib;
  BufferPtr last;
};

} // namespace

TEST_F (MoireCalibTest, SaysHowTheBenchStandsAndHowToMove)
{
  begin ("mode=align mirror-pitch=10");
  const MessagePtr reading = wait_for ("moirecalib/reading");
  ASSERT_TRUE (reading);
  EXPECT_NEAR (double_field (reading, "offset-x"), 0.4, 0.02);
  EXPECT_NEAR (double_field (reading, "offset-y"), -0.3, 0.02);
  EXPECT_NEAR (double_field (reading, "rotation"), 0.5, 0.03);
  EXPECT_NEAR (double_field (reading, "magnification"), 1.01, 5e-4);
  EXPECT_NEAR (double_field (reading, "stage-x"), -4.0, 0.2);
  EXPECT_NEAR (double_field (reading, "stage-theta"), -500, 30);
}

TEST_F (MoireCalibTest, FollowsTheStageFromCoarseToAligned)
{
  begin ("mode=align");
  ASSERT_TRUE (wait_for ("moirecalib/state", "coarse"));
  const ObjectPtr<GstElement> stage = bench->find ("bench");
  g_object_set (stage.get (), "rotation", 0.1, "scale", 1.0, nullptr);
  ASSERT_TRUE (wait_for ("moirecalib/state", "fine"));
  g_object_set (stage.get (), "rotation", 0.0, "scale", 1.0, "shift-x", 3.0,
      "shift-y", 0.0, nullptr);
  ASSERT_TRUE (wait_for ("moirecalib/state", "aligned"));
  EXPECT_EQ (text_property (calib.get (), "state"), "aligned");
}

TEST_F (MoireCalibTest, MapsAndTellsEverybody)
{
  const auto file = std::filesystem::temp_directory_path () /
                    ("cexp-map-" + std::to_string (getpid ()) + ".json");
  begin ("mode=map frames=2 location=" + file.string ());
  const MessagePtr said = wait_for ("moirecalib/mapping");
  ASSERT_TRUE (said);
  const std::string json = string_field (said, "mapping");
  const Result<Mapping> mapping = Mapping::from_json (json);
  ASSERT_TRUE (mapping.ok ()) << mapping.error ().message;
  EXPECT_LT (worst_error (*mapping, kStand), 0.02);
  EXPECT_EQ (text_property (calib.get (), "mapping"), json);
  const Result<Mapping> saved = Mapping::load (file.string ());
  ASSERT_TRUE (saved.ok ()) << saved.error ().message;
  EXPECT_EQ (saved->to_json (), json);
  std::filesystem::remove (file);

  /* Downstream, in the tag of the schedule. */
  for (int i = 0; i < 2; i++)
    bench->next (white);
  const auto setup = setup_from_tags (bench->tags ().get ());
  ASSERT_TRUE (setup && *setup);
  EXPECT_EQ (setup->value ().schedule, Schedule ());
  ASSERT_TRUE (setup->value ().mapping);
  EXPECT_EQ (setup->value ().mapping->to_json (), json);

  /* The mirrors show the schedule again. */
  EXPECT_EQ (
      string_field (bench->messages ("dmdsync/pattern-over").back (), "reason"),
      "asked");
  for (int i = 0; i < kPatience; i++) {
    last = bench->next (white);
    if (get_frame_meta (last.get ())->locked != false)
      break;
  }
  EXPECT_NE (get_frame_meta (last.get ())->locked, false);
}

/* It gets the light of the other slots, too. */
TEST_F (MoireCalibTest, ACameraInTheOtherBeamStandsAgainstTheSameMirrors)
{
  begin ("mode=align beam=off", "beam=off gain=0.8 ");
  const MessagePtr reading = wait_for ("moirecalib/reading");
  ASSERT_TRUE (reading);
  EXPECT_NEAR (double_field (reading, "offset-x"), 0.4, 0.05);
  EXPECT_NEAR (double_field (reading, "offset-y"), -0.3, 0.05);
  EXPECT_NEAR (double_field (reading, "rotation"), 0.5, 0.05);

  /* The tag says the beam, without the property. */
  begin ("mode=map frames=6", "beam=off gain=0.8 ");
  const MessagePtr said = wait_for ("moirecalib/mapping");
  ASSERT_TRUE (said);
  const auto mapping = Mapping::from_json (string_field (said, "mapping"));
  ASSERT_TRUE (mapping.ok ()) << mapping.error ().message;
  EXPECT_LT (worst_error (*mapping, kStand), 0.01);
}

TEST_F (MoireCalibTest, NamesNoFileThatItCouldNotWrite)
{
  begin (
      "mode=map frames=1 location=/proc/no/map.json report=/proc/no/map.png");
  const MessagePtr said = wait_for ("moirecalib/mapping");
  ASSERT_TRUE (said);
  EXPECT_EQ (string_field (said, "location"), "");
  EXPECT_EQ (string_field (said, "report"), "");
  const std::string warnings = bench->warnings ();
  EXPECT_NE (warnings.find ("/proc/no/map.json"), std::string::npos);
  EXPECT_NE (warnings.find ("/proc/no/map.png"), std::string::npos);

  /* Again, with a location for the mapping. */
  const auto file = std::filesystem::temp_directory_path () /
                    ("cexp-again-" + std::to_string (getpid ()) + ".json");
  g_object_set (calib.get (), "location", file.c_str (), nullptr);
  gst_util_set_object_arg (G_OBJECT (calib.get ()), "mode", "map");
  for (int i = 0; i < kPatience; i++) {
    bench->next (white);
    if (bench->messages ("moirecalib/mapping").size () == 2)
      break;
  }
  EXPECT_EQ (
      string_field (bench->messages ("moirecalib/mapping").back (), "location"),
      file.string ());
  EXPECT_TRUE (std::filesystem::remove (file));
}

TEST_F (MoireCalibTest, MapsByItselfOnceItIsAligned)
{
  begin ("frames=1 tolerance=10");
  ASSERT_TRUE (wait_for ("moirecalib/state", "aligned"));
  ASSERT_TRUE (wait_for ("moirecalib/mapping"));
  EXPECT_EQ (text_property (calib.get (), "state"), "mapped");
}

TEST_F (MoireCalibTest, AStreamThatEndsEarlyHasNoMapping)
{
  begin ("mode=map");
  ASSERT_TRUE (wait_for ("moirecalib/state", "mapping"));
  bench->end ();
  EXPECT_NE (
      bench->warnings ().find ("there is no mapping"), std::string::npos);
  EXPECT_EQ (text_property (calib.get (), "mapping"), "");
}

namespace
{

constexpr int kLargeWidth = 256, kLargeHeight = 192;

BufferPtr
grating_frame (int number)
{
  const Pattern pattern = live_grating ();
  return frame_of (draw<std::uint8_t> (kLargeWidth, kLargeHeight,
                       [&] (int x, int y) { return pattern.on (x, y) * 200; }),
      GstClockTime (FrameRate{30000, 1001}.time_of (number)));
}

gboolean
answer_as_dmdsync (GstPad *pad, GstObject *parent, GstQuery *query)
{
  if (GST_QUERY_TYPE (query) != GST_QUERY_CUSTOM)
    return gst_pad_query_default (pad, parent, query);
  answer_query (query, MirrorsAnswer{kLargeWidth, kLargeHeight, true});
  return TRUE;
}

} // namespace

TEST (MoireCalib, WithoutADmdsyncItSaysWhatToDo)
{
  ElementHarness h ("moirecalib");
  h.set_caps (gray_caps (kLargeWidth, kLargeHeight));
  EXPECT_EQ (h.push (grating_frame (0)), GST_FLOW_ERROR);
  EXPECT_EQ (h.error (),
      "No element upstream shows patterns. Put a dmdsync with a device that "
      "takes "
      "masks at run time before moirecalib, or show a grating by other means "
      "and say which: pattern=grating-both:4/0.");
}

TEST (MoireCalib, RefusesWhatIsNoPattern)
{
  ElementHarness h ("moirecalib pattern=grating-both:4");
  h.set_caps (gray_caps (kLargeWidth, kLargeHeight));
  EXPECT_EQ (h.push (grating_frame (0)), GST_FLOW_ERROR);
  EXPECT_EQ (h.error ().find ("The pattern property cannot be read: "), 0u);
}

TEST (MoireCalib, EveryFramePassesWithItsTimesWhateverTheWorkerDoes)
{
  ElementHarness h ("moirecalib pattern=grating-both:4/0");
  h.set_caps (gray_caps (kLargeWidth, kLargeHeight, "30000/1001"));
  for (int i = 0; i < 200; i++) {
    ASSERT_EQ (h.push (grating_frame (i)), GST_FLOW_OK);
    const BufferPtr out = h.pull ();
    ASSERT_TRUE (out);
    EXPECT_EQ (GST_BUFFER_PTS (out.get ()),
        GstClockTime (FrameRate{30000, 1001}.time_of (i)));
  }
}

TEST (MoireCalib, AsksAgainBeforeUpstreamTakesTheMirrorsBack)
{
  struct Request {
    guint64 lease = 0;
    guint64 age = 0; ///< frames since it was made
    int made = 0;
  } request;
  ElementHarness h ("moirecalib overlay=false");
  gst_pad_add_probe (
      h.get ()->srcpad, GST_PAD_PROBE_TYPE_EVENT_UPSTREAM,
      [] (GstPad *, GstPadProbeInfo *info, gpointer data) {
        GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
        auto *seen = static_cast<Request *> (data);
        if (gst_event_has_name (event, "dmdsync/pattern") &&
            gst_structure_get_uint64 (
                gst_event_get_structure (event), "frames", &seen->lease)) {
          seen->age = 0;
          seen->made++;
        }
        return GST_PAD_PROBE_OK;
      },
      &request, nullptr);
  gst_pad_set_query_function (h.get ()->srcpad, answer_as_dmdsync);
  h.set_caps (gray_caps (kLargeWidth, kLargeHeight, "30000/1001"));
  const BufferPtr frame = grating_frame (0);
  for (int i = 0; i < 300; i++) {
    ASSERT_EQ (
        h.push (BufferPtr (gst_buffer_copy (frame.get ()))), GST_FLOW_OK);
    ASSERT_TRUE (h.pull ());
    ASSERT_LT (request.age++, request.lease) << i;
  }
  EXPECT_GT (request.made, 1);
}

TEST (MoireCalib, LaysItsPanelOverThePictureOrLeavesItAlone)
{
  for (const bool overlay : {true, false}) {
    ElementHarness h ("moirecalib pattern=grating-both:4/0 overlay=" +
                      std::string (overlay ? "true" : "false"));
    const std::string caps = gray_caps (kLargeWidth, kLargeHeight);
    h.set_caps (caps);
    const auto plain = image_of<std::uint8_t> (
        grating_frame (0).get (), caps_of (caps).get ());
    bool changed = false;
    MessagePtr reading;
    for (int i = 0; i < kPatience && !(changed || (reading && !overlay)); i++) {
      ASSERT_EQ (h.push (grating_frame (i)), GST_FLOW_OK);
      const BufferPtr out = h.pull ();
      changed = !(
          image_of<std::uint8_t> (out.get (), caps_of (caps).get ()) == plain);
      if (!reading)
        reading = h.element_message ("moirecalib/reading");
    }
    EXPECT_EQ (changed, overlay);
  }
}

TEST (MoireCalib, NeverDrawsOnAFrameOfTheSchedule)
{
  ElementHarness h ("moirecalib mode=align");
  gst_pad_set_query_function (h.get ()->srcpad, answer_as_dmdsync);
  gst_pad_set_event_function (h.get ()->srcpad,
      [] (GstPad *, GstObject *, GstEvent *event) -> gboolean {
        gst_event_unref (event);
        return TRUE;
      });
  const std::string caps = gray_caps (kLargeWidth, kLargeHeight);
  h.set_caps (caps);
  const auto plain =
      image_of<std::uint8_t> (grating_frame (0).get (), caps_of (caps).get ());
  const auto drawn_on = [&] (int number, const std::string &pattern) {
    BufferPtr frame = grating_frame (number);
    set_frame_meta (frame.get (), {.pattern = pattern});
    EXPECT_EQ (h.push (std::move (frame)), GST_FLOW_OK);
    const BufferPtr out = h.pull ();
    return !(
        image_of<std::uint8_t> (out.get (), caps_of (caps).get ()) == plain);
  };
  int number = 0;
  while (number < kPatience && !drawn_on (number++, live_grating ().text ()))
    EXPECT_FALSE (drawn_on (number++, ""));
  ASSERT_LT (number, kPatience) << "no panel";
  EXPECT_FALSE (drawn_on (number++, ""));
  EXPECT_TRUE (drawn_on (number++, live_grating ().text ()));
}

TEST (MoireCalib, KnowsTheBitsOfItsPixelsFromTheFrames)
{
  const Pattern pattern = live_grating ();
  const auto picture =
      draw<std::uint16_t> (kLargeWidth, kLargeHeight, [&] (int x, int y) {
        return x < 5 && y == 0 ? 1023 : pattern.on (x, y) * 700;
      });
  for (const int bits : {10, 0}) {
    ElementHarness h ("moirecalib pattern=grating-both:4/0 overlay=false");
    h.set_caps (gray_caps (kLargeWidth, kLargeHeight, "25/1", "GRAY16_LE"));
    BufferPtr frame = frame_of (picture, 0);
    set_frame_meta (frame.get (), {.bits = bits});
    ASSERT_EQ (h.push (std::move (frame)), GST_FLOW_OK);
    h.push_event (gst_event_new_eos ());
    const MessagePtr reading = h.element_message ("moirecalib/reading");
    ASSERT_TRUE (reading);
    guint64 saturated = 99;
    gst_structure_get_uint64 (
        gst_message_get_structure (reading.get ()), "saturated", &saturated);
    EXPECT_EQ (saturated, bits == 10 ? 5u : 0u);
  }
}

/* GStreamer complains, and goes on. */
TEST (MoireCalib, DroppedWhileItPlaysItEndsItsThread)
{
  int complaints = 0;
  const GLogLevelFlags fatal =
      g_log_set_always_fatal (GLogLevelFlags (G_LOG_FATAL_MASK));
  const guint handler = g_log_set_handler (
      "GStreamer", G_LOG_LEVEL_CRITICAL,
      [] (const gchar *, GLogLevelFlags, const gchar *, gpointer count) {
        ++*static_cast<int *> (count);
      },
      &complaints);
  GstElement *calib = gst_element_factory_make ("moirecalib", nullptr);
  gst_object_ref_sink (calib);
  EXPECT_NE (gst_element_set_state (calib, GST_STATE_PLAYING),
      GST_STATE_CHANGE_FAILURE);
  gst_object_unref (calib);
  g_log_remove_handler ("GStreamer", handler);
  g_log_set_always_fatal (fatal);
  EXPECT_GT (complaints, 0);
}

TEST (MoireCalib, GivesTheMirrorsBackWhenItStops)
{
  ElementHarness h ("moirecalib");
  std::vector<std::string> asked;
  gst_pad_add_probe (
      h.get ()->srcpad, GST_PAD_PROBE_TYPE_EVENT_UPSTREAM,
      [] (GstPad *, GstPadProbeInfo *info, gpointer list) {
        GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
        if (gst_event_has_name (event, "dmdsync/pattern"))
          static_cast<std::vector<std::string> *> (list)->emplace_back (
              gst_structure_get_string (
                  gst_event_get_structure (event), "pattern"));
        return GST_PAD_PROBE_OK;
      },
      &asked, nullptr);
  gst_pad_set_query_function (h.get ()->srcpad, answer_as_dmdsync);
  h.set_caps (gray_caps (kLargeWidth, kLargeHeight));
  EXPECT_EQ (h.push (grating_frame (0)), GST_FLOW_OK);
  gst_element_set_state (h.element (), GST_STATE_NULL);
  EXPECT_EQ (asked, (std::vector<std::string>{"grating-both:4/0", ""}));
}

namespace
{

/** Texture that moves. */
void
scenery (std::int64_t slot, ImageView<std::uint8_t> out)
{
  for (int y = 0; y < out.height; y++)
    for (int x = 0; x < out.width; x++)
      out.at (x, y) = std::uint8_t (60 + (x * 7 + y * 13 + slot) % 97);
}

/** Frame of a flat scene behind mirrors with @p schedule. */
BufferPtr
flat_frame (const Schedule &schedule, std::uint8_t light)
{
  return frame_of (draw<std::uint8_t> (kWidth, kHeight,
                       [&] (int x, int y) {
                         int sum = 0;
                         for (int slot = 0; slot < schedule.slots (); slot++)
                           sum += schedule.on (x, y, slot) * light;
                         return sum;
                       }),
      GstClockTime (FrameRate{30000, 1001}.time_of (0)));
}

} // namespace

TEST (MoireCalibPhase, IsFoundInAFrameAndSaidDownstream)
{
  Bench bench ("staircase:2x2",
      "codedexposure-sim schedule=staircase:2x2 shift-x=1 shift-y=2 ! "
      "moirecalib name=calib mode=phase overlay=false");
  for (int i = 0; i < 3; i++)
    bench.next (scenery);
  bench.end ();
  const auto said = bench.messages ("moirecalib/phase");
  ASSERT_EQ (said.size (), 1u) << bench.warnings ();
  EXPECT_EQ (string_field (said[0], "schedule"), "staircase:2x2,phase=1/0");
  EXPECT_GE (double_field (said[0], "confidence"), 0.999);
  EXPECT_EQ (text_property (bench.find ("calib").get (), "state"), "found");
  const auto setup = setup_from_tags (bench.tags ().get ());
  ASSERT_TRUE (setup && *setup);
  EXPECT_EQ (setup->value ().schedule.text (), "staircase:2x2,phase=1/0");
  EXPECT_TRUE (setup->value ().simulated);
  EXPECT_EQ (setup->value ().size, (Extent{kWidth, kHeight}));
  EXPECT_TRUE (setup->value ().rate);
}

TEST (MoireCalibPhase, IsLookedForInAStreamThatSaysNoSchedule)
{
  ElementHarness h ("moirecalib mode=phase schedule=staircase:3x2");
  h.set_caps (gray_caps (kWidth, kHeight, "30000/1001"));
  const auto moved = Schedule::parse ("staircase:3x2,phase=2/1");
  EXPECT_EQ (h.push (flat_frame (*moved, 40)), GST_FLOW_OK);
  h.push_event (gst_event_new_eos ());
  const MessagePtr said = h.element_message ("moirecalib/phase");
  ASSERT_TRUE (said);
  EXPECT_EQ (string_field (said, "schedule"), "staircase:3x2,phase=2/1");
}

TEST (MoireCalibPhase, ChangesNothingElseOfTheSchedule)
{
  const std::string schedule =
      "staircase:3x2,order=5/3/1/0/2/4,active=4ms,switching=100us,"
      "readout=300us,leak=0.02,pilot=8";
  ElementHarness h ("moirecalib mode=phase schedule=" + schedule);
  h.set_caps (gray_caps (kWidth, kHeight, "30000/1001"));
  const auto moved = Schedule::parse (schedule + ",phase=2/1");
  ASSERT_TRUE (moved);
  EXPECT_EQ (h.push (flat_frame (*moved, 40)), GST_FLOW_OK);
  h.push_event (gst_event_new_eos ());
  const MessagePtr said = h.element_message ("moirecalib/phase");
  ASSERT_TRUE (said);
  const auto found = Schedule::parse (string_field (said, "schedule"));
  ASSERT_TRUE (found);
  EXPECT_EQ (*found, *moved);
}

TEST (MoireCalibPhase, WhatSaysNothingOfItIsWarnedOf)
{
  const struct {
    const char *settings;
    std::uint8_t light;
    const char *warning;
  } cases[] = {
      {"schedule=sequential:2x2", 40, "get the same light"},
      {"schedule=stairs:2x2", 40, "'stairs' is no code"},
      {"", 40, "the stream has no schedule in its tags"},
      {"schedule=staircase:2x2", 0,
          "before the phase of the tile was found: a phase needs a "
          "probability of 0.999, and the largest was 0.25"},
  };
  for (const auto &c : cases) {
    ElementHarness h ("moirecalib mode=phase " + std::string (c.settings));
    h.set_caps (gray_caps (kWidth, kHeight, "30000/1001"));
    for (int i = 0; i < 3; i++)
      EXPECT_EQ (h.push (flat_frame (Schedule (), c.light)), GST_FLOW_OK);
    h.push_event (gst_event_new_eos ());
    EXPECT_NE (h.warning ().find (c.warning), std::string::npos) << c.settings;
    EXPECT_NE (text_property (h.element (), "state"), "found") << c.settings;
  }
}
