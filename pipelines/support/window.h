/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The window of live and receive: panes beside each other, what is known of
 * the frames, a loop of the last second, and snapshots. */
#pragma once

#include <array>
#include <atomic>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/result.h"
#include "common/meta.h"
#include "common/raii.h"
#include "replay.h"
#include "stats/picture_stats.h"
#include "window_paint.h"

/**
 * Adds to the pipeline of display () in common.sh what a pipeline alone cannot:
 * a layout that fits the screen, captions, the panel, keys and the loop. It
 * only looks at the branches of the window, behind their leaky queues, and
 * keeps copies of their last pictures; the stream never waits for it.
 */
class Window
{
public:
  struct Calls {
    std::function<void ()> end; ///< the key Q; main thread
    /** A snapshot was written, or could not be; main thread. */
    std::function<void (const std::string &text, bool failed)> said;
  };

  /** Whether @p pipeline has such a window. */
  static bool is_in (GstElement *pipeline);
  /** Before the pipeline plays, which stops before this is destroyed.
   * @p coded  pad whose caps are those of the coded frames.
   * @p room   for the window, in pixels.
   * @p name   of the program, in the names of snapshots. */
  Window (GstElement *pipeline, GstPad *coded, codedexposure::Extent room,
      std::string name, Calls calls);
  ~Window ();
  Window (const Window &) = delete;
  Window &operator= (const Window &) = delete;

  /** What the panel says of all frames: "123 coded frames, 1 lost". Main
   * thread. */
  void tell (const std::string &frames, bool alarm);
  /** Writes the snapshots that were not yet written. */
  void save_snapshots ();

private:
  struct Shown { // a remembered picture
    GreyPicture grey;
    std::optional<codedexposure::gst::FrameMeta> meta;
    bool corrupted = false;
    GstClockTime stream_time = GST_CLOCK_TIME_NONE;
    std::shared_ptr<const Exposure> exposure; // of a coded frame
  };
  using ShownPtr = std::shared_ptr<const Shown>;
  struct Pane;
  struct Snapshot {
    Surface picture;
    std::string name;
  };
  using Meter =
      std::variant<std::monostate, codedexposure::StatsMeter<std::uint8_t>,
          codedexposure::StatsMeter<std::uint16_t>>;

  static GstPadProbeReturn on_camera_caps (
      GstPad *, GstPadProbeInfo *info, gpointer self);
  static GstPadProbeReturn on_pane_data (
      GstPad *pad, GstPadProbeInfo *info, gpointer pane);
  static GstPadProbeReturn on_kept (
      GstPad *pad, GstPadProbeInfo *info, gpointer pane);
  static GstPadProbeReturn on_upstream (
      GstPad *, GstPadProbeInfo *info, gpointer self);
  static void on_draw (
      GstElement *, cairo_t *cairo, guint64 time, guint64, gpointer self);
  static gboolean on_end (gpointer self);
  static gboolean on_snapshot (gpointer self);

  void watch (Pane &pane);
  void set_layout (const GstVideoInfo &camera);
  void set_pane (Pane &pane, const GstVideoInfo &picture);
  void measure (Pane &pane, GstPad *pad, GstBuffer *frame);
  bool is_kept (const Pane &pane, ViewTime time) const;
  void remember (Pane &pane, GstPad *pad, GstBuffer *picture);
  void press (const std::string &key);
  static bool is_pair (const Shown &one, const Shown &other);
  void draw (cairo_t *cairo, ViewTime time);
  std::vector<PanelLine> lines (
      const Shown *subframe, const Shown *coded, ViewTime time) const;
  void take_snapshot (
      cairo_t *cairo, const WindowLayout &layout, const Shown &subframe);
  codedexposure::Result<std::string> save (const Snapshot &snapshot) const;

  const codedexposure::Extent room_;
  const std::string name_;
  const Calls calls_;
  std::vector<std::unique_ptr<Pane>> panes_; // constant
  codedexposure::gst::ObjectPtr<GstElement> compositor_, size_;

  std::mutex mutex_; // of all below
  std::optional<WindowLayout> layout_;
  GstVideoInfo camera_ = {}; // set with the layout
  bool captions_changed_ = true;
  Replay replay_;
  ViewTime now_ = 0; // of the last picture of the window
  bool snapshot_wanted_ = false;
  std::deque<Snapshot> snapshots_; // to be written
  PanelLine frames_;

  /* The thread that draws: */
  Surface captions_, panel_;
  ViewTime painted_ = 0;                   // time of the panel
  const void *painted_subframe_ = nullptr; // only compared
};
