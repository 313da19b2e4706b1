/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Who receives a stream over TCP. */
#pragma once

#include <atomic>
#include <cerrno>
#include <chrono>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "pipeline/graph.h"
#include "pipeline/pads.h"

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
  explicit Receivers (GstElement *sink) : sink_ (sink)
  {
    g_signal_connect (sink, "client-added", G_CALLBACK (on_added), this);
    g_signal_connect (sink, "client-removed", G_CALLBACK (on_removed), this);
    add_probe (pad_of (sink, "sink").get (),
        GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM,
        [this] (GstPad *pad, GstPadProbeInfo *info) {
          if (GST_EVENT_TYPE (gst_pad_probe_info_get_event (info)) ==
              GST_EVENT_EOS)
            end (pad);
          return GST_PAD_PROBE_OK;
        });
  }

  ~Receivers ()
  {
    g_signal_handlers_disconnect_by_data (sink_, this);
    for (const int socket : ended_)
      close (socket);
  }

  Receivers (const Receivers &) = delete;
  Receivers &operator= (const Receivers &) = delete;

  /** Whether there is a connection. A paused sink accepts them, so they do not
   * miss the first frame. */
  bool is_anybody_there () const
  {
    guint connections = 0;
    g_object_get (sink_, "num-handles", &connections, nullptr);
    return connections > 0;
  }

  /** Often after the end of the stream, on one thread: whether all have it,
   * have gone, or have taken nothing for 10 s. */
  bool are_done ()
  {
    constexpr auto kPatience = std::chrono::seconds (10);
    const auto now = std::chrono::steady_clock::now ();
    guint64 sent = 0;
    g_object_get (sink_, "bytes-served", &sent, nullptr);
    if (std::exchange (sent_, sent) != sent || !progressed_)
      progressed_ = now;
    const std::lock_guard lock (mutex_);
    std::erase_if (ended_, [this] (int socket) {
      char left = 0;
      const ssize_t got = recv (socket, &left, 1, MSG_DONTWAIT);
      const bool is_open = got > 0 || (got < 0 && errno == EAGAIN);
      if (got == 0 || (is_open && has_taken_much (socket)))
        count_++;
      else if (is_open)
        return false;
      close (socket);
      return true;
    });
    return (connected_.empty () && ended_.empty ()) ||
           now - *progressed_ > kPatience;
  }

  /** How many have read the stream. */
  int count () const { return count_; }

private:
  /* GstClientStatus is in no header that is installed. */
  enum Status { kClosed = 1, kRemoved = 2, kSlow = 3 };

  /* More than a system accepts for a program that does not read. */
  static bool has_taken_much (int socket)
  {
    constexpr guint64 kMuch = 1 << 20;
    tcp_info info = {};
    socklen_t size = sizeof info;
    return getsockopt (socket, IPPROTO_TCP, TCP_INFO, &info, &size) == 0 &&
           info.tcpi_bytes_acked > kMuch;
  }

  static bool has_begun (GstElement *sink, GObject *socket)
  {
    GstStructure *stats = nullptr;
    g_signal_emit_by_name (sink, "get-stats", socket, &stats);
    const gst::StructurePtr owned (stats);
    guint64 sent = 0;
    return stats && gst_structure_get_uint64 (stats, "bytes-sent", &sent) &&
           sent > 0;
  }

  static void on_added (GstElement *, GObject *socket, gpointer data)
  {
    auto *self = static_cast<Receivers *> (data);
    const std::lock_guard lock (self->mutex_);
    self->connected_.emplace_back (G_OBJECT (g_object_ref (socket)));
  }

  /* The sink closes its descriptor, not ours. A connection that ends with all
   * data read is closed; one with data left is reset. */
  static void on_removed (
      GstElement *sink, GObject *socket, int status, gpointer data)
  {
    auto *self = static_cast<Receivers *> (data);
    if (status == kSlow)
      GST_ELEMENT_WARNING (sink, RESOURCE, WRITE,
          ("A receiver was too slow and was disconnected; it lacks what "
           "follows. It needs a faster network or disk, or less data (--codec "
           "ffv1)."),
          (nullptr));
    gint descriptor = -1;
    g_object_get (socket, "fd", &descriptor, nullptr);
    const bool begun = has_begun (sink, socket);
    const std::lock_guard lock (self->mutex_);
    std::erase_if (self->connected_,
        [socket] (const auto &known) { return known.get () == socket; });
    if (!begun)
      return;
    if (status == kClosed || has_taken_much (descriptor))
      self->count_++;
    else if (status == kRemoved) {
      shutdown (descriptor, SHUT_WR);
      self->ended_.push_back (dup (descriptor));
    }
  }

  /* The sink removes each connection when it has sent what waits for it. One
   * that waits for more notices that with the next buffer. */
  void end (GstPad *pad)
  {
    std::vector<gst::ObjectPtr<GObject>> sockets;
    {
      const std::lock_guard lock (mutex_);
      for (const auto &socket : connected_)
        sockets.emplace_back (G_OBJECT (g_object_ref (socket.get ())));
    }
    for (const auto &socket : sockets)
      g_signal_emit_by_name (sink_, "remove-flush", socket.get ());
    gst_pad_chain (pad, gst_buffer_new ());
  }

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
