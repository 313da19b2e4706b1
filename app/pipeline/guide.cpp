/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "guide.h"

#include <string_view>
#include <utility>

#include <unistd.h>

#include <glib-unix.h>

#include "calibrate/session.h"
#include "common/messages.h"
#include "pipeline/messages.h"
#include "pipeline/status.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

/* Readings between two moves of the simulated stage, so that none is from
 * before the last move. */
constexpr int kReadingsPerMove = 8;
/* Part of the required travel that one move of the simulated stage makes. */
constexpr double kMovePart = 0.9;

/* What the states of moirecalib mean for a person. */
constexpr std::pair<std::string_view, const char *> kStates[] = {
    {"searching", "searching for the grating: focus, and place the camera "
                  "roughly in front of the mirrors"},
    {"coarse", "coarse: move the stage as the arrows show, the angle first"},
    {"fine", "fine: no pixel is off by more than one mirror; continue"},
    {"aligned", "aligned: do not touch the stage"},
    {"mapping", "showing patterns; do not touch the bench"},
    {"solving", "solving; the mirrors show the schedule again"},
};

class Guide
{
public:
  Guide (Job &job, GstElement *calib, GstElement *stage)
      : job_ (job), calib_ (calib), stage_ (stage),
        status_ (job.command, job.options.verbose)
  {
    job.ends_by_signal = true;
    job.has_progress = false; // readings are shown
    job.on_message = [this] (
                         const GstStructure *message) { on_element (message); };
    job.judge = [this] (const RunResult &run) { return judge (run); };
    const auto on_key = [] (gint, GIOCondition, gpointer self) {
      return static_cast<Guide *> (self)->take_key ();
    };
    if (isatty (STDIN_FILENO) != 0 && !is_alignment ())
      keys_ = g_unix_fd_add (STDIN_FILENO, G_IO_IN, on_key, this);
  }

  ~Guide ()
  {
    if (keys_ != 0)
      g_source_remove (keys_);
  }

  Guide (const Guide &) = delete;
  Guide &operator= (const Guide &) = delete;

private:
  /* Enter starts the mapping without further alignment. */
  gboolean take_key ()
  {
    char keys[64];
    if (read (STDIN_FILENO, keys, sizeof keys) <= 0) {
      keys_ = 0;
      return G_SOURCE_REMOVE;
    }
    if (!mapped_) {
      status_.line ("mapping without further alignment");
      gst_util_set_object_arg (G_OBJECT (calib_), "mode", "map");
    }
    return G_SOURCE_CONTINUE;
  }

  bool is_alignment () const
  {
    GValue mode = G_VALUE_INIT;
    g_object_get_property (G_OBJECT (calib_), "mode", &mode);
    const CharPtr text (gst_value_serialize (&mode));
    g_value_unset (&mode);
    return std::string_view (text.get ()) == "align";
  }

  /* The user ends an alignment, and the last reading is its result. */
  bool is_done ()
  {
    if (!is_alignment () || last_reading_.empty ())
      return mapped_;
    status_.line (last_reading_);
    return true;
  }

  /* A signal ends an alignment well. */
  Exit judge (const RunResult &run)
  {
    if (is_done ())
      return unwritten_ ? Exit::failed : Exit::done;
    if (run.interrupted)
      status_.line ("stopped; the mirrors show the schedule again");
    else if (run.exit == Exit::done && !failed_)
      status_.line (
          "error: the frames ended before there was a mapping; set more "
          "--frames, or leave it out");
    return run.interrupted ? Exit::interrupted : Exit::failed;
  }

  void end () const
  {
    gst_element_send_event (job_.graph.pipeline (), gst_event_new_eos ());
  }

  void on_element (const GstStructure *structure)
  {
    if (const auto now = from_structure<MoireState> (structure))
      on_state (now->state);
    else if (const auto reading = from_structure<MoireReading> (structure))
      on_reading (*reading);
    else if (const auto second =
                 from_structure<MoireSecondMapping> (structure)) {
      second_mapped_ = true;
      say_mapping (second->of, "second camera, ");
      check_files (second->of, "second-");
    } else if (const auto mapping = from_structure<MoireMapping> (structure))
      on_mapping (*mapping);
  }

