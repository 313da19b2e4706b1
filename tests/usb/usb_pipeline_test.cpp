/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync with a board on the USB in a pipeline: masks, cancelled uploads and a
 * board that is disconnected. */
#include "emulated_dlpc350.h"
#include "emulation/dlpc900.h"
#include "mirrors.h"
#include "sync_harness.h"
#include "emulation/usb_bed.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;
using namespace codedexposure::emulated;

constexpr std::uint16_t kDlpc350 = 0x6401, kDlpc900 = 0xC900;
constexpr int kDlp5500 = 5;

/** Coded frames of 25 frames/s through a dmdsync with a board at 1-2. */
class PipelineWithBoard : public ::testing::Test
{
protected:
  void TearDown () override { set_state (GST_STATE_NULL); }

  void make (const std::string &schedule, const std::string &device = "usb:1-2")
  {
    const std::string text =
        "videotestsrc is-live=true ! "
        "video/x-raw,format=GRAY8,width=64,height=48,framerate=25/1 ! "
        "dmdsync device=" +
        device + " schedule=" + schedule + " ! fakesink sync=false";
    pipeline.reset (GST_ELEMENT (
        gst_object_ref_sink (gst_parse_launch (text.c_str (), nullptr))));
    bus.reset (gst_element_get_bus (pipeline.get ()));
  }
  void set_state (GstState state)
  {
    if (pipeline)
      gst_element_set_state (pipeline.get (), state);
  }
  /** The next message of that type within a minute. */
  MessagePtr wait_message (GstMessageType type)
  {
    return MessagePtr (
        gst_bus_timed_pop_filtered (bus.get (), 60 * GST_SECOND, type));
  }
  /** The end of the progress of the upload. */
  MessagePtr wait_upload ()
  {
    for (;;) {
      MessagePtr message = wait_message (GST_MESSAGE_PROGRESS);
      if (!message)
        return message;
      GstProgressType type;
      gst_message_parse_progress (message.get (), &type, nullptr, nullptr);
      if (type != GST_PROGRESS_TYPE_START && type != GST_PROGRESS_TYPE_CONTINUE)
        return message;
    }
  }

  UsbBed bed;
  ObjectPtr<GstElement> pipeline;
  ObjectPtr<GstBus> bus;
};

class UsbPipeline : public PipelineWithBoard
{
protected:
  void SetUp () override { bed.plug ("1-2", kDlpc900, "LCR", board); }

  std::shared_ptr<EmulatedDlpc900> board =
      std::make_shared<EmulatedDlpc900> (kDlp5500);
};

} // namespace

TEST_F (UsbPipeline, ShowsTheMasksOfTheScheduleUntilItStops)
{
  make ("staircase:4x1");
  set_state (GST_STATE_PLAYING);
  ASSERT_NE (wait_upload (), nullptr);
  ASSERT_NE (wait_message (GST_MESSAGE_ASYNC_DONE), nullptr);
  EXPECT_TRUE (board->running ());
  set_state (GST_STATE_NULL);
  EXPECT_FALSE (board->running ());

  const auto schedule = Schedule::from_preset ("staircase:4x1");
  for (int mask = 0; mask < schedule->masks (); mask++) {
    const auto shown = board->mirrors (mask);
    Image<std::uint8_t> expected (shown.width (), shown.height ());
    expected_mask (*schedule, mask, expected.view ());
    EXPECT_TRUE (shown == expected) << mask;
  }
}

TEST_F (UsbPipeline, AnUploadEndsWithTheStateThatWantedIt)
{
  make ("sequential:2x2"); // 2.4 MB
  set_state (GST_STATE_PAUSED);
  const MessagePtr begun = wait_message (GST_MESSAGE_PROGRESS);
  ASSERT_NE (begun, nullptr);
  gchar *text = nullptr;
  gst_message_parse_progress (begun.get (), nullptr, nullptr, &text);
  EXPECT_STREQ (text, "0 % of the masks of sequential:2x2 sent to usb:1-2 "
                      "(DLP5500), 37.4s or more left");
  g_free (text);
  set_state (GST_STATE_NULL);
  EXPECT_EQ (board->images_received (), 0);
  EXPECT_FALSE (board->running ());
}

