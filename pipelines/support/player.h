/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Plays a pipeline in a main loop. */
#pragma once

#include <gst/gst.h>

#include "common/raii.h"
#include "outputs.h"
#include "report.h"

/** Plays a pipeline until quit (), then sets it to NULL. All callbacks run on
 * the thread of loop (). */
class Player
{
public:
  /** @p what  prefix of every printed line; @p verbose: progress goes to logs.
   */
  Player (const char *what, bool verbose);
  /** The destructors of derived classes call stop (). */
  virtual ~Player ();
  Player (const Player &) = delete;
  Player &operator= (const Player &) = delete;

  /** False, with a printed reason, if @p description is not a pipeline. */
  bool parse (const char *description);

protected:
  /** Starts the pipeline. Signals are handled before, so a signal during the
   * opening of a device does not leave it open. */
  virtual void begin () = 0;
  virtual void on_message (GstMessage *message) = 0;
  /** SIGINT, SIGTERM or SIGHUP, for the @p times th time. */
  virtual void on_signal (int times) = 0;

  /** Claims the files that the pipeline writes, and the table of the pictures
   * of @p coded. False, with printed reasons: they cannot be written. */
  bool claim_outputs (bool replace, GstPad *coded = nullptr);
  /** Starts the pipeline and runs the main loop; returns the code of quit ().
   */
  int loop ();
  void quit (int code);
  /** Sets the pipeline to NULL; no callback runs after that. */
  void stop ();
  /** Stops, and gives the files that have frames their names, or removes all
   * unless @p publish. False, with printed reasons, if that fails. */
  bool finish_outputs (bool publish = true);
  /** The element of that name, or null. */
  codedexposure::gst::ObjectPtr<GstElement> find (const char *name) const;

  report::Status status_;
  codedexposure::gst::ObjectPtr<GstElement> pipeline_;
  Outputs outputs_;

private:
  struct Signal {
    Player *player;
    int number;
    int times = 0;
  };
  static gboolean on_unix_signal (gpointer signal);
  bool has_screen ();
  bool say_missing (GstParseContext *context);

  GMainLoop *loop_;
  int code_ = 0;
};

/** Parses the arguments of @p program into @p entries and returns its PIPELINE;
 * null, with a printed reason, if they are invalid. */
const char *pipeline_argument (
    const char *program, const GOptionEntry *entries, int argc, char **argv);
