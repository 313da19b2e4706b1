/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "signals.h"

#include <csignal>

#include <glib-unix.h>

namespace codedexposure::app
{

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

Signals::Signals ()
{
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    if (number == SIGHUP && is_ignored (SIGHUP)) // nohup
      continue;
    Signal &signal = signals_.emplace_back (Signal{this});
    signal.source = g_unix_signal_add (number, on_signal, &signal);
  }
}

Signals::~Signals ()
{
  for (const Signal &signal : signals_)
    g_source_remove (signal.source);
}

gboolean
Signals::on_signal (gpointer data)
{
  auto *signal = static_cast<Signal *> (data);
  signal->times++;
  if (signal->all->listener_)
    signal->all->listener_ (signal->times);
  return G_SOURCE_CONTINUE;
}

} // namespace codedexposure::app
