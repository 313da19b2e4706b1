/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "player.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "common/excerpt.h"
#include "pipeline/graph.h"
#include "pipeline/messages.h"
#include "window/branch.h"

namespace codedexposure::app
{

namespace
{

/* Where a subframe begins, rounding may show the one before. */
constexpr Nanoseconds kInside = gst::kRounding / 2;

double
seconds_of (Nanoseconds time)
{
  return 1e-9 * double (time);
}

} // namespace

Player::~Player ()
{
  finish ();
}

std::string
Player::keys_of ()
{
  return R"(Keys in the window:
  Space           pause, and go on
  Left, Right     pause, and go one subframe back or forward
  PgUp, PgDn      go one second back or forward
  Home, End       go to the first or the last coded frame
  [, ]            play at half or twice the speed, from 1/64 to 16
  A, B            mark the coded frame that is shown as the first, or the last,
                  of a stretch; Backspace: no marks
  L               play the stretch, or all, again and again, or once
  E               export the stretch, as decode does, to the current folder
)" + WindowOptions::common_keys ("play");
}

const char *
Player::short_keys ()
{
  return "Space: pause   Left, Right: step   PgUp, PgDn: 1 s   [, ]: speed   "
         "A, B: mark   L: loop   E: export   H: all keys";
}

void
Player::begin (GstElement *pipeline, Failed failed)
{
  pipeline_ = pipeline;
  failed_ = std::move (failed);
}

Player::State
Player::state () const
{
  const std::lock_guard lock (mutex_);
  return state_;
}

template <typename Change>
void
Player::change (Change change)
{
  const std::lock_guard lock (mutex_);
  change (state_);
}

bool
Player::press (const std::string &key)
{
  const auto is = [&key] (const char *name) {
    return g_ascii_strcasecmp (key.c_str (), name) == 0;
  };
  if (is ("space"))
    pause (!state ().is_paused);
  else if (is ("Left") || is ("Right"))
    step (is ("Left") ? -1 : 1);
  else if (is ("Prior") || is ("Page_Up"))
    jump (-Nanoseconds (GST_SECOND));
  else if (is ("Next") || is ("Page_Down"))
    jump (Nanoseconds (GST_SECOND));
  else if (is ("Home"))
    go_to ({});
  else if (is ("End"))
    go_to ({last (), 0});
  else if (is ("bracketleft") || is ("bracketright"))
    set_speed (is ("bracketleft") ? -1 : 1);
  else if (is ("a") || is ("b"))
    mark (is ("b"));
  else if (is ("BackSpace"))
    change ([] (State &state) { state.from = state.until = std::nullopt; });
  else if (is ("l"))
    toggle_loop ();
  else if (is ("e"))
    export_stretch ();
  else
    return false;
  return true;
}

/* Playing goes on where it stands, but for the end. */
void
Player::pause (bool paused)
{
  change ([paused] (State &state) { state.is_paused = paused; });
  is_placed_ = false;
  const State now = state ();
  if (!paused && now.is_at_end && !now.loops)
    go_to ({}); // first: a sink that plays says again that it is at the end
  else if (!paused)
    enter_loop ();
  gst_element_set_state (
      pipeline_, paused ? GST_STATE_PAUSED : GST_STATE_PLAYING);
}

/* The seek that ends with the stretch. */
void
Player::enter_loop ()
{
  const State now = state ();
  if (!now.loops || now.is_paused)
    return;
  const int from = now.from.value_or (0), until = now.until.value_or (last ());
  const int frame = place ().frame;
  go_to ({now.is_at_end || frame < from || frame > until ? from : frame, 0});
}

void
Player::mark (bool end)
{
  const int frame = place ().frame;
  change ([end, frame] (State &state) {
    (end ? state.until : state.from) = frame;
    if (state.from && state.until && *state.from > *state.until)
      (end ? state.from : state.until) = std::nullopt;
  });
  enter_loop ();
}

/* Without a loop, a stretch is left at its end. */
void
Player::toggle_loop ()
{
  change ([] (State &state) { state.loops = !state.loops; });
  const State now = state ();
  if (now.loops)
    enter_loop ();
  else if (!now.is_paused)
    go_to ({place ().frame, 0});
}

