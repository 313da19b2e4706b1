/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-camerasrc and a camera that goes away and comes back. */
#include <algorithm>

#include "camerasrc.h"
#include "common/events.h"
#include "common/messages.h"

#ifdef CODEDEXPOSURE_ARAVIS
#include <arv.h>
#endif

#define GST_CAT_DEFAULT camerasrc_debug

namespace codedexposure::gst::camera
{

namespace
{

constexpr std::chrono::seconds kPause{1};
/* aravissrc waits two seconds for a frame. A process that was stopped in that
 * time did not see whether one came. */
constexpr std::chrono::seconds kPatience{3};
/* Tries to restart the camera after that, and after the DMD has shown something
 * else, whatever the property says. */
constexpr guint kTriesAfterStop = 10;

SwitchAnswer
ask_switch (GstCodedExposureCameraSrc *self)
{
  const QueryPtr query (new_query<SwitchAnswer> ());
  if (!gst_pad_peer_query (
          pad_of (GST_ELEMENT (self), "src").get (), query.get ()))
    return {};
  return parse_query<SwitchAnswer> (query.get ()).value_or (SwitchAnswer ());
}

std::string
text_of (GstMessage *message)
{
  GError *error = nullptr;
  gst_message_parse_error (message, &error, nullptr);
  const std::string text = error->message;
  g_error_free (error);
  return text;
}

/* Whether aravissrc ended its stream by itself. What it pushed last was taken:
 * so downstream is not the reason. */
bool
is_own_failure (const CameraState &st, GstMessage *message)
{
  const GstStructure *details = nullptr;
  gst_message_parse_error_details (message, &details);
  gint flow = GST_FLOW_ERROR;
  if (details)
    gst_structure_get_int (details, "flow-return", &flow);
  return GST_MESSAGE_SRC (message) == GST_OBJECT (st.source) &&
         flow == GST_FLOW_ERROR &&
         gst_pad_get_last_flow_return (pad_of (st.source, "src").get ()) ==
             GST_FLOW_OK;
}

/** @p stopped  for how long the process was; 0: it was not. */
void
say_lost (GstCodedExposureCameraSrc *self, const std::string &why,
    std::chrono::duration<double> stopped)
{
  if (stopped.count () > 0) {
    char pause[32];
    g_ascii_formatd (pause, sizeof pause, "%.1f s", stopped.count ());
    const std::string reason =
        "this process was stopped for " + std::string (pause);
    post_message (self, CameraLost{reason});
    POST_WARNING (self, RESOURCE, READ,
        "Frames of the camera are lost: " + reason +
            ". The camera is restarted. Do not stop a run by Ctrl-Z or a "
            "debugger.");
    return;
  }
  post_message (self, CameraLost{why});
  POST_WARNING (self, RESOURCE, READ,
      "The camera is gone: " + why +
          " It is restarted until it comes back (property reconnect).");
}

void
give_up (GstCodedExposureCameraSrc *self, guint tries)
{
  CameraState &st = state (self);
  const std::string why = locked (st.lock, [&] { return st.why; });
  POST_ERROR (self, RESOURCE, READ,
      "The camera did not come back after " + std::to_string (tries) +
          " tries to restart it (property reconnect): " + why +
          " Check its cable, its power and its trigger.");
  gst_pad_push_event (
      pad_of (GST_ELEMENT (self), "src").get (), gst_event_new_eos ());
}

/* One try. Returns whether a frame came; else the source has failed again, or
 * @p stop was requested. The source is locked against the states of the bin
 * while it is stopped, which takes seconds for a camera that does not answer.
 */
bool
try_restart (GstCodedExposureCameraSrc *self, const std::stop_token &stop)
{
  CameraState &st = state (self);
  gst_element_set_locked_state (st.source, TRUE);
  gst_element_set_state (st.source, GST_STATE_NULL);
  locked (st.lock, [&] {
    st.why.clear ();
    st.failed = false;
    st.tries++;
  });
  if (stop.stop_requested () || !set_up_source (self))
    return false;
  gst_element_set_locked_state (st.source, FALSE);
  if (!gst_element_sync_state_with_parent (st.source))
    return false;
  std::unique_lock guard (st.lock);
  st.changed.wait (guard, stop, [&st] { return !st.away || st.failed; });
  return !st.away;
}

void
bring_back (GstCodedExposureCameraSrc *self, const std::stop_token &stop)
{
  CameraState &st = state (self);
  const guint most = locked (st.lock, [&] { return st.most_tries; });
  bool first = true;
  for (guint tries = 0; tries < most; tries += !ask_switch (self).sending) {
    std::unique_lock guard (st.lock);
    if (!std::exchange (first, false))
      st.changed.wait_for (guard, stop, kPause, [] { return false; });
    guard.unlock ();
    if (stop.stop_requested () || try_restart (self, stop))
      return;
  }
  if (!stop.stop_requested ())
    give_up (self, most);
}

} // namespace

void
begin_watch (GstCodedExposureCameraSrc *self)
{
  CameraState &st = state (self);
  const ObjectLock lock (self);
  const std::lock_guard guard (st.lock);
  st.most_tries = 0;
  st.pauses.emplace ();
  st.seen = st.away = st.failed = st.ending = false;
  st.newest = std::chrono::steady_clock::now ();
  st.frames_left = st.settings.num_buffers;
  st.why.clear ();
}

void
end_watch (GstElement *self)
{
  CameraState &st = state (self);
  std::jthread ended;
  locked (st.lock, [&] {
    st.pauses.reset ();
    ended = std::move (st.restarts);
  });
  if (ended.joinable ()) {
    ended.request_stop ();
    ended.join ();
    gst_element_set_locked_state (st.source, FALSE);
  }
  keep_camera (self, nullptr);
}

bool
take_failure (GstCodedExposureCameraSrc *self, GstMessage *message)
{
  CameraState &st = state (self);
  const bool own = is_own_failure (st, message);
  const guint reconnect = settings_of (self).reconnect;
  const bool switching = own && ask_switch (self).switching;
  PauseWatch::Clock::duration stopped{};
  {
    const std::lock_guard guard (st.lock);
    if (st.ending && own)
      return true;
    if (st.pauses)
      stopped = st.pauses->recent (kPatience);
    const guint tries = stopped.count () > 0 || switching
                            ? std::max (reconnect, kTriesAfterStop)
                            : reconnect;
    if (!st.pauses || (!st.away && !(own && st.seen && tries > 0)))
      return false;
    if (!st.away)
      st.most_tries = tries;
    if (st.why.empty ())
      st.why = text_of (message);
    st.failed = st.failed || own;
    if (std::exchange (st.away, true)) {
      st.changed.notify_all ();
      return true;
    }
    st.tries = 0;
  }
  if (switching && stopped.count () == 0)
    post_message (
        self, CameraLost{"the DMD triggers no frame while it gets masks"});
  else
    say_lost (self, text_of (message), stopped);
  std::jthread before; // it has ended, or is about to
  const std::lock_guard guard (st.lock);
  before = std::move (st.restarts);
  if (st.pauses)
    st.restarts = std::jthread (
        [self] (const std::stop_token &stop) { bring_back (self, stop); });
  return true;
}

void
keep_camera (gpointer self, ObjectPtr<GObject> camera)
{
  CameraState &st = state (self);
  const std::lock_guard guard (st.lock);
  st.camera.swap (camera);
}

void
stop_silent_camera (GstElement *self)
{
  constexpr std::chrono::seconds kSilence{1};
  CameraState &st = state (self);
  ObjectPtr<GObject> camera;
  {
    const std::lock_guard guard (st.lock);
    if (st.away || !st.camera ||
        std::chrono::steady_clock::now () - st.newest < kSilence)
      return;
    camera.reset (G_OBJECT (g_object_ref (st.camera.get ())));
  }
#ifdef CODEDEXPOSURE_ARAVIS
  arv_camera_stop_acquisition (ARV_CAMERA (camera.get ()), nullptr);
#endif
}

void
note_frame (GstCodedExposureCameraSrc *self, GstClockTime silent)
{
  CameraState &st = state (self);
  guint tries = 0;
  {
    const std::lock_guard guard (st.lock);
    st.seen = true;
    st.newest = std::chrono::steady_clock::now ();
    st.frames_left -= st.frames_left > 0;
    if (!std::exchange (st.away, false))
      return;
    tries = st.tries;
  }
  st.changed.notify_all ();
  locked (self, [&] { st.reconnects++; });
  post_message (self, CameraBack{silent, tries});
}

} // namespace codedexposure::gst::camera
