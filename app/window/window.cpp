/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "window.h"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <utility>

#include <glib-unix.h>

#include "common/element.h"
#include "common/kept_frame.h"
#include "common/meta.h"
#include "pipeline/messages.h"
#include "pipeline/pads.h"
#include "window/pane.h"
#include "window/screen.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

/* Other panes may be ahead of the subframes, or behind. */
constexpr ViewTime kBeside = kLoop + GST_SECOND / 4;
constexpr int kBins = 128;

/* Of a pane; a camera of 12 Mpixel sends 300 MB a second. */
constexpr std::size_t kMostBytes = std::size_t (256) << 20;

/* "camera, 25 fps, 768x576" */
std::string
caption_of_stream (const char *what, const GstVideoInfo &info)
{
  const std::string rate =
      info.fps_n > 0 ? format (", %.6g fps", double (info.fps_n) / info.fps_d)
                     : "";
  return format ("%s%s, %dx%d", what, rate.c_str (), info.width, info.height);
}

/* Of an event with caps. */
std::optional<GstVideoInfo>
info_in (GstPadProbeInfo *probed)
{
  GstEvent *event = gst_pad_probe_info_get_event (probed);
  GstVideoInfo info;
  if (GST_EVENT_TYPE (event) != GST_EVENT_CAPS ||
      !gst_video_info_from_caps (&info, caps_of (event)))
    return std::nullopt;
  return info;
}

} // namespace

Window::Window (
    const Job &job, WindowBranch branch, std::unique_ptr<Player> player)
    : size_ (branch.size), job_ (job), player_ (std::move (player)),
      room_ (find_screen ().room ())
{
  panel_at_ = pad_of (branch.overlay, "sink");
  for (WindowPane &part : branch.panes) {
    auto pane = std::make_unique<Pane> ();
    pane->index = panes_.size ();
    pane->part = std::move (part);
    pane->caption = pane->part.caption;
    if (pane->index != kSubframes)
      pane->recent = Recent<ShownPtr> (kBeside);
    watch (*pane);
    panes_.push_back (std::move (pane));
  }
  /* The layout is set before the caps reach the panes. */
  add_probe (pad_of (job.counted, "sink").get (),
      GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM,
      [this] (GstPad *, GstPadProbeInfo *info) {
        if (const auto camera = info_in (info))
          set_layout (*camera);
        return GST_PAD_PROBE_OK;
      });
  g_signal_connect (branch.overlay, "draw", G_CALLBACK (on_draw), this);
  watch_keys (branch.overlay);
}

Window::~Window ()
{
  watch_screen (nullptr);
  if (on_signal_ > 0)
    g_source_remove (on_signal_);
}

/* An experiment tells by a signal that something has happened. */
void
Window::begin (Calls calls)
{
  calls_ = std::move (calls);
  snapshots_.begin (
      [this] (const auto &files) { calls_.wrote (files, ""); }, calls_.failed);
  watch_screen ([this] {
    calls_.failed ("the connection to the screen is lost; check the X server, "
                   "and the network to it, and start again");
    calls_.end ();
  });
  if (player_)
    return player_->begin (calls_.pipeline, calls_.failed);
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
  /* An element that ends says what it has kept. */
  if (job_.keeper)
    while (const MessagePtr message = next_message (
               calls_.pipeline, GST_MESSAGE_ELEMENT | GST_MESSAGE_WARNING))
      take_kept (message.get ());
  snapshots_.write ();
  /* No picture is drawn any more. */
  if (snapshot_wanted_)
    calls_.failed ("no snapshot was written: the window closed before its next "
                   "picture; press S, and Q when the file is named");
  if (player_)
    player_->finish ();
}

