/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A pipeline that is played in a main loop. */
#pragma once

#include <gst/gst.h>

#include "gstraii.h"
#include "report.h"

/** Plays a pipeline until it is told to quit, and takes it to NULL in the end.
 * Everything happens on the thread that runs it. */
class Player
{
public:
  /** @p what stands in front of every line that is said. */
  explicit Player (const char *what);
  /** Derived classes have stopped by then. */
  virtual ~Player ();
  Player (const Player &) = delete;
  Player &operator= (const Player &) = delete;

  /** False where @p description is no pipeline, and why is said. */
  bool parse (const char *description);

protected:
  /** Sets the pipeline going. Signals are taken from then on, so that a device
   * is not left open by one that comes while it is opened. */
  virtual void begin () = 0;
  virtual void on_message (GstMessage *message) = 0;
  /** SIGINT or SIGTERM. */
  virtual void on_signal () = 0;

  /** Begins, and runs the main loop; the code that quit () was given. */
  int loop ();
  void quit (int code);
  /** To NULL, after which nothing calls back any more. */
  void stop ();
  /** The element of that name; null where there is none. */
  cexp::gst::ObjectPtr<GstElement> find (const char *name) const;

  report::Status status_;
  cexp::gst::ObjectPtr<GstElement> pipeline_;

private:
  bool say_missing (GstParseContext *context);

  GMainLoop *loop_;
  int code_ = 0;
};

/** The PIPELINE among the arguments of @p program, whose options go where
 * @p entries say; null, and why is said, where they are wrong. */
const char *pipeline_argument (
    const char *program, const GOptionEntry *entries, int argc, char **argv);
