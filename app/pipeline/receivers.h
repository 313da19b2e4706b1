/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Who receives a stream over TCP. */
#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>
#include <vector>

#include <gst/gst.h>

#include "common/raii.h"

namespace codedexposure::app
{

/**
 * Counts the connections to a tcpserversink that have read the stream, and lets
 * each have its end: by itself, the sink drops what a slow receiver has not yet
 * got.
 *
 * Whether a program has read what its system accepted shows when it closes the
 * connection, which resets it if data is left; or in an amount that no system
 * keeps for a program that does not read.
 */
class Receivers
{
public:
  /** Before @p sink runs; it has stopped when this is destroyed. */
  explicit Receivers (GstElement *sink);
  ~Receivers ();
  Receivers (const Receivers &) = delete;
  Receivers &operator= (const Receivers &) = delete;

  /** Whether there is a connection. A paused sink accepts them, so they do not
   * miss the first frame. */
  bool is_anybody_there () const;
  /** Often after the end of the stream, on one thread: whether all have it,
   * have gone, or have taken nothing for 10 s. */
  bool are_done ();
  /** How many have read the stream. */
  int count () const { return count_; }

private:
  static void on_added (GstElement *, GObject *socket, gpointer self);
  static void on_removed (
      GstElement *, GObject *socket, int status, gpointer self);
  void end (GstPad *pad);

  GstElement *const sink_; // of the pipeline
  std::atomic<int> count_ = 0;
  std::mutex mutex_; // of all below
  std::vector<gst::ObjectPtr<GObject>> connected_;
  std::vector<int> ended_; // sockets that we have shut down

  /* Thread of are_done (): */
  guint64 sent_ = 0; // bytes, to all
  std::optional<std::chrono::steady_clock::time_point> progressed_;
};

} // namespace codedexposure::app
