/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A main loop that plays a pipeline and takes signals. */
#pragma once

#include <gst/gst.h>

#include "common/raii.h"

namespace codedexposure::app
{

/** Plays a pipeline until quit (). All callbacks run on the thread of run ().
 */
class Loop
{
public:
  explicit Loop (GstElement *pipeline);
  /** The destructors of derived classes set the pipeline to NULL. */
  virtual ~Loop ();
  Loop (const Loop &) = delete;
  Loop &operator= (const Loop &) = delete;

protected:
  /** Starts the pipeline. Signals are handled before, so a signal during the
   * opening of a device does not leave it open. */
  virtual void begin () = 0;
  virtual void on_message (GstMessage *message) = 0;
  /** SIGINT, SIGTERM or SIGHUP, for the @p times th time. */
  virtual void on_signal (int times) = 0;

  /** Calls begin () and runs the main loop until quit (). */
  void run ();
  void quit () { g_main_loop_quit (loop_); }
  GstElement *pipeline () const { return pipeline_; }

private:
  struct Signal {
    Loop *loop;
    int number;
    int times = 0;
  };
  static gboolean on_unix_signal (gpointer signal);

  GstElement *pipeline_;
  GMainLoop *loop_;
};

} // namespace codedexposure::app
