/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "window.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <csignal>

#include <glib-unix.h>
#include <gst/video/navigation.h>

#include "common/element.h"
#include "pipeline/messages.h"
#include "window/screen.h"
#include "window/whole_picture.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

constexpr ViewTime kLoop = GST_SECOND;
/* Other panes may be ahead of the subframes, or behind. */
constexpr ViewTime kBeside = kLoop + GST_SECOND / 4;
/* Texts that change faster cannot be read. */
constexpr ViewTime kPanelPeriod = GST_SECOND / 10;
constexpr int kBins = 128;

const char *const kKeys =
    "Space: pause, live    Left, Right: step    L: loop the last second at 1/4 "
    "speed    S: snapshot    Q: end";

constexpr std::size_t kCamera = 0, kSubframes = 1; // panes

/* "camera, 25 fps, 768x576" */
std::string
caption_of (const char *what, const GstVideoInfo &info)
{
  const std::string rate =
      info.fps_n > 0 ? format (", %.6g fps", double (info.fps_n) / info.fps_d)
                     : "";
  return format ("%s%s, %dx%d", what, rate.c_str (), info.width, info.height);
}

/* Running and stream time of @time at @pad; none: it is outside the segment. */
struct Times {
  GstClockTime running = GST_CLOCK_TIME_NONE, stream = GST_CLOCK_TIME_NONE;
};
Times
times_of (GstPad *pad, GstClockTime time)
{
  const EventPtr event (gst_pad_get_sticky_event (pad, GST_EVENT_SEGMENT, 0));
  const GstSegment *segment = nullptr;
  if (!event)
    return {};
  gst_event_parse_segment (event.get (), &segment);
  return {gst_segment_to_running_time (segment, GST_FORMAT_TIME, time),
      gst_segment_to_stream_time (segment, GST_FORMAT_TIME, time)};
}

std::optional<GstVideoInfo>
info_at (GstPad *pad)
{
  const CapsPtr caps (gst_pad_get_current_caps (pad));
  GstVideoInfo info;
  if (!caps || !gst_video_info_from_caps (&info, caps.get ()))
    return std::nullopt;
  return info;
}

/* Of an event with caps. */
std::optional<GstVideoInfo>
info_in (GstPadProbeInfo *probed)
{
  GstEvent *event = gst_pad_probe_info_get_event (probed);
  GstCaps *caps = nullptr;
  GstVideoInfo info;
  if (GST_EVENT_TYPE (event) != GST_EVENT_CAPS)
    return std::nullopt;
  gst_event_parse_caps (event, &caps);
  if (!gst_video_info_from_caps (&info, caps))
    return std::nullopt;
  return info;
}

} // namespace

struct Window::Pane {
  Window *window;
  std::size_t index;
  WindowPane part;

  /* The thread of the pane: */
  std::optional<StatsMeter> meter;
  Extent metered;
  int metered_bits = 0;
  std::shared_ptr<const Exposure> exposure; // of the frame that passes

  /* Of the mutex: */
  Extent size; // of its pictures in the window
  std::string caption;
  Recent<ShownPtr> recent{kLoop};
};

Window::Window (WindowBranch branch, GstPad *coded, Style style)
    : size_ (branch.size), room_ (style.room), delay_ (style.delay),
      name_ (style.name), player_ (std::move (style.player))
{
  if (!player_)
    keeper_.emplace (coded);
  panel_at_ = pad_of (branch.overlay, "sink");
  for (WindowPane &part : branch.panes) {
    auto pane = std::make_unique<Pane> ();
    pane->window = this;
    pane->index = panes_.size ();
    pane->part = std::move (part);
    pane->caption = pane->part.caption;
    if (pane->index != kSubframes)
      pane->recent = Recent<ShownPtr> (kBeside);
    watch (*pane);
    panes_.push_back (std::move (pane));
  }
  wait_for_inputs (branch.compositor);
  gst_pad_add_probe (coded, GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM, on_camera_caps,
      this, nullptr);
  g_signal_connect (branch.overlay, "draw", G_CALLBACK (on_draw), this);
  gst_pad_add_probe (pad_of (branch.overlay, "src").get (),
      GST_PAD_PROBE_TYPE_EVENT_UPSTREAM, on_upstream, branch.overlay, nullptr);
}

