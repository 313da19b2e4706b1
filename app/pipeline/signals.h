/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Ctrl-C, and other signals that ask a command to end. */
#pragma once

#include <csignal>
#include <functional>
#include <list>
#include <utility>
#include <vector>

#include <glib-unix.h>

namespace codedexposure::app
{

/** SIGINT, SIGTERM and SIGHUP, but for what nohup has the process ignore. */
inline std::vector<int>
ending_signals ()
{
  std::vector<int> signals{SIGINT, SIGTERM};
  struct sigaction hangup = {};
  if (sigaction (SIGHUP, nullptr, &hangup) == 0 && hangup.sa_handler != SIG_IGN)
    signals.push_back (SIGHUP);
  return signals;
}

/** While it exists, SIGINT, SIGTERM and SIGHUP do not end the process. The main
 * loop tells them; one that comes while none runs is told by the next. */
class Signals
{
public:
  /** @p times  that the same signal has come. */
  using Listener = std::function<void (int times)>;

  Signals ()
  {
    for (const int number : ending_signals ()) {
      Signal &signal = signals_.emplace_back (Signal{this});
      signal.source = g_unix_signal_add (number, on_signal, &signal);
    }
  }

  ~Signals ()
  {
    for (const Signal &signal : signals_)
      g_source_remove (signal.source);
  }

  Signals (const Signals &) = delete;
  Signals &operator= (const Signals &) = delete;

  void tell (Listener listener) { listener_ = std::move (listener); }

private:
  /* Only the same signal again is another one: what starts this program may
   * pass on one that a terminal has sent to both. */
  struct Signal {
    Signals *all;
    guint source = 0;
    int times = 0;
  };

  static gboolean on_signal (gpointer data)
  {
    auto *signal = static_cast<Signal *> (data);
    signal->times++;
    if (signal->all->listener_)
      signal->all->listener_ (signal->times);
    return G_SOURCE_CONTINUE;
  }

  Listener listener_;
  std::list<Signal> signals_; // whose addresses stay
};

} // namespace codedexposure::app
