/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "guide.h"

#include <string_view>

#include <unistd.h>

#include <glib-unix.h>

#include "calibrate/session.h"
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

double
number_of (const GstStructure *structure, const char *field)
{
  double value = 0.0;
  gst_structure_get_double (structure, field, &value);
  return value;
}

std::string
text_of (const GstStructure *structure, const char *field)
{
  const gchar *text = gst_structure_get_string (structure, field);
  return text ? text : "";
}

class Guide
{
public:
  Guide (Job &job, GstElement *calib, GstElement *stage);
  ~Guide ();
  Guide (const Guide &) = delete;
  Guide &operator= (const Guide &) = delete;

private:
  gboolean take_key ();
  bool is_done ();
  Exit judge (bool interrupted);
  void end () const
  {
    gst_element_send_event (job_.graph.pipeline (), gst_event_new_eos ());
  }
  void on_element (const GstStructure *structure);
  void on_state (const std::string &state);
  void on_reading (const GstStructure *reading);
  void on_mapping (const GstStructure *mapping);
  void say_mapping (const GstStructure *mapping, const char *camera);
  void check_files (const GstStructure *mapping, const std::string &prefix);
  void move_stage (const GstStructure *reading);

  Job &job_;
  GstElement *calib_;
  GstElement *stage_; ///< the simulated bench to move; null: a person does
  Status status_;
  int readings_ = 0;
  std::string last_reading_;
  bool mapped_ = false, second_mapped_ = false;
  bool unwritten_ = false; ///< a requested file could not be written
  guint keys_ = 0;         ///< source of keys; 0: no terminal
};

Guide::Guide (Job &job, GstElement *calib, GstElement *stage)
    : job_ (job), calib_ (calib), stage_ (stage),
      status_ (job.command, job.options.verbose)
{
  job.ends_by_signal = true;
  job.on_message = [this] (
                       const GstStructure *message) { on_element (message); };
  job.judge = [this] (bool interrupted) { return judge (interrupted); };
  const auto on_key = [] (gint, GIOCondition, gpointer self) {
    return static_cast<Guide *> (self)->take_key ();
  };
  if (isatty (STDIN_FILENO) != 0)
    keys_ = g_unix_fd_add (STDIN_FILENO, G_IO_IN, on_key, this);
}

Guide::~Guide ()
{
  if (keys_ != 0)
    g_source_remove (keys_);
}

/* Enter starts the mapping without further alignment. */
gboolean
Guide::take_key ()
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

/* With mode=align, the user ends the program, and the last reading is the
 * result. */
bool
Guide::is_done ()
{
  GValue mode = G_VALUE_INIT;
  g_object_get_property (G_OBJECT (calib_), "mode", &mode);
  const CharPtr text (gst_value_serialize (&mode));
  g_value_unset (&mode);
  if (std::string_view (text.get ()) != "align" || last_reading_.empty ())
    return mapped_;
  status_.line (last_reading_);
  return true;
}

void
Guide::on_state (const std::string &state)
{
  if (state == "searching")
    status_.line ("searching for the grating: focus, and place the camera "
                  "roughly in front of the mirrors");
  else if (state == "coarse")
    status_.line ("coarse: move the stage as the arrows show, the angle first; "
                  "press Enter to start the mapping now");
  else if (state == "fine")
    status_.line ("fine: no pixel is off by more than one mirror; continue");
  else if (state == "aligned")
    status_.line ("aligned: do not touch the stage");
  else if (state == "mapping")
    status_.line ("showing patterns; do not touch the bench");
  else if (state == "solving")
    status_.line ("solving; the mirrors show the schedule again");
  else if (state == "failed" && keys_ != 0)
    status_.line ("the mapping failed; correct the bench and press Enter to "
                  "try again");
  else if (state == "failed")
    end ();
}

std::string
arrow (double way, const char *forth, const char *back)
{
  return way >= 0 ? forth : back;
}

void
Guide::on_reading (const GstStructure *reading)
{
  const double x = number_of (reading, "stage-x");
  const double y = number_of (reading, "stage-y");
  const double theta = number_of (reading, "stage-theta");
  const double magnify = number_of (reading, "magnify");
  status_.progress (format (
      "%s  %s %+.2f µm  %s %+.2f µm  %s %+.1f mdeg  magnify %+.2f per mille  "
      "(worst corner %.3f mirrors)",
      text_of (reading, "state").c_str (), arrow (x, "→", "←").c_str (), x,
      arrow (y, "↓", "↑").c_str (), y, arrow (theta, "↻", "↺").c_str (), theta,
      magnify, number_of (reading, "deviation")));
  last_reading_ = format (
      "%s: rotation %+.5f deg, magnification %.6f, offset %+.5f, %+.5f mirrors "
      "(worst corner %.3f)",
      text_of (reading, "state").c_str (), number_of (reading, "rotation"),
      number_of (reading, "magnification"), number_of (reading, "offset-x"),
      number_of (reading, "offset-y"), number_of (reading, "deviation"));
  if (stage_ && ++readings_ % kReadingsPerMove == 0)
    move_stage (reading);
}