Window::~Window ()
{
  if (on_signal_ > 0)
    g_source_remove (on_signal_);
}

/* An experiment tells by a signal that something has happened. */
void
Window::begin (Calls calls)
{
  calls_ = std::move (calls);
  snapshots_.begin (calls_.said);
  if (player_)
    return player_->begin (calls_.pipeline, calls_.said);
  keeper_->begin (calls_.said);
  on_signal_ = g_unix_signal_add (
      SIGUSR1,
      [] (gpointer self) {
        static_cast<Window *> (self)->keep ();
        return gboolean (G_SOURCE_CONTINUE);
      },
      this);
}

void
Window::finish ()
{
  snapshots_.write ();
  if (keeper_)
    keeper_->finish ();
  if (player_)
    player_->finish ();
}

void
Window::watch (Pane &pane)
{
  const WindowPane &part = pane.part;
  gst_pad_add_probe (pad_of (part.entry, "sink").get (),
      GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM, on_arriving_caps, &pane, nullptr);
  gst_pad_add_probe (pad_of (part.entry, "src").get (),
      GstPadProbeType (
          GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_BOTH),
      on_pane_data, &pane, nullptr);
  gst_pad_add_probe (pad_of (part.kept, "src").get (),
      GST_PAD_PROBE_TYPE_BUFFER, on_kept, &pane, nullptr);
}

/* The layout is set before the caps reach the panes. */
GstPadProbeReturn
Window::on_camera_caps (GstPad *, GstPadProbeInfo *info, gpointer self)
{
  if (const auto camera = info_in (info))
    static_cast<Window *> (self)->set_layout (*camera);
  return GST_PAD_PROBE_OK;
}

GstPadProbeReturn
Window::on_arriving_caps (GstPad *, GstPadProbeInfo *info, gpointer data)
{
  const auto &pane = *static_cast<const Pane *> (data);
  if (const auto picture = info_in (info))
    pane.window->set_queues (pane, *picture);
  return GST_PAD_PROBE_OK;
}

/* The pictures of two coded frames, since those of one come at once, and those
 * of the time for which they wait to be shown. */
void
Window::set_queues (const Pane &pane, const GstVideoInfo &picture)
{
  constexpr int kFewest = 4;
  const double rate =
      picture.fps_d > 0 ? double (picture.fps_n) / picture.fps_d : 0;
  double camera = 0;
  {
    const std::lock_guard lock (mutex_);
    if (layout_ && camera_.fps_d > 0)
      camera = double (camera_.fps_n) / camera_.fps_d;
  }
  if (rate <= 0 || camera <= 0)
    return;
  const double waiting = 2 * rate * (1 / camera + 1e-9 * double (delay_));
  const int most = std::max (kFewest, int (std::ceil (waiting - 1e-6)));
  for (GstElement *queue : {pane.part.entry, pane.part.late})
    g_object_set (queue, "max-size-buffers", guint (most), nullptr);
}

void
Window::set_layout (const GstVideoInfo &camera)
{
  const WindowLayout layout = WindowLayout::fit (
      {camera.width, camera.height}, int (panes_.size ()), room_);
  for (const auto &pane : panes_)
    g_object_set (pane->part.mixed.get (), "xpos",
        layout.left (int (pane->index)), "ypos", WindowLayout::kCaption,
        nullptr);
  GstCaps *whole = nullptr;
  g_object_get (size_, "caps", &whole, nullptr);
  const CapsPtr sized (gst_caps_make_writable (whole));
  gst_caps_set_simple (sized.get (), "width", G_TYPE_INT, layout.size ().width,
      "height", G_TYPE_INT, layout.size ().height, nullptr);
  g_object_set (size_, "caps", sized.get (), nullptr);
  const std::lock_guard lock (mutex_);
  layout_ = layout;
  camera_ = camera;
}

