/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "guide.h"

#include <string_view>

#include <unistd.h>

#include <glib-unix.h>

#include "calibrate/session.h"
#include "pipeline/loop.h"
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

class Guide : public Loop
{
public:
  Guide (Job &job, GstElement *calib, GstElement *stage)
      : Loop (job.graph.pipeline ()), job_ (job), calib_ (calib),
        stage_ (stage), status_ (job.command, job.options.verbose)
  {
  }
  ~Guide () override { stop (); }

  Exit play ();

private:
  static gboolean on_key (gint, GIOCondition, gpointer self)
  {
    return static_cast<Guide *> (self)->take_key ();
  }

  gboolean take_key ();
  bool is_done ();
  void begin () override
  {
    gst_element_set_state (pipeline (), GST_STATE_PLAYING);
  }
  void end (Exit exit)
  {
    exit_ = exit;
    quit ();
  }
  void stop () { gst_element_set_state (pipeline (), GST_STATE_NULL); }
  void on_signal (int times) override;
  void on_message (GstMessage *message) override;
  void on_element (const GstStructure *structure);
  void on_state (const std::string &state);
  void on_reading (const GstStructure *reading);
  void on_mapping (const GstStructure *mapping);
  void move_stage (const GstStructure *reading);

  Job &job_;
  GstElement *calib_;
  GstElement *stage_; ///< the simulated bench to move; null: a person does
  Status status_;
  Exit exit_ = Exit::failed;
  int readings_ = 0;
  std::string last_reading_;
  bool mapped_ = false;
  bool unwritten_ = false;  ///< a requested file could not be written
  bool takes_keys_ = false; ///< standard input is a terminal
};

void
Guide::on_signal (int)
{
  status_.line ("stopped; the mirrors show the schedule again");
  end (is_done () ? Exit::done : Exit::interrupted);
}

/* Enter starts the mapping without further alignment. */
gboolean
Guide::take_key ()
{
  char keys[64];
  if (read (STDIN_FILENO, keys, sizeof keys) <= 0)
    return G_SOURCE_REMOVE;
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
  else if (state == "failed" && takes_keys_)
    status_.line ("the mapping failed; correct the bench and press Enter to "
                  "try again");
  else if (state == "failed")
    end (Exit::failed);
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

void
Guide::on_mapping (const GstStructure *mapping)
{
  mapped_ = true;
  guint64 good = 0, uncovered = 0, saturated = 0;
  gst_structure_get (mapping, "good", G_TYPE_UINT64, &good, "uncovered",
      G_TYPE_UINT64, &uncovered, "saturated", G_TYPE_UINT64, &saturated,
      nullptr);
  status_.line (format ("mapped: rotation %+.5f ± %.0e deg, magnification "
                        "%.6f ± %.0e, offset %+.5f, %+.5f ± %.0e mirrors",
      number_of (mapping, "rotation"), number_of (mapping, "sigma-rotation"),
      number_of (mapping, "magnification"),
      number_of (mapping, "sigma-magnification"),
      number_of (mapping, "offset-x"), number_of (mapping, "offset-y"),
      number_of (mapping, "sigma-x")));
  status_.line (format ("pixels: %" G_GUINT64_FORMAT " good, %" G_GUINT64_FORMAT
                        " see no mirror, %" G_GUINT64_FORMAT " saturated",
      good, uncovered, saturated));
  double tolerance = 0;
  g_object_get (calib_, "tolerance", &tolerance, nullptr);
  StageCorrection remaining;
  remaining.deviation = number_of (mapping, "deviation");
  status_.line (alignment_verdict (remaining, tolerance));
  for (const char *file : {"location", "report"}) {
    const std::string path = text_of (mapping, file);
    gchar *asked = nullptr;
    g_object_get (calib_, file, &asked, nullptr);
    unwritten_ |= path.empty () && asked && *asked;
    g_free (asked);
  }
  gst_element_send_event (pipeline (), gst_event_new_eos ());
}

void
Guide::on_element (const GstStructure *structure)
{
  const std::string_view name = gst_structure_get_name (structure);
  if (name == "moirecalib/state")
    on_state (text_of (structure, "state"));
  else if (name == "moirecalib/reading")
    on_reading (structure);
  else if (name == "moirecalib/mapping")
    on_mapping (structure);
}

void
Guide::on_message (GstMessage *message)
{
  GError *error = nullptr;
  gchar *text = nullptr;
  switch (GST_MESSAGE_TYPE (message)) {
  case GST_MESSAGE_EOS:
    end (mapped_ && !unwritten_ ? Exit::done : Exit::failed);
    return;
  case GST_MESSAGE_ERROR:
    gst_message_parse_error (message, &error, &text);
    status_.line ("error: " + told (message, error, text));
    end (mapped_ ? Exit::done : Exit::failed);
    break;
  case GST_MESSAGE_WARNING:
    status_.line ("warning: " + warned (message));
    break;
  case GST_MESSAGE_INFO:
    status_.line ("info: " + noted (message));
    break;
  case GST_MESSAGE_PROGRESS:
    gst_message_parse_progress (message, nullptr, nullptr, &text);
    status_.progress (text ? text : "");
    break;
  case GST_MESSAGE_LATENCY:
    gst_bin_recalculate_latency (GST_BIN (pipeline ()));
    break;
  case GST_MESSAGE_ELEMENT:
    on_element (gst_message_get_structure (message));
    break;
  default:
    break;
  }
  g_clear_error (&error);
  g_free (text);
}

Exit
Guide::play ()
{
  value_of (job_.outputs.check (), Exit::usage);
  const auto refused = job_.outputs.claim (job_.options.force);
  for (const std::string &error : refused)
    status_.line ("error: " + error);
  if (!refused.empty ())
    return Exit::failed;
  takes_keys_ = isatty (STDIN_FILENO) != 0;
  const guint keys =
      takes_keys_ ? g_unix_fd_add (STDIN_FILENO, G_IO_IN, on_key, this) : 0;
  run ();
  if (keys != 0)
    g_source_remove (keys);
  stop ();
  const auto errors = job_.outputs.finish (
      mapped_ ? Outputs::Finish::publish : Outputs::Finish::discard);
  for (const std::string &error : errors)
    status_.line ("error: " + error);
  if (!errors.empty ())
    return Exit::failed;
  if (const std::string wrote = job_.outputs.summary ({}); !wrote.empty ())
    status_.line ("wrote " + wrote);
  return exit_;
}

} // namespace

Exit
guide (Job &job, GstElement *calib, GstElement *stage)
{
  if (!job.options.print)
    return Guide (job, calib, stage).play ();
  print_pipeline (job);
  return Exit::done;
}

} // namespace codedexposure::app
