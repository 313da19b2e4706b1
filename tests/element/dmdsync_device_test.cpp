/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync and its DMD: states, upload, limits and failures; the mirrors are
 * parked whenever they are not needed. */
#include <algorithm>
#include <atomic>
#include <deque>
#include <thread>

#include <gst/base/gstbasesrc.h>

#include "dmd/simulated_dmd.h"
#include "sync_harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

/** A dmdsync without a pipeline, whose states the test changes. */
class Device
{
public:
  explicit Device (const std::string &settings)
      : bus_ (gst_bus_new ()),
        element_ (GST_ELEMENT (gst_object_ref_sink (
            gst_parse_launch (("dmdsync " + settings).c_str (), nullptr))))
  {
    gst_element_set_bus (element_.get (), bus_.get ());
  }
  ~Device ()
  {
    set_state (GST_STATE_NULL);
    gst_element_set_bus (element_.get (), nullptr);
  }

  GstElement *element () { return element_.get (); }
  GstStateChangeReturn set_state (GstState state)
  {
    return gst_element_set_state (element_.get (), state);
  }
  /** The next message of @p type, or null. */
  MessagePtr message (GstMessageType type)
  {
    while (GstMessage *next = gst_bus_pop (bus_.get ()))
      messages_.emplace_back (next);
    return take (type);
  }
  MessagePtr wait_message (GstMessageType type)
  {
    while (true) {
      GstMessage *next = gst_bus_timed_pop (bus_.get (), 60 * GST_SECOND);
      if (!next)
        return nullptr;
      messages_.emplace_back (next);
      if (GST_MESSAGE_TYPE (next) == type)
        return take (type);
    }
  }
  std::string error ()
  {
    const MessagePtr found = message (GST_MESSAGE_ERROR);
    if (!found)
      return "";
    GError *error = nullptr;
    gst_message_parse_error (found.get (), &error, nullptr);
    const std::string text = error->message;
    g_error_free (error);
    return text;
  }
  /** Types of the progress messages so far. */
  std::vector<GstProgressType> progress ()
  {
    std::vector<GstProgressType> types;
    while (const MessagePtr found = message (GST_MESSAGE_PROGRESS)) {
      GstProgressType type;
      gchar *code = nullptr;
      gst_message_parse_progress (found.get (), &type, &code, nullptr);
      EXPECT_STREQ (CharPtr (code).get (), "upload");
      types.push_back (type);
    }
    return types;
  }

private:
  MessagePtr take (GstMessageType type)
  {
    const auto found = std::find_if (messages_.begin (), messages_.end (),
        [type] (const MessagePtr &message) {
          return GST_MESSAGE_TYPE (message.get ()) == type;
        });
    if (found == messages_.end ())
      return nullptr;
    MessagePtr taken = std::move (*found);
    messages_.erase (found);
    return taken;
  }

  ObjectPtr<GstBus> bus_;
  ObjectPtr<GstElement> element_;
  std::deque<MessagePtr> messages_;
};

TEST (DmdsyncDevice, OpensUploadsStartsAndParks)
{
  const auto mirrors = SimulatedMirrors::find ("life");
  SyncHarness sync ("device=sim:life schedule=staircase:2x2");
  EXPECT_EQ (mirrors->schedule (), *Schedule::parse ("staircase:2x2"));
  EXPECT_FALSE (mirrors->running ()) << "the frame period is not known";
  sync.start ();
  EXPECT_TRUE (mirrors->running ());
  sync.send_frames (0, 3);

  gst_element_set_state (sync.element (), GST_STATE_READY);
  EXPECT_FALSE (mirrors->running ());
  EXPECT_EQ (sync.error () + sync.warning (), "");
}

TEST (DmdsyncDevice, SaysHowTheUploadGoes)
{
  Device device ("device=sim:progress schedule=staircase:2x2");
  device.set_state (GST_STATE_READY);
  EXPECT_TRUE (device.progress ().empty ());
  EXPECT_EQ (device.set_state (GST_STATE_PAUSED), GST_STATE_CHANGE_SUCCESS);
  while (!SimulatedMirrors::find ("progress")->schedule ())
    std::this_thread::yield ();
  device.set_state (GST_STATE_READY);
  EXPECT_EQ (device.progress (),
      (std::vector{GST_PROGRESS_TYPE_START, GST_PROGRESS_TYPE_CONTINUE,
          GST_PROGRESS_TYPE_CONTINUE, GST_PROGRESS_TYPE_CONTINUE,
          GST_PROGRESS_TYPE_COMPLETE}));
}

TEST (DmdsyncDevice, StaysAsItIsWhereTheRateStays)
{
  const auto mirrors = SimulatedMirrors::find ("renegotiated");
  SyncHarness sync ("device=sim:renegotiated");
  sync.start ();
  EXPECT_EQ (mirrors->mask_in_slot (0), 0);
  sync.set_caps (gray_caps (32, 32, "25/1"));
  EXPECT_EQ (mirrors->mask_in_slot (1), 1) << "the masks go on";
  sync.set_caps (gray_caps (32, 32, "50/1"));
  EXPECT_EQ (mirrors->mask_in_slot (2), std::nullopt) << "started anew";
}