GstPadProbeReturn
Window::on_pane_data (GstPad *pad, GstPadProbeInfo *info, gpointer data)
{
  auto &pane = *static_cast<Pane *> (data);
  if (info->type & GST_PAD_PROBE_TYPE_BUFFER) {
    if (pane.index == kCamera)
      pane.window->measure (pane, pad, GST_PAD_PROBE_INFO_BUFFER (info));
    return GST_PAD_PROBE_OK;
  }
  /* New sizes in the window are not for the stream, which would begin anew. */
  if (GST_EVENT_TYPE (gst_pad_probe_info_get_event (info)) ==
      GST_EVENT_RECONFIGURE)
    return GST_PAD_PROBE_DROP;
  if (const auto picture = info_in (info))
    pane.window->set_pane (pane, *picture);
  return GST_PAD_PROBE_OK;
}

/* Large pictures are reduced before they are kept; small ones are enlarged
 * after. */
void
Window::set_pane (Pane &pane, const GstVideoInfo &picture)
{
  Extent size;
  {
    const std::lock_guard lock (mutex_);
    if (!layout_)
      return;
    const auto aspect = [] (const GstVideoInfo &info) {
      return double (info.par_n) / info.par_d;
    };
    size = pane.size = layout_->size_of ({camera_.width, camera_.height},
        {picture.width, picture.height}, aspect (picture) / aspect (camera_));
    pane.caption = caption_of (pane.part.caption, picture);
    captions_changed_ = true;
  }
  const CapsPtr kept (gst_caps_new_simple ("video/x-raw", "width", G_TYPE_INT,
      std::min (size.width, picture.width), "height", G_TYPE_INT,
      std::min (size.height, picture.height), nullptr));
  const CapsPtr shown (gst_caps_new_simple ("video/x-raw", "width", G_TYPE_INT,
      size.width, "height", G_TYPE_INT, size.height, nullptr));
  g_object_set (pane.part.kept, "caps", kept.get (), nullptr);
  g_object_set (pane.part.shown, "caps", shown.get (), nullptr);
  g_object_set (pane.part.mixed.get (), "width", size.width, "height",
      size.height, nullptr);
  gst_util_set_object_arg (G_OBJECT (pane.part.enlarge), "method",
      are_blocks ({picture.width, picture.height}, size) ? "nearest-neighbour"
                                                         : "bilinear");
}

/* Of the pixels as the camera sent them. */
void
Window::measure (Pane &pane, GstPad *pad, GstBuffer *frame)
{
  pane.exposure.reset ();
  const auto info = info_at (pad);
  if (!info)
    return;
  gint bits = 0;
  g_object_get (pane.part.view, "bits", &bits, nullptr);
  if (const auto meta = get_frame_meta (frame); meta && bits == 0)
    bits = meta->bits;
  const int depth = int (GST_VIDEO_INFO_COMP_DEPTH (&*info, 0));
  bits = bits > 0 ? std::min (bits, depth) : depth;
  bits_ = bits;
  MappedFrame mapped (*info, frame, GST_MAP_READ);
  if (!mapped)
    return;
  const Extent size{info->width, info->height};
  if (!pane.meter || !(pane.metered == size) || pane.metered_bits != bits) {
    auto made = StatsMeter::make (size, depth, {.bits = bits, .bins = kBins});
    if (!made)
      return;
    pane.meter = *std::move (made);
    pane.metered = size;
    pane.metered_bits = bits;
  }
  read_pixels (mapped, [&] (auto pixels) {
    const PictureStats &stats = pane.meter->measure (pixels);
    pane.exposure = std::make_shared<Exposure> (Exposure{
        stats.histogram, double (stats.saturated) / double (stats.pixels)});
  });
}

