/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Moves in a recording that a window shows. */
#pragma once

#include <compare>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <gst/gst.h>

#include "schedule/timing.h"

namespace codedexposure::app
{

/** What there is to move in. */
struct Played {
  std::string recording; ///< its file
  /** Positions of its coded frames, ascending, ns: from the first one. */
  std::vector<Nanoseconds> positions;
  int slots = 1;                      ///< subframes of a coded frame
  FrameRate rate;                     ///< of the coded frames
  const char *pictures = "subframes"; ///< what is beside the coded frames
  std::string form = ".mp4";          ///< the ending of what is exported
  /** Options of "decode" for what is exported. */
  std::vector<std::string> decode;

  /** Of the subframes: "100/1". */
  std::string slots_per_second () const
  {
    return std::to_string (rate.num * slots) + "/" + std::to_string (rate.den);
  }
};

/**
 * Plays, pauses, steps, seeks, loops and exports by keys. Every picture is
 * reached by a seek to its coded frame and a step to its slot, so that it is
 * that of the whole recording.
 */
class Player
{
public:
  using Failed = std::function<void (const std::string &why)>;

  explicit Player (Played played) : played_ (std::move (played)) {}
  /** Waits for what is being exported. */
  ~Player ();
  Player (const Player &) = delete;
  Player &operator= (const Player &) = delete;

  /** What --help says of the keys. */
  static std::string keys_of ();
  /** The same in a line of the window. */
  static const char *short_keys ();

  /** Before @p pipeline plays. Main thread, as all but
   * is_paused (), is_last (), is_wanted () and line (). */
  void begin (GstElement *pipeline, Failed failed);
  /** Whether the end of the stream, or what else @p message says, is dealt
   * with.
   */
  bool take (GstMessage *message);
  void finish ();

  /** False: @p key has no meaning here. */
  bool press (const std::string &key);
  /** Draws the picture of a pause once more. */
  void redraw ();
  bool is_paused () const { return state ().is_paused; }
  /** Whether @p time is the position of the last subframe, which stays. */
  bool is_last (Nanoseconds time) const;
  /** Whether the subframe at the position @p time, of this slot, is what is
   * looked for: in a pause, others are drawn as well. */
  bool is_wanted (Nanoseconds time, int slot) const;
  /** "paused, 1.240 of 20.000 s". @p time  position of what is drawn. */
  std::string line (Nanoseconds time) const;

private:
  /** A subframe. */
  struct Place {
    int frame = 0, slot = 0;
    auto operator<=> (const Place &) const = default;
  };
  struct State {
    bool is_paused = false, loops = false, is_at_end = false;
    int speed = 0;                  ///< 2 to the power of it
    std::optional<Place> target;    ///< of a pause
    std::optional<int> from, until; ///< coded frames, both within the stretch
  };

  static void on_exported (GPid pid, gint status, gpointer self);

  int last () const { return int (played_.positions.size ()) - 1; }
  Nanoseconds end_of (int frame) const;
  int frame_at (Nanoseconds time) const;
  Place place_at (Nanoseconds time) const;
  Place place () const;
  State state () const;
  template <typename Change>
  void change (Change change);
  void pause (bool paused);
  void enter_loop ();
  void toggle_loop ();
  void mark (bool end);
  void set_speed (int by);
  void step (int by);
  void jump (Nanoseconds by);
  void go_to (Place place);
  void move ();
  void on_arrival ();
  bool on_end ();
  void export_stretch ();
  std::vector<std::string> export_command (const State &state);

  const Played played_;
  GstElement *pipeline_ = nullptr;
  Failed failed_;
  Place wanted_, target_;
  bool is_moving_ = false; ///< to target_
  bool has_stepped_ = false;
  bool is_stale_ = false;  ///< to be drawn once more, after the move
  bool is_placed_ = false; ///< a pause shows wanted_
  std::optional<GPid> exporting_;
  std::string exported_; ///< name of the file

  mutable std::mutex mutex_;
  State state_; ///< of the mutex
};

} // namespace codedexposure::app
