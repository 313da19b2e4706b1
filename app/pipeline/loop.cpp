/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "loop.h"

#include <csignal>
#include <vector>

#include <glib-unix.h>

namespace codedexposure::app
{

using namespace gst;

namespace
{

bool
is_ignored (int signal)
{
  struct sigaction action = {};
  return sigaction (signal, nullptr, &action) == 0 &&
         action.sa_handler == SIG_IGN;
}

} // namespace

Loop::Loop (GstElement *pipeline)
    : pipeline_ (pipeline), loop_ (g_main_loop_new (nullptr, FALSE))
{
}

Loop::~Loop ()
{
  g_main_loop_unref (loop_);
}

/* What starts this program may pass on a signal that a terminal has sent to
 * both; only the same signal again is another one. */
gboolean
Loop::on_unix_signal (gpointer data)
{
  auto *signal = static_cast<Signal *> (data);
  signal->loop->on_signal (++signal->times);
  return G_SOURCE_CONTINUE;
}

void
Loop::run ()
{
  const auto on_bus = [] (GstBus *, GstMessage *message, gpointer self) {
    static_cast<Loop *> (self)->on_message (message);
    return gboolean (G_SOURCE_CONTINUE);
  };
  const ObjectPtr<GstBus> bus (gst_element_get_bus (pipeline_));
  gst_bus_add_watch (bus.get (), on_bus, this);
  /* The reader of the messages may be gone. */
  std::signal (SIGPIPE, SIG_IGN);
  Signal signals[] = {{this, SIGINT}, {this, SIGTERM}, {this, SIGHUP}};
  std::vector<guint> sources;
  for (Signal &signal : signals)
    if (signal.number != SIGHUP || !is_ignored (SIGHUP)) // nohup
      sources.push_back (
          g_unix_signal_add (signal.number, on_unix_signal, &signal));
  begin ();
  g_main_loop_run (loop_);
  for (const guint source : sources)
    g_source_remove (source);
  gst_bus_remove_watch (bus.get ());
}

} // namespace codedexposure::app