GstPadProbeReturn
Window::on_kept (GstPad *pad, GstPadProbeInfo *info, gpointer data)
{
  auto &pane = *static_cast<Pane *> (data);
  pane.window->remember (pane, pad, GST_PAD_PROBE_INFO_BUFFER (info));
  return GST_PAD_PROBE_OK;
}

/* A paused window keeps its pictures; those that belong to its subframes may
 * come late. Of the mutex. */
bool
Window::is_kept (const Pane &pane, ViewTime time) const
{
  return replay_.is_live () ||
         (pane.index != kSubframes && time <= replay_.last ());
}

void
Window::remember (Pane &pane, GstPad *pad, GstBuffer *picture)
{
  const auto info = info_at (pad);
  const auto [running, stream] = times_of (pad, GST_BUFFER_PTS (picture));
  if (!info || !GST_CLOCK_TIME_IS_VALID (running))
    return;
  {
    const std::lock_guard lock (mutex_);
    if (!is_kept (pane, running))
      return;
  }
  MappedFrame mapped (*info, picture, GST_MAP_READ);
  if (!mapped)
    return;
  const auto pixels = view_of<const guint8> (mapped);
  auto shown = std::make_shared<Shown> ();
  shown->grey = {pixels.width, pixels.height, {}};
  shown->grey.pixels.reserve (
      std::size_t (pixels.width) * std::size_t (pixels.height));
  for (int y = 0; y < pixels.height; y++)
    shown->grey.pixels.insert (shown->grey.pixels.end (), pixels.row (y),
        pixels.row (y) + pixels.width);
  shown->meta = get_frame_meta (picture);
  shown->corrupted = is_corrupted (picture);
  shown->stream_time = stream;
  shown->exposure = pane.exposure;
  const std::lock_guard lock (mutex_);
  if (is_kept (pane, running))
    pane.recent.add (running, std::move (shown));
}

/* Keys are for the window; no element of the stream needs them. They go by the
 * bus, on which sinks post those that come while the stream is flushed. */
GstPadProbeReturn
Window::on_upstream (GstPad *, GstPadProbeInfo *info, gpointer overlay)
{
  GstEvent *event = gst_pad_probe_info_get_event (info);
  if (GST_EVENT_TYPE (event) != GST_EVENT_NAVIGATION)
    return GST_PAD_PROBE_OK;
  gst_element_post_message (GST_ELEMENT (overlay),
      gst_navigation_message_new_event (GST_OBJECT (overlay), event));
  return GST_PAD_PROBE_DROP;
}

bool
Window::take (GstMessage *message)
{
  GstEvent *parsed = nullptr;
  if (gst_navigation_message_get_type (message) !=
          GST_NAVIGATION_MESSAGE_EVENT ||
      !gst_navigation_message_parse_event (message, &parsed))
    return player_ && player_->take (message);
  const EventPtr event (parsed);
  const gchar *key = nullptr;
  if (gst_navigation_event_get_type (parsed) ==
          GST_NAVIGATION_EVENT_KEY_PRESS &&
      gst_navigation_event_parse_key_event (parsed, &key) && key)
    press (key);
  return true;
}

void
Window::press (const std::string &key)
{
  static constexpr struct {
    const char *name;
    Replay::Key key;
  } kKeys[] = {{"space", Replay::Key::kPause}, {"l", Replay::Key::kLoop},
      {"Left", Replay::Key::kBack}, {"Right", Replay::Key::kForward}};
  const auto is = [&key] (const char *name) {
    return g_ascii_strcasecmp (key.c_str (), name) == 0;
  };
  if (is ("q")) {
    calls_.end ();
    return;
  }
  if (is ("plus") || is ("equal") || is ("KP_Add"))
    set_contrast (1);
  if (is ("minus") || is ("KP_Subtract"))
    set_contrast (-1);
  {
    const std::lock_guard lock (mutex_);
    snapshot_wanted_ |= is ("s");
  }
  if (player_) {
    if (!player_->press (key))
      player_->redraw ();
    return;
  }
  if (is ("k"))
    keep ();
  const std::lock_guard lock (mutex_);
  const bool was_live = replay_.is_live ();
  for (const auto &[name, act] : kKeys)
    if (is (name))
      replay_.press (act, now_, panes_[kSubframes]->recent.times ());
  /* What came in the meantime was not kept. */
  if (!was_live && replay_.is_live ())
    for (const auto &pane : panes_)
      pane->recent.clear ();
}

