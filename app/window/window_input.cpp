/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Keys and the mouse in the window. */
#include <algorithm>
#include <initializer_list>

#include <gst/video/navigation.h>

#include "base/pixels.h"
#include "common/messages.h"
#include "pipeline/cameras.h"
#include "pipeline/messages.h"
#include "pipeline/pads.h"
#include "window/pane.h"
#include "window/screen.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

/* An element message by which any element says that something happened. */
constexpr const char *kKeep = "codedexposure-keep";
/* A message of the window itself. */
constexpr const char *kResized = "codedexposure-resized";

constexpr int kLeft = 1, kRight = 3, kWheelUp = 4, kWheelDown = 5; // buttons

bool
is_key (const std::string &key, std::initializer_list<const char *> names)
{
  return std::any_of (names.begin (), names.end (), [&key] (const char *name) {
    return g_ascii_strcasecmp (key.c_str (), name) == 0;
  });
}

std::string
text_of (const EventFound &event)
{
  const std::string at = format ("at %.3f s", 1e-9 * double (event.time));
  const std::string which =
      event.frame ? format ("frame %" G_GUINT64_FORMAT, *event.frame) : at;
  return format ("%s: %+.3g %% of the largest value, %s; keeps the frames "
                 "around it in %.3g s",
      event.kind == "mean" ? "the mean jumps" : "motion", 100 * event.jump,
      which.c_str (), 1e-9 * double (event.after));
}

} // namespace

/* Keys are for the window; no element of the stream needs them. They go by the
 * bus, on which sinks post those that come while the stream is flushed. A sink
 * that does not scale asks for pictures of another size. */
void
Window::watch_keys (GstElement *overlay)
{
  add_probe (pad_of (overlay, "src").get (), GST_PAD_PROBE_TYPE_EVENT_UPSTREAM,
      [overlay] (GstPad *, GstPadProbeInfo *info) {
        GstEvent *event = gst_pad_probe_info_get_event (info);
        if (GST_EVENT_TYPE (event) == GST_EVENT_RECONFIGURE)
          gst_element_post_message (
              overlay, gst_message_new_element (GST_OBJECT (overlay),
                           gst_structure_new_empty (kResized)));
        if (GST_EVENT_TYPE (event) != GST_EVENT_NAVIGATION)
          return GST_PAD_PROBE_OK;
        gst_element_post_message (overlay,
            gst_navigation_message_new_event (GST_OBJECT (overlay), event));
        return GST_PAD_PROBE_DROP;
      });
}

void
Window::keep ()
{
  if (job_.keeper)
    g_object_set (job_.keeper, "keep", TRUE, nullptr);
}

/* Whether the message is about what is kept. */
bool
Window::take_kept (GstMessage *message)
{
  if (gst_message_has_name (message, kKeep)) {
    keep ();
    return true;
  }
  if (GST_MESSAGE_SRC (message) != GST_OBJECT (job_.keeper))
    return false;
  if (const auto kept = parse_message<Kept> (message))
    calls_.wrote ({kept->location},
        format (" (%s, %.2f s)", coded_frames (kept->frames).c_str (),
            1e-9 * double (kept->duration)));
  else if (const auto event = parse_message<EventFound> (message))
    calls_.told (text_of (*event));
  else if (GST_MESSAGE_TYPE (message) == GST_MESSAGE_WARNING)
    calls_.failed (Told (message).error->message);
  else
    return false;
  return true;
}

bool
Window::take (GstMessage *message)
{
  GstEvent *parsed = nullptr;
  if (job_.keeper && take_kept (message))
    return true;
  if (gst_message_has_name (message, kResized)) {
    if (player_)
      player_->redraw ();
    return true;
  }
  if (gst_navigation_message_get_type (message) !=
          GST_NAVIGATION_MESSAGE_EVENT ||
      !gst_navigation_message_parse_event (message, &parsed))
    return player_ && player_->take (message);
  const EventPtr event (parsed);
  const gchar *key = nullptr;
  if (gst_navigation_event_get_type (parsed) ==
      GST_NAVIGATION_EVENT_KEY_PRESS) {
    if (gst_navigation_event_parse_key_event (parsed, &key) && key)
      press (key);
  } else if (take_mouse (parsed) && player_)
    player_->redraw ();
  return true;
}

/* Of the mutex. */
std::optional<Position>
Window::seen_at (Position in_window) const
{
  if (!layout_)
    return std::nullopt;
  const Extent pane = layout_->pane;
  for (int k = 0; k < layout_->panes; k++) {
    const Position seen{(in_window.x - layout_->left (k)) / pane.width,
        (in_window.y - WindowLayout::kCaption) / pane.height};
    if (seen.x >= 0 && seen.x < 1 && seen.y >= 0 && seen.y < 1)
      return seen;
  }
  return std::nullopt;
}

