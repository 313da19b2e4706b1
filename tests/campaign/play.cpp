/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "play.h"

#include <stdexcept>

#include <gst/app/gstappsink.h>
#include <gst/app/gstappsrc.h>

namespace codedexposure::campaign
{

using namespace codedexposure::gst;

namespace
{

struct MessageUnref {
  void operator() (GstMessage *message) const { gst_message_unref (message); }
};
using MessagePtr = std::unique_ptr<GstMessage, MessageUnref>;

std::string
text_of (GstMessage *message)
{
  GError *error = nullptr;
  switch (GST_MESSAGE_TYPE (message)) {
  case GST_MESSAGE_ERROR:
    gst_message_parse_error (message, &error, nullptr);
    break;
  case GST_MESSAGE_WARNING:
    gst_message_parse_warning (message, &error, nullptr);
    break;
  default:
    gst_message_parse_info (message, &error, nullptr);
    break;
  }
  std::string text = error->message;
  g_error_free (error);
  return text;
}

std::string
caps_text (int rate)
{
  return "video/x-raw,format=GRAY8,width=" + std::to_string (kWidth) +
         ",height=" + std::to_string (kHeight) +
         ",framerate=" + std::to_string (rate) + "/1";
}

} // namespace

Play::Play (const std::string &line)
{
  GError *error = nullptr;
  GstElement *made = gst_parse_launch (line.c_str (), &error);
  if (!made || error)
    throw std::runtime_error (line + ": " + (error ? error->message : ""));
  pipeline_.reset (GST_ELEMENT (gst_object_ref_sink (made)));
  bus_.reset (gst_element_get_bus (made));
}

Play::~Play ()
{
  stop ();
}

void
Play::start ()
{
  gst_element_set_state (pipeline_.get (), GST_STATE_PLAYING);
}

void
Play::start_at (double rate, GstSeekFlags flags)
{
  gst_element_set_state (pipeline_.get (), GST_STATE_PAUSED);
  gst_element_get_state (
      pipeline_.get (), nullptr, nullptr, 20 * GST_SECOND);
  gst_element_seek (pipeline_.get (), rate, GST_FORMAT_TIME,
      GstSeekFlags (flags | GST_SEEK_FLAG_FLUSH), GST_SEEK_TYPE_SET, 0,
      GST_SEEK_TYPE_END, 0);
  start ();
}

void
Play::stop ()
{
  gst_element_set_state (pipeline_.get (), GST_STATE_NULL);
}

ObjectPtr<GstElement>
Play::find (const char *name) const
{
  return ObjectPtr<GstElement> (
      gst_bin_get_by_name (GST_BIN (pipeline_.get ()), name));
}

ObjectPtr<GstPad>
Play::pad (const char *element, const char *name) const
{
  return ObjectPtr<GstPad> (
      gst_element_get_static_pad (find (element).get (), name));
}

void
Play::note (GstMessage *message)
{
  switch (GST_MESSAGE_TYPE (message)) {
  case GST_MESSAGE_ELEMENT: {
    const GstStructure *structure = gst_message_get_structure (message);
    const std::string name = gst_structure_get_name (structure);
    if (name.starts_with ("codedexposure/") || name.starts_with ("dmdsync/"))
      told[name]++;
    break;
  }
  case GST_MESSAGE_ERROR:
    error = text_of (message);
    told["error: " + error]++;
    break;
  case GST_MESSAGE_WARNING:
    told["warning: " + text_of (message)]++;
    break;
  case GST_MESSAGE_INFO:
    if (text_of (message).starts_with ("The frames are "))
      told["info: " + text_of (message)]++;
    break;
  default:
    break;
  }
}

void
Play::wait (GstClockTime patience)
{
  for (;;) {
    const MessagePtr message (
        gst_bus_timed_pop (bus_.get (), error.empty () ? patience : 0));
    if (!message) {
      hung = error.empty ();
      return;
    }
    note (message.get ());
    if (GST_MESSAGE_TYPE (message.get ()) == GST_MESSAGE_EOS)
      return;
  }
}

bool
Play::wait_for (const std::string &name, GstClockTime patience)
{
  const GstClockTime until = gst_util_get_timestamp () + patience;
  for (;;) {
    const GstClockTime now = gst_util_get_timestamp ();
    const MessagePtr message (
        gst_bus_timed_pop (bus_.get (), until > now ? until - now : 0));
    if (!message)
      return false;
    note (message.get ());
    if (gst_message_has_name (message.get (), name.c_str ()))
      return true;
    if (!error.empty ())
      return false;
  }
}

bool
Play::poll ()
{
  while (error.empty ()) {
    const MessagePtr message (gst_bus_pop (bus_.get ()));
    if (!message)
      return true;
    note (message.get ());
  }
  return error.empty ();
}

bool
Play::told_of_the_end () const
{
  return !error.empty () || told.count ("codedexposure/stream-cut") ||
         told.count ("codedexposure/frames-missing");
}

BenchPlay::BenchPlay (const Settings &settings)
    : play (
          "appsrc name=scene format=time block=true max-buffers=8 max-bytes=0 "
          "caps=\"" +
          caps_text (100) + "\" ! codedexposure-sim dmd=sim:" + settings.name +
          " " + settings.optics +
          " ! appsink name=cable sync=false async=false appsrc name=camera "
          "format=time "
          "max-buffers=0 max-bytes=0 caps=\"" +
          caps_text (25) + "\" ! dmdsync name=sync device=\"sim:" +
          settings.name + settings.slips + "\" schedule=" + settings.schedule +
          " " + settings.sync + " ! " + settings.tail),
      scene_ (play.find ("scene")), cable_ (play.find ("cable")),
      camera_ (play.find ("camera"))
{
}

void
BenchPlay::start ()
{
  play.start ();
  const auto sink = play.pad ("sync", "sink");
  for (int tries = 0; tries < 20'000 && !gst_pad_has_current_caps (sink.get ());
       tries++)
    g_usleep (500);
}

BufferPtr
BenchPlay::expose ()
{
  for (int s = 0; s < kSlots; s++, slot_++) {
    GstBuffer *buffer =
        gst_buffer_new_allocate (nullptr, kWidth * kHeight, nullptr);
    GST_BUFFER_PTS (buffer) = GstClockTime (slot_) * kSlotTime;
    GST_BUFFER_DURATION (buffer) = kSlotTime;
    GstMapInfo map;
    gst_buffer_map (buffer, &map, GST_MAP_WRITE);
    draw_slot (slot_, {map.data, kWidth, kHeight, kWidth});
    gst_buffer_unmap (buffer, &map);
    gst_app_src_push_buffer (GST_APP_SRC (scene_.get ()), buffer);
  }
  GstSample *sample = gst_app_sink_try_pull_sample (
      GST_APP_SINK (cable_.get ()), 20 * GST_SECOND);
  if (!sample)
    return nullptr;
  BufferPtr frame (gst_buffer_copy (gst_sample_get_buffer (sample)));
  gst_sample_unref (sample);
  return frame;
}

bool
BenchPlay::send (BufferPtr frame)
{
  constexpr guint64 kCable = 2; // frames on their way
  while (gst_app_src_get_current_level_buffers (GST_APP_SRC (camera_.get ())) >=
         kCable) {
    if (!play.poll ())
      return false;
    g_usleep (100);
  }
  return gst_app_src_push_buffer (
             GST_APP_SRC (camera_.get ()), frame.release ()) == GST_FLOW_OK;
}

void
BenchPlay::end ()
{
  gst_app_src_end_of_stream (GST_APP_SRC (scene_.get ()));
  gst_app_src_end_of_stream (GST_APP_SRC (camera_.get ()));
  play.wait ();
}

} // namespace codedexposure::campaign