void
Player::set_speed (int by)
{
  constexpr int kSlowest = -6, kFastest = 4;
  const int before = state ().speed;
  const int speed = std::clamp (before + by, kSlowest, kFastest);
  change ([speed] (State &state) { state.speed = speed; });
  if (speed != before)
    go_to (place ());
}

void
Player::step (int by)
{
  if (!state ().is_paused)
    pause (true);
  const Place from = place ();
  const int place = std::clamp (from.frame * played_.slots + from.slot + by, 0,
      (last () + 1) * played_.slots - 1);
  go_to ({place / played_.slots, place % played_.slots});
}

void
Player::jump (Nanoseconds by)
{
  const Place from = place ();
  const Nanoseconds to = played_.positions[std::size_t (from.frame)] + by;
  go_to ({frame_at (to), 0});
}

Nanoseconds
Player::end_of (int frame) const
{
  const auto &positions = played_.positions;
  return frame < last () ? positions[std::size_t (frame) + 1]
                         : positions.back () + played_.rate.period ();
}

/* Presses that come faster than pictures lead to the last place only. */
void
Player::go_to (Place place)
{
  wanted_ = place;
  change ([place] (State &state) { state.target = place; });
  is_placed_ = state ().is_paused;
  if (!is_moving_)
    move ();
}

void
Player::move ()
{
  const State now = state ();
  target_ = wanted_;
  is_moving_ = true;
  has_stepped_ = false;
  change ([] (State &state) { state.is_at_end = false; });
  const Nanoseconds from = played_.positions[std::size_t (target_.frame)];
  const bool ends =
      now.loops && now.until && target_.frame <= *now.until && !now.is_paused;
  const gint64 stop = ends ? end_of (*now.until) - kInside : -1;
  const double rate =
      now.speed < 0 ? 1.0 / (1 << -now.speed) : double (1 << now.speed);
  if (!gst_element_seek (pipeline_, rate, GST_FORMAT_TIME,
          GstSeekFlags (GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE),
          GST_SEEK_TYPE_SET, from > 0 ? from + kInside : 0,
          ends ? GST_SEEK_TYPE_SET : GST_SEEK_TYPE_NONE, stop)) {
    is_moving_ = false;
    failed_ (played_.recording + " cannot be moved in");
  }
}

/* Of the first picture after a seek, or a step. */
void
Player::on_arrival ()
{
  if (!is_moving_)
    return;
  if (!has_stepped_ && target_.slot > 0 && state ().is_paused) {
    has_stepped_ = true;
    gst_element_send_event (
        pipeline_, gst_event_new_step (GST_FORMAT_BUFFERS,
                       guint64 (target_.slot), 1.0, TRUE, FALSE));
    return;
  }
  is_moving_ = false;
  if (std::exchange (is_stale_, false) || wanted_ != target_)
    move ();
}

/* The last picture stays. */
bool
Player::on_end ()
{
  const State now = state ();
  is_moving_ = is_placed_ = false;
  if (now.loops && !now.is_paused) {
    go_to ({now.from.value_or (0), 0});
    return true;
  }
  change ([] (State &state) { state.is_paused = state.is_at_end = true; });
  gst_element_set_state (pipeline_, GST_STATE_PAUSED);
  return true;
}

bool
Player::take (GstMessage *message)
{
  if (GST_MESSAGE_TYPE (message) == GST_MESSAGE_EOS)
    return on_end ();
  if (GST_MESSAGE_TYPE (message) == GST_MESSAGE_ASYNC_DONE)
    on_arrival ();
  return false;
}

int
Player::frame_at (Nanoseconds time) const
{
  const auto &positions = played_.positions;
  const auto later =
      std::upper_bound (positions.begin (), positions.end (), time + kInside);
  return std::clamp (int (later - positions.begin ()) - 1, 0, last ());
}

Player::Place
Player::place_at (Nanoseconds time) const
{
  const int frame = frame_at (time);
  const Nanoseconds within =
      time - played_.positions[std::size_t (frame)] + kInside;
  return {
      frame, std::clamp (int (within * played_.slots / played_.rate.period ()),
                 0, played_.slots - 1)};
}

