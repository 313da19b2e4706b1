/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "keeper.h"

#include <filesystem>
#include <memory>
#include <utility>

#include <gst/app/gstappsrc.h>

#include "base/pixels.h"
#include "common/element.h"
#include "common/meta.h"
#include "common/tag.h"
#include "pipeline/graph.h"
#include "pipeline/messages.h"
#include "pipeline/part.h"
#include "pipeline/recording.h"
#include "window/kept_frame.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

/* A name that is free, also for the sidecar. */
std::string
free_name (const std::string &begin)
{
  std::error_code ignored;
  for (int k = 1;; k++) {
    const std::string name =
        begin + (k > 1 ? "-" + std::to_string (k) : "") + ".mkv";
    if (!std::filesystem::exists (name, ignored) &&
        !std::filesystem::exists (sidecar_of (name), ignored))
      return name;
  }
}

/* Why a pipeline has not come to its end; "": it has. */
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
  const std::string text = error->message;
  g_error_free (error);
  return text;
}

} // namespace

GstClockTime
Keeper::Frames::length () const
{
  if (buffers.empty ())
    return 0;
  const GstClockTime first = GST_BUFFER_PTS (buffers.front ().get ());
  const GstClockTime last = GST_BUFFER_PTS (buffers.back ().get ());
  return last > first ? last - first : 0;
}

Keeper::Keeper (GstPad *pad, std::string name, const Rule &rule)
    : name_ (std::move (name)), after_ (guint (1000 * rule.after)),
      bits_ (rule.bits), most_bytes_ (room_in_memory ())
{
  if (rule.event)
    events_.emplace (*rule.event);
  gst_pad_add_probe (pad,
      GstPadProbeType (
          GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM),
      on_data, this, nullptr);
}

Keeper::~Keeper ()
{
  if (writer_.joinable ())
    writer_.join ();
  while (g_source_remove_by_user_data (this)) {
  }
}

GstPadProbeReturn
Keeper::on_data (GstPad *, GstPadProbeInfo *info, gpointer self)
{
  auto *keeper = static_cast<Keeper *> (self);
  if (GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_BUFFER)
    keeper->take (GST_PAD_PROBE_INFO_BUFFER (info));
  else
    keeper->follow (GST_PAD_PROBE_INFO_EVENT (info));
  return GST_PAD_PROBE_OK;
}

void
Keeper::take (GstBuffer *frame)
{
  if (!GST_BUFFER_PTS_IS_VALID (frame))
    return;
  if (events_)
    watch (frame);
  BufferPtr kept = kept_frame (frame);
  const std::lock_guard lock (mutex_);
  frames_.buffers.push_back (std::move (kept));
  frames_.bytes += gst_buffer_get_size (frame);
  while (frames_.buffers.size () > 1 &&
         (frames_.length () > kLength || frames_.bytes > most_bytes_)) {
    frames_.bytes -= gst_buffer_get_size (frames_.buffers.front ().get ());
    frames_.buffers.pop_front ();
  }
}

/* Frames that are damaged or show a pattern are no events. */
void
Keeper::watch (GstBuffer *frame)
{
  const auto meta = get_frame_meta (frame);
  if (!info_ || is_corrupted (frame) || (meta && !meta->pattern.empty ()))
    return events_->skip ();
  if (meta && last_ && meta->frame != *last_ + 1)
    events_->skip ();
  last_ = meta ? std::optional (meta->frame) : std::nullopt;
  const int bits = bits_of (frame, *info_, bits_);
  MappedFrame mapped (*info_, frame, GST_MAP_READ);
  if (!mapped)
    return events_->skip ();
  const auto jump = read_pixels (mapped, [&] (auto pixels) {
    return events_->add (pixels, largest_pixel (bits));
  });
  if (!jump)
    return;
  const std::string which =
      meta ? format ("frame %" G_GUINT64_FORMAT, meta->frame)
           : format ("at %.3f s", 1e-9 * double (GST_BUFFER_PTS (frame)));
  const std::lock_guard lock (mutex_);
  add (
      {format ("%s: %+.3g %% of the largest value, %s; keeps the frames around "
               "it in %.3g s",
           events_->rule ().kind == EventRule::Kind::mean ? "the mean jumps"
                                                          : "motion",
           100 * *jump, which.c_str (), 1e-3 * after_),
          false, true});
}

void
Keeper::follow (GstEvent *event)
{
  const std::lock_guard lock (mutex_);
  const auto begin_anew = [this] {
    frames_.buffers.clear ();
    frames_.bytes = 0;
  };
  if (GST_EVENT_TYPE (event) == GST_EVENT_FLUSH_STOP)
    begin_anew ();
  if (GST_EVENT_TYPE (event) == GST_EVENT_CAPS) {
    GstCaps *caps = nullptr;
    gst_event_parse_caps (event, &caps);
    if (frames_.caps && !gst_caps_is_equal (frames_.caps.get (), caps))
      begin_anew ();
    frames_.caps.reset (gst_caps_ref (caps));
    GstVideoInfo info;
    info_.reset ();
    if (gst_video_info_from_caps (&info, caps))
      info_ = info;
    if (info_ && events_ && !events_->fits ({info.width, info.height}))
      add ({"the region " + rect_text (*events_->rule ().region) +
                " is not within the frames of " +
                size_text ({info.width, info.height}) +
                " pixels, so no event is seen; set another region",
          true});
  }
  if (GST_EVENT_TYPE (event) != GST_EVENT_TAG)
    return;
  const auto setup = setup_from_tags (tags_of (event));
  const auto before = frames_.tag
                          ? setup_from_tags (tags_of (frames_.tag.get ()))
                          : std::nullopt;
  if (!setup || !*setup)
    return;
  if (before && *before && !(before->value () == setup->value ()))
    begin_anew ();
  frames_.tag.reset (gst_event_ref (event));
}