TEST (DmdsyncDevice, RunsAgain)
{
  const auto mirrors = SimulatedMirrors::find ("again");
  SyncHarness sync ("device=sim:again schedule=staircase:2x2");
  for (int run = 0; run < 3; run++) {
    SCOPED_TRACE (run);
    sync.start ();
    sync.send_frames (0, 3);
    EXPECT_TRUE (mirrors->running ());
    EXPECT_EQ (sync.counter ("frames-in"), 3u);
    BufferPtr first = sync.pull ();
    ASSERT_TRUE (first);
    EXPECT_EQ (GST_BUFFER_OFFSET (first.get ()), 0u);
    while (sync.pull ())
      ;
    gst_element_set_state (
        sync.element (), run == 1 ? GST_STATE_NULL : GST_STATE_READY);
    EXPECT_FALSE (mirrors->running ());
    gst_element_set_state (sync.element (), GST_STATE_PLAYING);
    sync.push_event (gst_event_new_stream_start ("again"));
  }
  EXPECT_EQ (sync.error (), "");
}

TEST (DmdsyncDevice, IsFixedWhileOpenAndTheScheduleWhileItRuns)
{
  Device device ("device=sim:fixed schedule=staircase:2x2");
  const auto set = [&] {
    g_object_set (device.element (), "device", "sim:other", "schedule",
        "sequential:3x3", nullptr);
  };
  device.set_state (GST_STATE_PAUSED);
  set ();
  EXPECT_EQ (text_property (device.element (), "device"), "sim:fixed");
  EXPECT_EQ (text_property (device.element (), "schedule"), "staircase:2x2");

  device.set_state (GST_STATE_READY);
  set ();
  EXPECT_EQ (text_property (device.element (), "device"), "sim:fixed");
  EXPECT_EQ (text_property (device.element (), "schedule"), "sequential:3x3");
  const auto mirrors = SimulatedMirrors::find ("fixed");
  device.set_state (GST_STATE_PAUSED);
  while (mirrors->schedule () != *Schedule::parse ("sequential:3x3"))
    std::this_thread::yield ();

  device.set_state (GST_STATE_READY);
  g_object_set (device.element (), "schedule", "staircase:2x9999", nullptr);
  EXPECT_EQ (device.set_state (GST_STATE_PAUSED), GST_STATE_CHANGE_FAILURE);
  EXPECT_NE (device.error ().find ("2x9999"), std::string::npos);
}

TEST (DmdsyncDevice, ThatCannotBeOpenedIsNamed)
{
  for (const char *name : {"usb:1-2", "sim:broken,fail=open", "sim:"}) {
    SCOPED_TRACE (name);
    Device device ("device=" + std::string (name));
    EXPECT_EQ (device.set_state (GST_STATE_READY), GST_STATE_CHANGE_FAILURE);
    EXPECT_NE (device.error ().find (name), std::string::npos);
  }
}

TEST (DmdsyncDevice, AScheduleThatCannotBeReadIsAnErrorBeforeTheDeviceIs)
{
  Device device ("device=sim:unread schedule=staircase:2x9999");
  EXPECT_EQ (device.set_state (GST_STATE_READY), GST_STATE_CHANGE_FAILURE);
  EXPECT_NE (device.error ().find ("2x9999"), std::string::npos);
}

TEST (DmdsyncDevice, HasOneOwner)
{
  Device owner ("device=sim:owned"), second ("device=sim:owned");
  ASSERT_EQ (owner.set_state (GST_STATE_READY), GST_STATE_CHANGE_SUCCESS);
  EXPECT_EQ (second.set_state (GST_STATE_READY), GST_STATE_CHANGE_FAILURE);
  EXPECT_NE (second.error ().find ("sim:owned is in use"), std::string::npos);
  owner.set_state (GST_STATE_NULL);
  EXPECT_EQ (second.set_state (GST_STATE_READY), GST_STATE_CHANGE_SUCCESS);
}

TEST (DmdsyncDevice, AFailedUploadEndsInOneErrorWithTheMirrorsParked)
{
  Device device ("device=sim:no-upload,fail=upload");
  EXPECT_EQ (device.set_state (GST_STATE_PAUSED), GST_STATE_CHANGE_SUCCESS);
  ASSERT_TRUE (device.wait_message (GST_MESSAGE_ERROR));
  const ObjectPtr<GstPad> sink (
      gst_element_get_static_pad (device.element (), "sink"));
  EXPECT_FALSE (
      gst_pad_send_event (sink.get (), gst_event_new_stream_start ("s")));
  device.set_state (GST_STATE_READY);
  EXPECT_EQ (device.error (), "");
  EXPECT_EQ (device.progress (),
      (std::vector{GST_PROGRESS_TYPE_START, GST_PROGRESS_TYPE_ERROR}));
  EXPECT_FALSE (SimulatedMirrors::find ("no-upload")->running ());
}