/* What the screen shows; pictures that wait for it are drawn before. */
Player::Place
Player::place () const
{
  gint64 time = 0;
  if (is_moving_ || is_placed_)
    return wanted_;
  if (!gst_element_query_position (pipeline_, GST_FORMAT_TIME, &time))
    return {};
  return place_at (time);
}

bool
Player::is_last (Nanoseconds time) const
{
  return place_at (time) == Place{last (), played_.slots - 1};
}

void
Player::redraw ()
{
  if (!state ().is_paused)
    return;
  is_stale_ = is_moving_;
  go_to (place ());
}

bool
Player::is_wanted (Nanoseconds time, int slot) const
{
  const State now = state ();
  return !now.is_paused || now.target == Place{frame_at (time), slot};
}

std::string
Player::line (Nanoseconds time) const
{
  const State now = state ();
  const auto at = [this] (int frame) {
    return seconds_of (played_.positions[std::size_t (frame)]);
  };
  std::string text =
      now.is_at_end || (!now.is_paused && !now.loops && is_last (time))
          ? "at the end"
      : now.is_paused ? "paused"
      : now.speed < 0 ? format ("playing at 1/%d speed", 1 << -now.speed)
      : now.speed > 0 ? format ("playing %d times as fast", 1 << now.speed)
                      : "playing";
  text += format (
      ", %.3f of %.3f s", at (frame_at (time)), seconds_of (end_of (last ())));
  if (now.from || now.until)
    text += format ("; from %.3f to %.3f s", at (now.from.value_or (0)),
        seconds_of (end_of (now.until.value_or (last ()))));
  return text + (now.loops ? ", in a loop" : "");
}

/* Times between two frames are those of no frame, however they are rounded. */
std::vector<std::string>
Player::export_command (const State &state)
{
  const int from = state.from.value_or (0);
  const int until = state.until.value_or (last ());
  const auto before = [this] (int frame) {
    const auto &positions = played_.positions;
    const Nanoseconds own = positions[std::size_t (frame)];
    return frame == 0 ? own : (positions[std::size_t (frame) - 1] + own) / 2;
  };
  std::string excerpt = real_text (seconds_of (before (from))) + "-";
  if (until < last ())
    excerpt += real_text (seconds_of (before (until + 1)));
  const std::string stem =
      std::filesystem::path (played_.recording).stem ().string () +
      format ("-%.3f-%.3fs", seconds_of (played_.positions[std::size_t (from)]),
          seconds_of (end_of (until)));
  exported_ = stem + played_.form;
  std::error_code ignored;
  for (int k = 2; std::filesystem::exists (exported_, ignored); k++)
    exported_ = stem + "-" + std::to_string (k) + played_.form;
  std::vector<std::string> command{"/proc/self/exe", "decode",
      std::filesystem::absolute (played_.recording).string (), "--excerpt",
      excerpt, "--output", exported_};
  command.insert (
      command.end (), played_.decode.begin (), played_.decode.end ());
  return command;
}

/* By a process of its own, which says what it wrote. */
void
Player::export_stretch ()
{
  const State now = state ();
  if (!now.from && !now.until) {
    failed_ (
        "nothing is marked; press A at the first coded frame of a stretch, "
        "and B at the last one");
    return;
  }
  if (exporting_) {
    failed_ (
        exported_ + " is still being written; press E again when it is done");
    return;
  }
  std::vector<std::string> words = export_command (now);
  std::vector<gchar *> arguments;
  for (std::string &word : words)
    arguments.push_back (word.data ());
  arguments.push_back (nullptr);
  GPid pid = 0;
  GError *error = nullptr;
  if (!g_spawn_async (nullptr, arguments.data (), nullptr,
          G_SPAWN_DO_NOT_REAP_CHILD, nullptr, nullptr, &pid, &error)) {
    failed_ (std::string ("cannot export: ") + error->message);
    g_error_free (error);
    return;
  }
  exporting_ = pid;
  g_child_watch_add (pid, on_exported, this);
}

void
Player::on_exported (GPid pid, gint, gpointer self)
{
  g_spawn_close_pid (pid);
  static_cast<Player *> (self)->exporting_.reset ();
}

void
Player::finish ()
{
  while (exporting_)
    g_main_context_iteration (nullptr, TRUE);
}

} // namespace codedexposure::app
