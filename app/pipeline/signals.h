/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Ctrl-C, and other signals that ask a command to end. */
#pragma once

#include <functional>
#include <list>

#include <glib.h>

namespace codedexposure::app
{

/** While it exists, SIGINT, SIGTERM and SIGHUP do not end the process. The main
 * loop tells them; one that comes while none runs is told by the next. */
class Signals
{
public:
  /** @p times  that the same signal has come. */
  using Listener = std::function<void (int times)>;

  Signals ();
  ~Signals ();
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
  static gboolean on_signal (gpointer signal);

  Listener listener_;
  std::list<Signal> signals_; // whose addresses stay
};

} // namespace codedexposure::app
