/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "kept_file.h"

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "base/part.h"
#include "common/kept_frame.h"
#include "common/meta.h"
#include "record/track.h"

namespace codedexposure::gst
{

namespace
{

/* A name that is free, also for the lines, and that no run left unfinished. */
std::string
free_name (const std::string &begin)
{
  const auto is_free = [] (const std::string &name) {
    std::error_code ignored;
    return !std::filesystem::exists (name, ignored) &&
           !std::filesystem::exists (name + ".part", ignored);
  };
  for (int k = 1;; k++) {
    std::string name = begin + (k > 1 ? "-" + std::to_string (k) : "") + ".mkv";
    if (is_free (name) && is_free (sidecar_of (name)))
      return name;
  }
}

std::string
name_of (const std::string &begin, GstBuffer *first)
{
  const auto meta = get_frame_meta (first);
  char number[32];
  std::snprintf (number, sizeof number, "-frame%06" PRIu64,
      std::uint64_t (meta ? meta->frame : 0));
  return free_name (begin + number);
}

/* Without a full stop. That of a frame says what to do. */
std::string
with_remedy (const GError &error)
{
  const std::string text = error.message;
  if (error.domain == GST_RESOURCE_ERROR)
    return text + " Free space on the disk, and keep again";
  return text.substr (0, text.find_last_not_of ('.') + 1);
}

/* Why @pipeline has not come to its end; "": it has. */
std::string
failure_of (GstElement *pipeline)
{
  const ObjectPtr<GstBus> bus (gst_element_get_bus (pipeline));
  const std::unique_ptr<GstMessage, MiniObjectUnref> message (
      gst_bus_timed_pop_filtered (bus.get (), GST_CLOCK_TIME_NONE,
          GstMessageType (GST_MESSAGE_EOS | GST_MESSAGE_ERROR)));
  if (GST_MESSAGE_TYPE (message.get ()) == GST_MESSAGE_EOS)
    return "";
  GError *error = nullptr;
  gst_message_parse_error (message.get (), &error, nullptr);
  const std::string text = with_remedy (*error);
  g_error_free (error);
  return text;
}

/* To a source pad, as a stream that ends. */
void
push_all (GstPad *pad, KeptFrames frames)
{
  gst_pad_set_active (pad, TRUE);
  gst_pad_push_event (pad, gst_event_new_stream_start ("kept"));
  gst_pad_push_event (pad, gst_event_new_caps (frames.caps.get ()));
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  gst_pad_push_event (pad, gst_event_new_segment (&segment));
  if (frames.tag)
    gst_pad_push_event (pad, frames.tag.release ());
  for (BufferPtr &buffer : frames.buffers)
    if (gst_pad_push (pad, buffer.release ()) != GST_FLOW_OK)
      break;
  gst_pad_push_event (pad, gst_event_new_eos ());
  gst_pad_set_active (pad, FALSE);
}

/* Returns why not; "": it did. One thread encodes: those of the stream come
 * first. */
std::string
write (
    KeptFrames frames, const std::string &recording, const std::string &sidecar)
{
  const ObjectPtr<GstElement> pipeline (
      GST_ELEMENT (gst_object_ref_sink (gst_pipeline_new (nullptr))));
  const auto add = [&pipeline] (const char *factory) {
    GstElement *made = gst_element_factory_make (factory, nullptr);
    if (made)
      gst_bin_add (GST_BIN (pipeline.get ()), made);
    return made;
  };
  GstElement *mux = add ("codedexposure-recordmux"), *sink = add ("filesink");
  if (!mux || !sink)
    return "its elements are not installed";
  gst_element_link (mux, sink);
  g_object_set (mux, "threads", 1, "log-location", sidecar.c_str (), nullptr);
  g_object_set (sink, "location", recording.c_str (), nullptr);
  const ObjectPtr<GstPad> pad (
      GST_PAD (gst_object_ref_sink (gst_pad_new ("frames", GST_PAD_SRC))));
  gst_pad_link (pad.get (), pad_of (mux, "sink").get ());
  gst_element_set_state (pipeline.get (), GST_STATE_PLAYING);
  push_all (pad.get (), std::move (frames));
  const std::string failed = failure_of (pipeline.get ());
  gst_element_set_state (pipeline.get (), GST_STATE_NULL);
  return failed;
}

} // namespace

GstClockTime
KeptFrames::length () const
{
  if (buffers.empty ())
    return 0;
  const GstClockTime first = GST_BUFFER_PTS (buffers.front ().get ());
  const GstClockTime last = GST_BUFFER_PTS (buffers.back ().get ());
  return std::max (first, last) - std::min (first, last);
}

void
KeptFrames::limit (GstClockTime longest, std::uint64_t most_bytes)
{
  while (buffers.size () > 1 && (length () > longest || bytes > most_bytes)) {
    bytes -= bytes_of (buffers.front ().get ());
    buffers.pop_front ();
  }
}

void
KeptFrames::clear ()
{
  buffers.clear ();
  bytes = 0;
}

KeptFrames
KeptFrames::copy () const
{
  KeptFrames made;
  made.bytes = bytes;
  if (caps)
    made.caps.reset (gst_caps_ref (caps.get ()));
  if (tag)
    made.tag.reset (gst_event_ref (tag.get ()));
  for (const BufferPtr &buffer : buffers)
    made.buffers.emplace_back (gst_buffer_ref (buffer.get ()));
  if (!buffers.empty () && GST_BUFFER_PTS (buffers.back ().get ()) <
                               GST_BUFFER_PTS (buffers.front ().get ()))
    std::ranges::reverse (made.buffers);
  return made;
}

Result<std::string>
write_kept (KeptFrames frames, const std::string &begin)
{
  const std::string name = name_of (begin, frames.buffers.front ().get ());
  Part recording (name, Part::kFile), sidecar (sidecar_of (name), Part::kFile);
  if (const auto claimed = recording.claim (false); !claimed)
    return claimed.error ();
  if (const auto claimed = sidecar.claim (false); !claimed) {
    recording.discard ();
    return claimed.error ();
  }
  const std::string failed =
      write (std::move (frames), recording.path (), sidecar.path ());
  Result<void> done =
      failed.empty ()
          ? recording.publish (false)
          : Error{"cannot write " + name + ": " + failed, ErrorCode::io};
  if (done)
    done = sidecar.publish (false);
  if (done)
    return name;
  recording.discard ();
  sidecar.discard ();
  return done.error ();
}

} // namespace codedexposure::gst