/* Whether another picture is to be drawn. */
bool
Window::take_mouse (GstEvent *event)
{
  Position at, by;
  int button = 0;
  switch (gst_navigation_event_get_type (event)) {
  case GST_NAVIGATION_EVENT_MOUSE_BUTTON_PRESS:
    gst_navigation_event_parse_mouse_button_event (
        event, &button, &at.x, &at.y);
    press_button (button, at);
    return true;
  case GST_NAVIGATION_EVENT_MOUSE_BUTTON_RELEASE:
    button_ = 0;
    return false;
  case GST_NAVIGATION_EVENT_MOUSE_MOVE:
    gst_navigation_event_parse_mouse_move_event (event, &at.x, &at.y);
    move_pointer (at);
    return true;
  case GST_NAVIGATION_EVENT_MOUSE_SCROLL:
    gst_navigation_event_parse_mouse_scroll_event (
        event, &at.x, &at.y, &by.x, &by.y);
    press_button (by.y > 0 ? kWheelUp : kWheelDown, at);
    return true;
  default:
    return false;
  }
}

void
Window::press_button (int button, Position at)
{
  const std::lock_guard lock (mutex_);
  pointer_ = seen_at (at);
  if (button == kWheelUp && pointer_)
    look_.zoom_in (*pointer_);
  else if (button == kWheelDown && pointer_)
    look_.zoom_out (*pointer_);
  else if (pointer_)
    button_ = button;
  dragged_ = at;
}

void
Window::move_pointer (Position at)
{
  const std::lock_guard lock (mutex_);
  pointer_ = seen_at (at);
  if (!layout_ || button_ == 0)
    return;
  const Position by{(at.x - dragged_.x) / layout_->pane.width,
      (at.y - dragged_.y) / layout_->pane.height};
  dragged_ = at;
  if (button_ == kLeft)
    look_.move (by);
  else if (button_ == kRight)
    look_.drag_tones (by);
}

void
Window::press (const std::string &key)
{
  if (is_key (key, {"q"})) {
    calls_.end ();
    return;
  }
  if (press_look (key)) {
    if (player_)
      player_->redraw ();
    return;
  }
  if (player_)
    player_->press (key);
  else if (is_key (key, {"k"}))
    keep ();
  else if (is_key (
               key, {"Up", "Down", "Prior", "Next", "Page_Up", "Page_Down"}))
    turn_camera (key);
  else
    press_replay (key);
}

bool
Window::press_look (const std::string &key)
{
  if (is_key (key, {"c"})) {
    stretch_tones ();
    return true;
  }
  if (is_key (key, {"f", "Escape"})) {
    fill_screen (!fills_screen_ && !is_key (key, {"Escape"}));
    return true;
  }
  const std::lock_guard lock (mutex_);
  const Position at = pointer_.value_or (Position{0.5, 0.5});
  if (is_key (key, {"s"}))
    snapshot_wanted_ = true;
  else if (is_key (key, {"plus", "equal", "KP_Add"}))
    look_.brighten (true, largest_pixel (bits_));
  else if (is_key (key, {"minus", "KP_Subtract"}))
    look_.brighten (false, largest_pixel (bits_));
  else if (is_key (key, {"r"}))
    look_.set_marks (!look_.marks ());
  else if (is_key (key, {"z"}))
    look_.zoom_in (at);
  else if (is_key (key, {"x"}))
    look_.zoom_out (at);
  else if (is_key (key, {"0", "KP_0", "KP_Insert"}))
    look_.show_whole ();
  else if (is_key (key, {"h", "F1", "question"}))
    is_helping_ = !is_helping_;
  else
    return false;
  return true;
}

void
Window::press_replay (const std::string &key)
{
  static constexpr struct {
    const char *name;
    Replay::Key key;
  } kKeys[] = {{"space", Replay::Key::kPause}, {"l", Replay::Key::kLoop},
      {"Left", Replay::Key::kBack}, {"Right", Replay::Key::kForward}};
  const std::lock_guard lock (mutex_);
  const bool was_live = replay_.is_live ();
  for (const auto &[name, act] : kKeys)
    if (is_key (key, {name}))
      replay_.press (act, now_, panes_[kSubframes]->recent.times ());
  /* What came in the meantime was not kept. */
  if (!was_live && replay_.is_live ())
    for (const auto &pane : panes_)
      pane->recent.clear ();
}

/* All panes in the same tones, or the light of a slot could not be compared
 * with that of another. */
void
Window::stretch_tones ()
{
  ShownPtr coded;
  Look look;
  DetailPlace place;
  {
    const std::lock_guard lock (mutex_);
    if (!look_.has_all_tones ()) {
      look_.show_all_tones ();
      return;
    }
    if (!layout_)
      return;
    coded = shown_at (now_)[kCamera];
    look = look_;
    place = place_of (*panes_[kCamera]);
  }
  const auto tones =
      coded ? tones_of (*coded, place, look) : std::optional<Tones> ();
  if (!tones)
    return;
  const std::lock_guard lock (mutex_);
  look_.set_tones (*tones, coded->largest ());
}

void
Window::turn_camera (const std::string &key)
{
  if (!job_.camera)
    return;
  const int steps = is_key (key, {"Up", "Prior", "Page_Up"}) ? 1 : -1;
  const auto turned =
      is_key (key, {"Up", "Down"})
          ? change_gain (job_.camera, steps)
          : change_exposure (job_.camera, steps, job_.exposures);
  calls_.told (turned ? *turned : "error: " + turned.error ().message);
}

void
Window::fill_screen (bool fills)
{
  if (fills != fills_screen_ && set_full_screen (fills))
    fills_screen_ = fills;
}

} // namespace codedexposure::app