  void on_state (const std::string &state)
  {
    for (const auto &[name, meaning] : kStates)
      if (state == name)
        status_.line (
            meaning +
            std::string (keys_ != 0 && state == "coarse"
                             ? "; press Enter to start the mapping now"
                             : ""));
    failed_ = state == "failed";
    if (failed_ && keys_ != 0)
      status_.line ("the mapping failed; correct the bench and press Enter to "
                    "try again");
    else if (failed_)
      end ();
  }

  void on_reading (const MoireReading &reading)
  {
    const StageMove &move = reading.move;
    const char *state = reading.state.c_str ();
    status_.progress (format (
        "%s  %s %+.2f µm  %s %+.2f µm  %s %+.1f mdeg  magnify %+.2f per mille  "
        "(worst corner %.3f mirrors)",
        state, move.stage_x >= 0 ? "→" : "←", move.stage_x,
        move.stage_y >= 0 ? "↓" : "↑", move.stage_y,
        move.stage_theta >= 0 ? "↻" : "↺", move.stage_theta, move.magnify,
        move.deviation));
    last_reading_ = format ("%s: rotation %+.5f deg, magnification %.6f, "
                            "offset %+.5f, %+.5f mirrors (worst corner %.3f)",
        state, move.rotation, move.magnification, move.offset_x, move.offset_y,
        move.deviation);
    if (stage_ && ++readings_ % kReadingsPerMove == 0 &&
        reading.state != "aligned")
      move_stage (move);
  }

  /* That of a second camera comes before it. */
  void on_mapping (const MoireMapping &mapping)
  {
    mapped_ = true;
    say_mapping (mapping, "");
    double tolerance = 0;
    g_object_get (calib_, "tolerance", &tolerance, nullptr);
    StageCorrection remaining;
    remaining.deviation = mapping.move.deviation;
    status_.line (alignment_verdict (remaining, tolerance));
    if (remaining.deviation <= tolerance)
      status_.line ("decode with the mapping: only it says which mirrors the "
                    "pixels see");
    check_files (mapping, "");
    if (!second_mapped_)
      check_files ({}, "second-");
    end ();
  }

  /* @camera: "" or "second camera, ". */
  void say_mapping (const MoireMapping &mapping, const char *camera)
  {
    const StageMove &move = mapping.move;
    status_.line (
        camera + format ("mapped: rotation %+.5f ± %.0e deg, magnification "
                         "%.6f ± %.0e, offset %+.5f, %+.5f ± %.0e mirrors",
                     move.rotation, move.sigma_rotation, move.magnification,
                     move.sigma_magnification, move.offset_x, move.offset_y,
                     move.sigma_x));
    status_.line (
        camera + format ("pixels: %" G_GUINT64_FORMAT
                         " good, %" G_GUINT64_FORMAT
                         " see no mirror, %" G_GUINT64_FORMAT " saturated",
                     mapping.good, mapping.uncovered, mapping.saturated));
  }

  /* @prefix: of the properties that name them. */
  void check_files (const MoireMapping &mapping, const std::string &prefix)
  {
    for (const auto &[property, written] :
        {std::pair ("location", mapping.location),
            std::pair ("report", mapping.report)})
      unwritten_ |= written.empty () &&
                    !text_property (calib_, prefix + property).empty ();
  }

  /* Moves the simulated bench as a person would move the stage. */
  void move_stage (const StageMove &move)
  {
    GObject *stage = G_OBJECT (stage_);
    double x = 0, y = 0, rotation = 0, scale = 1;
    g_object_get (stage, "shift-x", &x, "shift-y", &y, "rotation", &rotation,
        "scale", &scale, nullptr);
    g_object_set (stage, "shift-x", x - kMovePart * move.offset_x, "shift-y",
        y - kMovePart * move.offset_y, "rotation",
        rotation - kMovePart * move.rotation, "scale",
        scale * (1.0 + kMovePart * (move.magnify / 1000.0)), nullptr);
  }

  Job &job_;
  GstElement *calib_;
  GstElement *stage_; ///< the simulated bench to move; null: a person does
  Status status_;
  int readings_ = 0;
  std::string last_reading_;
  bool failed_ = false; ///< the last mapping
  bool mapped_ = false, second_mapped_ = false;
  bool unwritten_ = false; ///< a requested file could not be written
  guint keys_ = 0;         ///< source of keys; 0: no terminal
};

} // namespace

Exit
guide (Job &job, GstElement *calib, GstElement *stage)
{
  const Guide guide (job, calib, stage);
  return play (job).exit;
}

} // namespace codedexposure::app