TEST_F (UsbPipeline, APulledPlugIsOneErrorAndACleanStop)
{
  make ("sequential:2x2");
  set_state (GST_STATE_PLAYING);
  ASSERT_NE (wait_message (GST_MESSAGE_PROGRESS), nullptr);
  bed.unplug ("1-2");
  const MessagePtr message = wait_message (GST_MESSAGE_ERROR);
  ASSERT_NE (message, nullptr);
  GError *error = nullptr;
  gchar *debug = nullptr;
  gst_message_parse_error (message.get (), &error, &debug);
  const std::string said = std::string (error->message) + (debug ? debug : "");
  EXPECT_NE (said.find ("usb:1-2 was unplugged"), said.npos) << said;
  g_error_free (error);
  g_free (debug);
  set_state (GST_STATE_NULL);
}

TEST_F (PipelineWithBoard, ADlpc350ShowsTheMasksOfItsFlash)
{
  const auto board = std::make_shared<EmulatedDlpc350> ();
  bed.plug ("1-2", kDlpc350, "LCR2", board);
  make ("sequential:4x1", "usb:1-2,images=0");
  set_state (GST_STATE_PLAYING);
  ASSERT_NE (wait_message (GST_MESSAGE_ASYNC_DONE), nullptr);
  EXPECT_TRUE (board->running ());
  EXPECT_EQ (board->lines ().size (), 4u);
  EXPECT_EQ (board->period (), 10'000u);
  set_state (GST_STATE_NULL);
  EXPECT_FALSE (board->running ());
}

/** In a pipeline, a fault is either corrected or causes one error; the board is
 * stopped at the end. */
class UsbPipelineFaults
    : public PipelineWithBoard,
      public ::testing::WithParamInterface<std::tuple<std::uint16_t, Fault>>
{
protected:
  void SetUp () override
  {
    if (product () == kDlpc900)
      board = std::make_shared<EmulatedDlpc900> (kDlp5500);
    else
      board = std::make_shared<EmulatedDlpc350> ();
    bed.plug ("1-2", product (), "LCR", board);
  }

  std::uint16_t product () const { return std::get<0> (GetParam ()); }
  Fault fault () const { return std::get<1> (GetParam ()); }
  /** Numbers of the messages that are struck, from the opening on: of the
   * table, and the start. */
  std::vector<int> struck () const
  {
    return product () == kDlpc900 ? std::vector{12, 24} : std::vector{9, 16};
  }

  std::shared_ptr<EmulatedHid> board;
};

TEST_P (UsbPipelineFaults, EndInOneErrorOrInMasks)
{
  for (const int message : struck ()) {
    board->faults = {{board->messages () + message, fault ()}};
    make ("sequential:4x1", std::string ("usb:1-2,patience=500ms") +
                                (product () == kDlpc350 ? ",images=0" : ""));
    set_state (GST_STATE_PLAYING);
    const MessagePtr message_of_end (
        gst_bus_timed_pop_filtered (bus.get (), 60 * GST_SECOND,
            GstMessageType (GST_MESSAGE_ERROR | GST_MESSAGE_ASYNC_DONE)));
    ASSERT_NE (message_of_end, nullptr);
    EXPECT_LT (board->faults.begin ()->first, board->messages ())
        << "nothing was struck";
    set_state (GST_STATE_NULL);
    EXPECT_TRUE (board->gone () || !board->running ()) << message;
    int errors =
        GST_MESSAGE_TYPE (message_of_end.get ()) == GST_MESSAGE_ERROR ? 1 : 0;
    /* The source may also report the end of its stream. */
    while (const MessagePtr more{
        gst_bus_pop_filtered (bus.get (), GST_MESSAGE_ERROR)})
      errors += GST_MESSAGE_SRC (more.get ()) ==
                GST_MESSAGE_SRC (message_of_end.get ());
    EXPECT_LE (errors, 1) << message;
    if (fault () == Fault::none || fault () == Fault::stale_reply) {
      EXPECT_EQ (errors, 0) << message;
    }
    if (board->gone ())
      return;
  }
}

INSTANTIATE_TEST_SUITE_P (All, UsbPipelineFaults,
    ::testing::Combine (::testing::Values (kDlpc900, kDlpc350),
        ::testing::Values (Fault::none, Fault::refuse, Fault::lose_reply,
            Fault::late_reply, Fault::stale_reply, Fault::short_reply,
            Fault::stall, Fault::unplug)));