/* Of what comes from now on; the stream itself stays as it is. */
void
Window::set_contrast (int by)
{
  int contrast = 0;
  {
    const std::lock_guard lock (mutex_);
    contrast_ = contrast = std::clamp (contrast_ + by, 0, bits_ - 1);
  }
  const guint white = contrast > 0 ? ((1u << bits_) - 1) >> contrast : 0;
  for (const auto &pane : panes_)
    g_object_set (pane->part.view, "white", white, nullptr);
}

void
Window::keep ()
{
  if (const auto begun = keeper_->keep (name_); !begun)
    calls_.said (begun.error ().message, true);
}

void
Window::on_draw (
    GstElement *, cairo_t *cairo, guint64 time, guint64, gpointer self)
{
  auto *window = static_cast<Window *> (self);
  /* A seek begins another segment, whose times do not count from 0. */
  window->draw (cairo, times_of (window->panel_at_.get (), time).running);
}

/* Whether both are of the same frame, as far as that is known. */
bool
Window::is_pair (const Shown &one, const Shown &other)
{
  return !one.meta || !other.meta || one.meta->frame == other.meta->frame;
}

bool
Window::is_wanted (const Shown &subframe) const
{
  return subframe.meta && GST_CLOCK_TIME_IS_VALID (subframe.stream_time) &&
         player_->is_wanted (Nanoseconds (subframe.stream_time),
             std::max (subframe.meta->subframe, 0));
}

/* The compositor has drawn the present pictures; others are drawn over them. */
void
Window::draw (cairo_t *cairo, ViewTime time)
{
  std::unique_lock lock (mutex_);
  if (!layout_)
    return;
  const WindowLayout layout = *layout_;
  const bool live = replay_.is_live ();
  now_ = time;
  const ViewTime shown_time = live ? time : replay_.time (time);
  std::vector<ShownPtr> shown;
  std::vector<Extent> sizes;
  std::vector<std::string> captions;
  for (const auto &pane : panes_) {
    const ShownPtr *picture = pane->recent.at (shown_time);
    shown.push_back (picture ? *picture : nullptr);
    sizes.push_back (pane->size);
    captions.push_back (pane->caption);
  }
  const Shown *coded = shown[kCamera].get ();
  const Shown *subframe = shown[kSubframes].get ();
  const bool snapshot = snapshot_wanted_ && subframe && coded &&
                        (!live || is_pair (*subframe, *coded)) &&
                        (!player_ || is_wanted (*subframe));
  snapshot_wanted_ &= !snapshot;
  const auto text = lines (subframe, coded, time);
  if (std::exchange (captions_changed_, false))
    captions_.reset ();
  lock.unlock ();

  if (!captions_)
    captions_ = paint_captions (layout, captions);
  const bool other = painted_subframe_ != subframe;
  if (!panel_ || snapshot || (!live && other) || time < painted_ ||
      time >= painted_ + kPanelPeriod) {
    panel_ =
        paint_panel (layout, text, coded ? coded->exposure.get () : nullptr,
            player_ ? Player::short_keys () : kKeys);
    painted_ = time;
    painted_subframe_ = subframe;
  }
  /* What a snapshot names is also what it has: a coded frame that was skipped
   * is not replaced by another one. */
  static const GreyPicture black{1, 1, {0}};
  for (std::size_t k = 0; (!live || snapshot) && k < shown.size (); k++)
    if (shown[k] && subframe)
      paint_picture (cairo, layout.left (int (k)), WindowLayout::kCaption,
          sizes[k], is_pair (*subframe, *shown[k]) ? shown[k]->grey : black);
  paint_strip (cairo, captions_.get (), 0);
  paint_strip (
      cairo, panel_.get (), WindowLayout::kCaption + layout.pane.height);
  if (snapshot)
    take_snapshot (cairo, layout, *subframe);
}