/* Moves the simulated bench as a person would move the stage. */
void
Guide::move_stage (const GstStructure *reading)
{
  if (text_of (reading, "state") == "aligned")
    return;
  GObject *stage = G_OBJECT (stage_);
  double x = 0, y = 0, rotation = 0, scale = 1;
  g_object_get (stage, "shift-x", &x, "shift-y", &y, "rotation", &rotation,
      "scale", &scale, nullptr);
  const double magnify = number_of (reading, "magnify") / 1000.0;
  g_object_set (stage, "shift-x",
      x - kMovePart * number_of (reading, "offset-x"), "shift-y",
      y - kMovePart * number_of (reading, "offset-y"), "rotation",
      rotation - kMovePart * number_of (reading, "rotation"), "scale",
      scale * (1.0 + kMovePart * magnify), nullptr);
}

/* @camera: "" or "second camera, ". */
void
Guide::say_mapping (const GstStructure *mapping, const char *camera)
{
  guint64 good = 0, uncovered = 0, saturated = 0;
  gst_structure_get (mapping, "good", G_TYPE_UINT64, &good, "uncovered",
      G_TYPE_UINT64, &uncovered, "saturated", G_TYPE_UINT64, &saturated,
      nullptr);
  status_.line (
      camera + format ("mapped: rotation %+.5f ± %.0e deg, magnification "
                       "%.6f ± %.0e, offset %+.5f, %+.5f ± %.0e mirrors",
                   number_of (mapping, "rotation"),
                   number_of (mapping, "sigma-rotation"),
                   number_of (mapping, "magnification"),
                   number_of (mapping, "sigma-magnification"),
                   number_of (mapping, "offset-x"),
                   number_of (mapping, "offset-y"),
                   number_of (mapping, "sigma-x")));
  status_.line (
      camera + format ("pixels: %" G_GUINT64_FORMAT " good, %" G_GUINT64_FORMAT
                       " see no mirror, %" G_GUINT64_FORMAT " saturated",
                   good, uncovered, saturated));
}

/* @prefix: of the properties that name them. */
void
Guide::check_files (const GstStructure *mapping, const std::string &prefix)
{
  for (const char *file : {"location", "report"}) {
    gchar *asked = nullptr;
    g_object_get (calib_, (prefix + file).c_str (), &asked, nullptr);
    const bool is_written = mapping && !text_of (mapping, file).empty ();
    unwritten_ |= !is_written && asked && *asked;
    g_free (asked);
  }
}

/* That of a second camera comes before it. */
void
Guide::on_mapping (const GstStructure *mapping)
{
  mapped_ = true;
  say_mapping (mapping, "");
  double tolerance = 0;
  g_object_get (calib_, "tolerance", &tolerance, nullptr);
  StageCorrection remaining;
  remaining.deviation = number_of (mapping, "deviation");
  status_.line (alignment_verdict (remaining, tolerance));
  check_files (mapping, "");
  if (!second_mapped_)
    check_files (nullptr, "second-");
  end ();
}

void
Guide::on_element (const GstStructure *structure)
{
  const std::string_view name = gst_structure_get_name (structure);
  if (name == "moirecalib/state")
    on_state (text_of (structure, "state"));
  else if (name == "moirecalib/reading")
    on_reading (structure);
  else if (name == "moirecalib/second-mapping") {
    second_mapped_ = true;
    say_mapping (structure, "second camera, ");
    check_files (structure, "second-");
  } else if (name == "moirecalib/mapping")
    on_mapping (structure);
}

/* A signal ends an alignment well. */
Exit
Guide::judge (bool interrupted)
{
  if (is_done ())
    return unwritten_ ? Exit::failed : Exit::done;
  if (interrupted)
    status_.line ("stopped; the mirrors show the schedule again");
  return interrupted ? Exit::interrupted : Exit::failed;
}

} // namespace

Exit
guide (Job &job, GstElement *calib, GstElement *stage)
{
  const Guide guide (job, calib, stage);
  return play (job).exit;
}

} // namespace codedexposure::app
