/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The window of live, receive and play: panes beside each other, what is known
 * of the frames, a loop of the last second, a closer look, and snapshots. */
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
#include "window/detail.h"
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
  /** @p job     has what is shown, and outlives this.
   * @p player  moves in a recording; null: the window looks at what comes. */
  Window (const Job &job, WindowBranch branch, std::unique_ptr<Player> player);
  ~Window () override;
  Window (const Window &) = delete;
  Window &operator= (const Window &) = delete;

  void begin (Calls calls) override;
  void tell (const std::string &frames, bool alarm) override;
  bool take (GstMessage *message) override;
  /** Writes the snapshots and frames that were not yet written. */
  void finish () override;

private:
  struct Shown : FullPicture { // a remembered picture
    std::optional<gst::FrameMeta> meta;
    bool corrupted = false;
    GstClockTime stream_time = GST_CLOCK_TIME_NONE;
    std::shared_ptr<const Exposure> exposure; // of a coded frame
  };
  using ShownPtr = std::shared_ptr<const Shown>;
  struct Pane;
  static void on_draw (GstElement *overlay, cairo_t *cairo, guint64 time,
      guint64, gpointer self);

  static void watch_keys (GstElement *overlay);
  void watch (Pane &pane);
  GstPadProbeReturn take_data (Pane &pane, GstPad *pad, GstPadProbeInfo *info);
  void set_layout (const GstVideoInfo &camera);
  void set_queues (const Pane &pane, const GstVideoInfo &picture);
  void set_pane (Pane &pane, const GstVideoInfo &picture);
  void measure (Pane &pane, const FullPicture &frame);
  bool is_kept (const Pane &pane, ViewTime time) const;
  void remember (Pane &pane, GstPad *pad, GstBuffer *frame);

  bool take_mouse (GstEvent *event);
  void press_button (int button, Position at);
  void move_pointer (Position at);
  void press (const std::string &key);
  bool press_look (const std::string &key);
  void press_replay (const std::string &key);
  void keep ();
  bool take_kept (GstMessage *message);
  void stretch_tones ();
  void fill_screen (bool fills);
  void turn_camera (const std::string &key);
  std::optional<Position> seen_at (Position in_window) const;

  static bool is_pair (const Shown &one, const Shown &other);
  bool is_wanted (const Shown &subframe) const;
  struct Scene; // what is drawn
  std::vector<ShownPtr> shown_at (ViewTime time) const;
  DetailPlace place_of (const Pane &pane) const;
  std::string caption_of (const Pane &pane, const Shown *shown) const;
  Scene scene_at (ViewTime time);
  void draw (cairo_t *cairo, ViewTime time);
  void draw_texts (cairo_t *cairo, const Scene &scene, ViewTime time);
  std::string view_text () const;
  std::vector<PanelLine> lines (
      const Shown *subframe, const Shown *coded, ViewTime time) const;
  void take_snapshot (cairo_t *cairo, const Scene &scene);

  GstElement *const size_; // of the pipeline
  const Job &job_;
  const std::unique_ptr<Player> player_;
  const Extent room_; // for the window, in pixels
  Calls calls_;       // constant while the pipeline plays
  std::vector<std::unique_ptr<Pane>> panes_; // constant
  Snapshots snapshots_;
  gst::ObjectPtr<GstPad> panel_at_; // where it is drawn
  guint on_signal_ = 0;             // source

  std::atomic<int> bits_ = 8; // of the pixels that came last

  std::mutex mutex_; // of all below
  std::optional<WindowLayout> layout_;
  GstVideoInfo camera_ = {}; // set with the layout
  Look look_;
  std::optional<Position> pointer_; // on a pane
  bool is_helping_ = false;
  Replay replay_;
  ViewTime now_ = 0; // of the last picture of the window
  bool snapshot_wanted_ = false;
  PanelLine frames_;

  /* The main thread: */
  Position dragged_; // where the pointer was last, with a button down
  int button_ = 0;
  bool fills_screen_ = false;

  /* The thread that draws: */
  bool has_title_ = false;
  std::vector<std::string> written_; // captions
  Surface captions_, panel_, help_;
  ViewTime painted_ = 0;                   // time of the panel
  const void *painted_subframe_ = nullptr; // only compared
};

/** Shows the pictures of two or three chains of @p job in a window: camera,
 * subframes, perhaps fused. Throws Failure if there is no screen. */
void add_window (Job &job, const std::vector<Chain> &sources,
    const WindowOptions &options, std::optional<int> bits = {},
    std::optional<Played> played = {});

} // namespace codedexposure::app