TEST (DmdsyncDevice, AFailedStartEndsInAnErrorThatNamesIt)
{
  SyncHarness sync ("device=sim:no-start,fail=start");
  sync.start ();
  EXPECT_NE (sync.send (0), GST_FLOW_OK);
  EXPECT_NE (sync.error ().find ("sim:no-start"), std::string::npos);
  EXPECT_FALSE (SimulatedMirrors::find ("no-start")->running ());
}

TEST (DmdsyncDevice, SlotsThatItCannotShowAreAnErrorWithTheNumbers)
{
  const auto mirrors = SimulatedMirrors::find ("slow");
  SyncHarness sync (
      "device=sim:slow,min-active=200us schedule=sequential:16x16");
  sync.start ();
  EXPECT_NE (sync.send (0), GST_FLOW_OK);
  const std::string error = sync.error ();
  for (const char *number : {"256 slots", "200us", "40ms", "156.25us"})
    EXPECT_NE (error.find (number), std::string::npos) << error;
  EXPECT_FALSE (mirrors->running ());
}

TEST (DmdsyncDevice, AnUploadIsCancelledByAChangeOfState)
{
  Device device ("device=sim:endless,mask-time=3000s");
  EXPECT_EQ (device.set_state (GST_STATE_PAUSED), GST_STATE_CHANGE_SUCCESS)
      << "whoever asks for a state does not wait for a slow upload";
  const ObjectPtr<GstPad> sink (
      gst_element_get_static_pad (device.element (), "sink"));
  std::atomic<bool> sending = false;
  std::thread streaming ([&] {
    sending = true;
    gst_pad_send_event (sink.get (), gst_event_new_stream_start ("s"));
  });
  while (!sending)
    std::this_thread::yield ();
  EXPECT_EQ (device.set_state (GST_STATE_NULL), GST_STATE_CHANGE_SUCCESS);
  streaming.join ();
  EXPECT_EQ (device.progress (),
      (std::vector{GST_PROGRESS_TYPE_START, GST_PROGRESS_TYPE_CANCELED}));
  EXPECT_EQ (device.error (), "");
}

TEST (DmdsyncDevice, AFlushFreesAStreamThatWaitsForAnUpload)
{
  Device device ("device=sim:flushed,mask-time=3000s");
  device.set_state (GST_STATE_PAUSED);
  const ObjectPtr<GstPad> sink (
      gst_element_get_static_pad (device.element (), "sink"));
  gboolean sent = TRUE;
  std::thread streaming ([&] {
    sent = gst_pad_send_event (sink.get (), gst_event_new_stream_start ("s"));
  });
  gst_pad_send_event (sink.get (), gst_event_new_flush_start ());
  streaming.join ();
  EXPECT_FALSE (sent);
}

TEST (DmdsyncDevice, IsParkedAfterEveryChangeOfStateUnderStress)
{
  const auto mirrors = SimulatedMirrors::find ("stress");
  const ObjectPtr<GstElement> pipeline (
      GST_ELEMENT (gst_object_ref_sink (gst_parse_launch (
          "videotestsrc ! "
          "video/x-raw,format=GRAY8,width=64,height=48,framerate=100/1 ! "
          "codedexposure-sim dmd=sim:stress ! "
          "dmdsync device=sim:stress,mask-time=50us schedule=staircase:2x2 ! "
          "codedexposure-demux ! queue ! fakesink",
          nullptr))));
  std::atomic<int> errors = 0;
  const ObjectPtr<GstBus> bus (gst_element_get_bus (pipeline.get ()));
  gst_bus_set_sync_handler (
      bus.get (),
      [] (GstBus *, GstMessage *message, gpointer errors) {
        /* A source reports an error if its first events meet pads that are
         * being stopped. */
        if (GST_MESSAGE_TYPE (message) == GST_MESSAGE_ERROR &&
            !GST_IS_BASE_SRC (GST_MESSAGE_SRC (message)))
          ++*static_cast<std::atomic<int> *> (errors);
        return GST_BUS_PASS;
      },
      &errors, nullptr);
  for (int cycle = 0; cycle < 200; cycle++) {
    gst_element_set_state (
        pipeline.get (), cycle % 3 ? GST_STATE_PAUSED : GST_STATE_PLAYING);
    if (cycle % 4 == 0)
      while (!mirrors->running ())
        std::this_thread::yield ();
    gst_element_set_state (
        pipeline.get (), cycle % 2 ? GST_STATE_READY : GST_STATE_NULL);
    EXPECT_FALSE (mirrors->running ()) << cycle;
  }
  gst_element_set_state (pipeline.get (), GST_STATE_NULL);
  EXPECT_EQ (errors, 0);
}

} // namespace