void
Window::watch (Pane &pane)
{
  add_probe (pad_of (pane.part.entry, "sink").get (),
      GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM,
      [this, &pane] (GstPad *, GstPadProbeInfo *info) {
        if (const auto picture = info_in (info))
          set_queues (pane, *picture);
        return GST_PAD_PROBE_OK;
      });
  add_probe (pad_of (pane.part.entry, "src").get (),
      GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_BOTH,
      [this, &pane] (GstPad *pad, GstPadProbeInfo *info) {
        return take_data (pane, pad, info);
      });
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
  const double waiting =
      2 * rate *
      (1 / camera + 1e-9 * double (job_.times.shift_to.value_or (0)));
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
Window::take_data (Pane &pane, GstPad *pad, GstPadProbeInfo *info)
{
  if (info->type & GST_PAD_PROBE_TYPE_BUFFER) {
    remember (pane, pad, GST_PAD_PROBE_INFO_BUFFER (info));
    return GST_PAD_PROBE_OK;
  }
  /* New sizes in the window are not for the stream, which would begin anew. */
  if (GST_EVENT_TYPE (gst_pad_probe_info_get_event (info)) ==
      GST_EVENT_RECONFIGURE)
    return GST_PAD_PROBE_DROP;
  if (const auto picture = info_in (info))
    set_pane (pane, *picture);
  return GST_PAD_PROBE_OK;
}

void
Window::set_pane (Pane &pane, const GstVideoInfo &picture)
{
  const Extent whole{picture.width, picture.height};
  Extent size;
  {
    const std::lock_guard lock (mutex_);
    if (!layout_)
      return;
    const auto aspect = [] (const GstVideoInfo &info) {
      return double (info.par_n) / info.par_d;
    };
    size = pane.size = layout_->size_of ({camera_.width, camera_.height}, whole,
        aspect (picture) / aspect (camera_));
    pane.caption = caption_of_stream (pane.part.caption, picture);
  }
  const CapsPtr shown (gst_caps_new_simple ("video/x-raw", "width", G_TYPE_INT,
      size.width, "height", G_TYPE_INT, size.height, nullptr));
  g_object_set (pane.part.shown, "caps", shown.get (), nullptr);
  g_object_set (pane.part.mixed.get (), "width", size.width, "height",
      size.height, nullptr);
  gst_util_set_object_arg (G_OBJECT (pane.part.scale), "method",
      are_blocks (whole, size)   ? "nearest-neighbour"
      : size.width < whole.width ? "bilinear2"
                                 : "bilinear");
}

/* How the camera's pixels are exposed. */
void
Window::measure (Pane &pane, const FullPicture &frame)
{
  const int depth = int (GST_VIDEO_INFO_COMP_DEPTH (&frame.info, 0));
  if (!pane.meter || !(pane.metered == frame.size ()) ||
      pane.metered_bits != frame.bits) {
    auto made = StatsMeter::make (
        frame.size (), depth, {.bits = frame.bits, .bins = kBins});
    if (!made)
      return;
    pane.meter = *std::move (made);
    pane.metered = frame.size ();
    pane.metered_bits = frame.bits;
  }
  MappedFrame mapped (frame.info, frame.frame.get (), GST_MAP_READ);
  if (!mapped)
    return;
  read_pixels (mapped, [&] (auto pixels) {
    const PictureStats &stats = pane.meter->measure (pixels);
    pane.exposure = std::make_shared<Exposure> (Exposure{
        stats.histogram, double (stats.saturated) / double (stats.pixels)});
  });
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
Window::remember (Pane &pane, GstPad *pad, GstBuffer *frame)
{
  const auto info = video_at (pad);
  const auto [running, stream] = view_times_of (pad, GST_BUFFER_PTS (frame));
  if (!info || !GST_CLOCK_TIME_IS_VALID (running))
    return;
  auto shown = std::make_shared<Shown> ();
  shown->frame = kept_frame (frame);
  shown->info = *info;
  shown->meta = get_frame_meta (frame);
  shown->corrupted = is_corrupted (frame);
  shown->stream_time = stream;
  gint bits = 0;
  g_object_get (pane.part.view, "bits", &bits, nullptr);
  shown->bits = bits_of (frame, *info, bits);
  if (pane.index == kCamera) {
    bits_ = shown->bits;
    pane.exposure.reset ();
    measure (pane, *shown);
    shown->exposure = pane.exposure;
  }
  const std::size_t most =
      kMostBytes / std::max<std::size_t> (1, gst_buffer_get_size (frame));
  const std::lock_guard lock (mutex_);
  if (is_kept (pane, running))
    pane.recent.add (running, std::move (shown), most);
}

void
Window::tell (const std::string &frames, bool alarm)
{
  const std::lock_guard lock (mutex_);
  frames_ = {frames, alarm};
}

void
add_window (Job &job, const std::vector<Chain> &sources,
    const WindowOptions &options, std::optional<int> bits,
    std::optional<Played> played)
{
  WindowBranch branch = add_window_branch (
      sources, options, bits, played ? played->slots_per_second () : "");
  if (options.last)
    branch.panes.back ().caption = options.last;
  if (played)
    branch.panes[kSubframes].caption = played->pictures;
  if (!job.options.print)
    need_screen (branch);
  job.window = std::make_unique<Window> (job, std::move (branch),
      played ? std::make_unique<Player> (*std::move (played)) : nullptr);
}

} // namespace codedexposure::app