namespace
{

/* The pipeline that writes them to the two files. */
std::string
write (GstCaps *caps, GstEvent *tag, std::deque<BufferPtr> buffers,
    const std::string &recording, const std::string &sidecar)
{
  Graph graph;
  /* One thread: those of the stream come first. */
  /* It takes all at once, for they are kept already: after an error, it would
   * wait for ever. */
  Chain chain = graph.begin ("appsrc", {{"max-bytes", 0}});
  auto *source = GST_APP_SRC (chain.last ());
  gst_app_src_set_caps (source, caps);
  g_object_set (source, "format", GST_FORMAT_TIME, nullptr);
  chain.to (
      "codedexposure-recordmux", {{"threads", 1}, {"log-location", sidecar}});
  chain.to ("filesink", {{"location", recording}});
  if (tag)
    gst_element_send_event (GST_ELEMENT (source), gst_event_ref (tag));
  gst_element_set_state (graph.pipeline (), GST_STATE_PLAYING);
  for (BufferPtr &buffer : buffers)
    if (gst_app_src_push_buffer (source, buffer.release ()) != GST_FLOW_OK)
      break;
  gst_app_src_end_of_stream (source);
  const std::string failed = failure_of (graph.pipeline ());
  gst_element_set_state (graph.pipeline (), GST_STATE_NULL);
  return failed;
}

/* Under a name that is free. */
Result<std::string>
publish (GstCaps *caps, GstEvent *tag, std::deque<BufferPtr> buffers,
    const std::string &begin)
{
  const std::string name = free_name (begin);
  Part recording (name, Part::kFile), sidecar (sidecar_of (name), Part::kFile);
  for (Part *part : {&recording, &sidecar})
    if (const auto claimed = part->claim (false); !claimed)
      return claimed.error ();
  const std::string failed = write (
      caps, tag, std::move (buffers), recording.path (), sidecar.path ());
  Result<void> done =
      failed.empty () ? recording.publish (false)
                      : Error{"cannot write " + name + ": " + failed +
                                  " Free space on the disk, and press K again",
                            ErrorCode::io};
  if (done)
    done = sidecar.publish (false);
  if (done)
    return name;
  recording.discard ();
  sidecar.discard ();
  return done.error ();
}

} // namespace

void
Keeper::keep ()
{
  if (const auto begun = begin_writing (); !begun)
    calls_.said (begun.error ().message, true);
}

Result<void>
Keeper::begin_writing ()
{
  Frames frames;
  {
    const std::lock_guard lock (mutex_);
    if (is_busy_)
      return Error{"the frames that were kept before are still being written; "
                   "press K again then"};
    if (frames_.buffers.empty () || !frames_.caps)
      return Error{"there is no coded frame to be kept yet"};
    is_busy_ = true;
    frames.caps.reset (gst_caps_ref (frames_.caps.get ()));
    if (frames_.tag)
      frames.tag.reset (gst_event_ref (frames_.tag.get ()));
    for (const BufferPtr &buffer : frames_.buffers)
      frames.buffers.emplace_back (gst_buffer_ref (buffer.get ()));
  }
  if (writer_.joinable ())
    writer_.join ();
  writer_ = std::thread ([this, frames = std::move (frames)] () mutable {
    run (std::move (frames));
  });
  return {};
}

void
Keeper::run (Frames frames)
{
  const std::size_t count = frames.buffers.size ();
  const double seconds = 1e-9 * double (frames.length ());
  const auto meta = get_frame_meta (frames.buffers.front ().get ());
  const auto written = publish (frames.caps.get (), frames.tag.get (),
      std::move (frames.buffers),
      name_ + format ("-frame%06" G_GUINT64_FORMAT, meta ? meta->frame : 0));
  const std::lock_guard lock (mutex_);
  is_busy_ = false;
  add ({written ? format ("%s (%zu coded frames, %.2f s)", written->c_str (),
                      count, seconds)
                : written.error ().message,
      !written});
}

/* Of the mutex. */
void
Keeper::add (News news)
{
  news_.push_back (std::move (news));
  g_idle_add (
      [] (gpointer self) {
        static_cast<Keeper *> (self)->tell ();
        return gboolean (G_SOURCE_REMOVE);
      },
      this);
}

/* What follows an event is of interest, too. */
void
Keeper::on_event (const std::string &text)
{
  calls_.told (text);
  if (waiting_ > 0)
    has_another_ = true;
  else
    wait (after_);
}

void
Keeper::wait (guint ms)
{
  waiting_ = g_timeout_add (
      ms,
      [] (gpointer self) {
        static_cast<Keeper *> (self)->on_time ();
        return gboolean (G_SOURCE_REMOVE);
      },
      this);
}

/* An event that came meanwhile is followed for as long as the first one. */
void
Keeper::on_time ()
{
  constexpr guint kSoon = 100; // ms
  waiting_ = 0;
  if (locked (mutex_, [this] { return is_busy_; }))
    return wait (kSoon);
  keep ();
  if (std::exchange (has_another_, false))
    wait (after_);
}

void
Keeper::tell ()
{
  std::unique_lock lock (mutex_);
  const auto all = std::exchange (news_, {});
  lock.unlock ();
  for (const News &news : all)
    if (news.event)
      on_event (news.text);
    else
      calls_.said (news.text, news.failed);
}

/* An event shortly before the end is kept with what there is of it. */
void
Keeper::finish ()
{
  tell ();
  if (writer_.joinable ())
    writer_.join ();
  if (std::exchange (waiting_, 0) > 0)
    keep ();
  if (writer_.joinable ())
    writer_.join ();
  tell ();
}

} // namespace codedexposure::app
