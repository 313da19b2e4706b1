/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The window of live and receive: panes beside each other, what is known of
 * the frames, a loop of the last second, and snapshots. */
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "common/meta.h"
#include "common/raii.h"
#include "pipeline/job.h"
#include "stats/picture_stats.h"
#include "window/branch.h"
#include "window/keeper.h"
#include "window/paint.h"
#include "window/player.h"
#include "window/replay.h"
#include "window/snapshots.h"

namespace codedexposure::app
{

/**
 * Adds to the elements of a window what a pipeline alone cannot: a layout that
 * fits the screen, captions, the panel, keys and the loop. It only looks at the
 * branches of the window, behind their leaky queues, and keeps copies of their
 * last pictures; the stream never waits for it.
 */
class Window : public Viewer
{
public:
  struct Style {
    Extent room;            ///< for the window, in pixels
    GstClockTime delay = 0; ///< after which frames are shown
    std::string name;       ///< of the command, in the names of snapshots
    /** Moves in a recording; null: the window looks at what comes. */
    std::unique_ptr<Player> player = nullptr;
  };

  /** @p coded  pad whose caps are those of the coded frames. */
  Window (WindowBranch branch, GstPad *coded, Style style);
  ~Window () override;
  Window (const Window &) = delete;
  Window &operator= (const Window &) = delete;

  void begin (Calls calls) override;
  void tell (const std::string &frames, bool alarm) override;
  bool take (GstMessage *message) override;
  /** Writes the snapshots and frames that were not yet written. */
  void finish () override;

private:
  struct Shown { // a remembered picture
    GreyPicture grey;
    std::optional<gst::FrameMeta> meta;
    bool corrupted = false;
    GstClockTime stream_time = GST_CLOCK_TIME_NONE;
    std::shared_ptr<const Exposure> exposure; // of a coded frame
  };
  using ShownPtr = std::shared_ptr<const Shown>;
  struct Pane;
  static GstPadProbeReturn on_camera_caps (
      GstPad *, GstPadProbeInfo *info, gpointer self);
  static GstPadProbeReturn on_arriving_caps (
      GstPad *, GstPadProbeInfo *info, gpointer pane);
  static GstPadProbeReturn on_pane_data (
      GstPad *pad, GstPadProbeInfo *info, gpointer pane);
  static GstPadProbeReturn on_kept (
      GstPad *pad, GstPadProbeInfo *info, gpointer pane);
  static GstPadProbeReturn on_upstream (
      GstPad *, GstPadProbeInfo *info, gpointer overlay);
  static void on_draw (
      GstElement *, cairo_t *cairo, guint64 time, guint64, gpointer self);

  void watch (Pane &pane);
  void set_layout (const GstVideoInfo &camera);
  void set_queues (const Pane &pane, const GstVideoInfo &picture);
  void set_pane (Pane &pane, const GstVideoInfo &picture);
  void measure (Pane &pane, GstPad *pad, GstBuffer *frame);
  bool is_kept (const Pane &pane, ViewTime time) const;
  void remember (Pane &pane, GstPad *pad, GstBuffer *picture);
  void press (const std::string &key);
  void set_contrast (int by);
  static bool is_pair (const Shown &one, const Shown &other);
  bool is_wanted (const Shown &subframe) const;
  void draw (cairo_t *cairo, ViewTime time);
  std::vector<PanelLine> lines (
      const Shown *subframe, const Shown *coded, ViewTime time) const;
  void take_snapshot (
      cairo_t *cairo, const WindowLayout &layout, const Shown &subframe);
  void keep ();

  GstElement *const size_; // of the pipeline
  const Extent room_;
  const GstClockTime delay_;
  const std::string name_;
  Calls calls_; // constant while the pipeline plays
  std::vector<std::unique_ptr<Pane>> panes_; // constant
  std::optional<Keeper> keeper_;             // of what comes
  const std::unique_ptr<Player> player_;
  Snapshots snapshots_;
  gst::ObjectPtr<GstPad> panel_at_; // where it is drawn
  guint on_signal_ = 0;             // source

  std::atomic<int> bits_ = 8; // of the pixels that came last

  std::mutex mutex_; // of all below
  std::optional<WindowLayout> layout_;
  GstVideoInfo camera_ = {}; // set with the layout
  bool captions_changed_ = true;
  int contrast_ = 0; // pictures are 2 to the power of it brighter
  Replay replay_;
  ViewTime now_ = 0; // of the last picture of the window
  bool snapshot_wanted_ = false;
  PanelLine frames_;

  /* The thread that draws: */
  Surface captions_, panel_;
  ViewTime painted_ = 0;                   // time of the panel
  const void *painted_subframe_ = nullptr; // only compared
};

/** Shows the pictures of two or three chains of @p job in a window: camera,
 * subframes, perhaps fused. Throws Failure if there is no screen. */
void add_window (Job &job, const std::vector<Chain> &sources,
    const WindowOptions &options, std::optional<int> bits = {},
    std::optional<Played> played = {});

} // namespace codedexposure::app