/* Of the mutex. */
std::vector<PanelLine>
Window::lines (const Shown *subframe, const Shown *coded, ViewTime time) const
{
  std::vector<PanelLine> lines;
  if (player_)
    lines.push_back (
        {player_->line (subframe ? Nanoseconds (subframe->stream_time) : 0)});
  else if (replay_.is_live ())
    lines.push_back (
        {contrast_ > 0 ? format ("live, %d times as bright", 1 << contrast_)
                       : "live"});
  else {
    const std::string which = format (
        "subframe %zu of %zu, %.2f s before the last", replay_.shown (time) + 1,
        replay_.size (), 1e-9 * double (replay_.last () - replay_.time (time)));
    lines.push_back (
        {(replay_.mode () == Replay::Mode::kPaused ? "paused: "
                                                   : "loop at 1/4 speed: ") +
            which});
  }
  const Shown *known = subframe && subframe->meta ? subframe : coded;
  if (!known)
    return lines;
  std::string frame = "frame ?";
  if (known->meta)
    frame = format ("frame %" G_GUINT64_FORMAT, known->meta->frame);
  if (known->meta && known->meta->subframe >= 0)
    frame += format (", slot %d", known->meta->subframe);
  if (GST_CLOCK_TIME_IS_VALID (known->stream_time))
    frame += format (", %.3f s", 1e-9 * double (known->stream_time));
  if (known->corrupted)
    frame += ", CORRUPTED";
  lines.push_back ({frame, known->corrupted});
  const auto locked = known->meta ? known->meta->locked : std::nullopt;
  if (!locked)
    lines.push_back ({"synchronisation: unknown"});
  else if (*locked)
    lines.push_back ({"synchronisation: locked"});
  else
    lines.push_back (
        {format ("synchronisation: lost, %+d slots", known->meta->slip), true});
  if (!frames_.text.empty ())
    lines.push_back (frames_);
  return lines;
}

void
Window::tell (const std::string &frames, bool alarm)
{
  const std::lock_guard lock (mutex_);
  frames_ = {frames, alarm};
}

void
Window::take_snapshot (
    cairo_t *cairo, const WindowLayout &layout, const Shown &subframe)
{
  std::string name = name_;
  if (subframe.meta)
    name += format ("-frame%06" G_GUINT64_FORMAT "-slot%d",
        subframe.meta->frame, std::max (subframe.meta->subframe, 0));
  if (GST_CLOCK_TIME_IS_VALID (subframe.stream_time))
    name += format ("-%.3fs", 1e-9 * double (subframe.stream_time));
  snapshots_.take (copy_window (cairo, layout), name);
}

void
add_window (Job &job, const std::vector<Chain> &sources,
    const WindowOptions &options, std::optional<int> bits,
    std::optional<Played> played)
{
  WindowBranch branch = add_window_branch (
      sources, options, bits, played ? played->slots_per_second () : "");
  if (played)
    branch.panes[kSubframes].caption = played->pictures;
  if (!job.options.print)
    need_screen (branch);
  job.has_window = true;
  job.window = std::make_unique<Window> (std::move (branch),
      pad_of (job.counted, "sink").get (),
      Window::Style{find_screen ().room (), job.times.shift_to.value_or (0),
          job.command,
          played ? std::make_unique<Player> (*std::move (played)) : nullptr});
}

} // namespace codedexposure::app
