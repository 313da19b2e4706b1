/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the window shows. */
#include <utility>

#include "base/pixels.h"
#include "common/element.h"
#include "pipeline/messages.h"
#include "pipeline/pads.h"
#include "window/pane.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

/* Texts that change faster cannot be read. */
constexpr ViewTime kPanelPeriod = GST_SECOND / 10;

const char *const kKeys = "Space: pause, live    Left, Right: step    L: loop "
                          "the last second    S: snapshot    H: all keys";

} // namespace

/** What is drawn at a time; the pictures of the panes, and where. */
struct Window::Scene {
  WindowLayout layout;
  bool live = true, snapshot = false, helps = false;
  Look look;
  std::vector<ShownPtr> shown;
  std::vector<DetailPlace> places;
  std::vector<std::string> captions;
  std::vector<PanelLine> text;
};

ViewTimes
view_times_of (GstPad *pad, GstClockTime time)
{
  const auto segment = segment_at (pad);
  if (!segment)
    return {};
  return {gst_segment_to_running_time (&*segment, GST_FORMAT_TIME, time),
      gst_segment_to_stream_time (&*segment, GST_FORMAT_TIME, time)};
}

void
Window::on_draw (
    GstElement *overlay, cairo_t *cairo, guint64 time, guint64, gpointer self)
{
  auto *window = static_cast<Window *> (self);
  const Job &job = window->job_;
  /* Sinks for a screen show it as the title of their window. */
  if (!std::exchange (window->has_title_, true))
    gst_pad_push_event (pad_of (overlay, "src").get (),
        gst_event_new_tag (gst_tag_list_new (GST_TAG_TITLE,
            (job.command + ": " + job.source).c_str (), nullptr)));
  /* A seek begins another segment, whose times do not count from 0. */
  window->draw (cairo, view_times_of (window->panel_at_.get (), time).running);
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

/* Of the mutex, as what follows. */
std::vector<Window::ShownPtr>
Window::shown_at (ViewTime time) const
{
  const ViewTime of = replay_.is_live () ? time : replay_.time (time);
  std::vector<ShownPtr> shown;
  for (const auto &pane : panes_) {
    const ShownPtr *picture = pane->recent.at (of);
    shown.push_back (picture ? *picture : nullptr);
  }
  return shown;
}

DetailPlace
Window::place_of (const Pane &pane) const
{
  return {{layout_->left (int (pane.index)), WindowLayout::kCaption},
      layout_->pane, pane.size};
}

/* With the pixel at the pointer, or the one beside it in another pane. */
std::string
Window::caption_of (const Pane &pane, const Shown *shown) const
{
  const auto pixel = shown && pointer_ ? place_of (pane).pixel (
                                             look_, *pointer_, shown->size ())
                                       : std::nullopt;
  const auto value =
      pixel ? app::value_of (*shown, *pixel) : std::optional<int> ();
  if (!value)
    return pane.caption;
  return format ("%s, x %d, y %d: %d of %d", pane.part.caption, pixel->x,
      pixel->y, *value, shown->largest ());
}

Window::Scene
Window::scene_at (ViewTime time)
{
  Scene scene{*layout_, replay_.is_live (), false, is_helping_, look_,
      shown_at (time), {}, {}, {}};
  for (std::size_t k = 0; k < panes_.size (); k++) {
    scene.places.push_back (place_of (*panes_[k]));
    scene.captions.push_back (caption_of (*panes_[k], scene.shown[k].get ()));
  }
  const Shown *coded = scene.shown[kCamera].get ();
  const Shown *subframe = scene.shown[kSubframes].get ();
  scene.snapshot = snapshot_wanted_ && subframe && coded &&
                   (!scene.live || is_pair (*subframe, *coded)) &&
                   (!player_ || is_wanted (*subframe));
  snapshot_wanted_ &= !scene.snapshot;
  scene.text = lines (subframe, coded, time);
  return scene;
}

/* The compositor has drawn the present pictures as they are; others are drawn
 * over them. */
void
Window::draw (cairo_t *cairo, ViewTime time)
{
  std::unique_lock lock (mutex_);
  if (!layout_)
    return;
  now_ = time;
  const Scene scene = scene_at (time);
  lock.unlock ();

  /* What a snapshot names is also what it has: a coded frame that was skipped
   * is not replaced by another one. */
  const Shown *subframe = scene.shown[kSubframes].get ();
  const bool paints = !scene.live || scene.snapshot || !scene.look.is_plain ();
  for (std::size_t k = 0; paints && subframe && k < panes_.size (); k++) {
    const ShownPtr &shown = scene.shown[k];
    const bool belongs = shown && ((scene.live && !scene.snapshot) ||
                                      is_pair (*subframe, *shown));
    panes_[k]->detail.paint (
        cairo, belongs ? shown : nullptr, scene.places[k], scene.look);
  }
  draw_texts (cairo, scene, time);
  if (scene.snapshot)
    take_snapshot (cairo, scene);
  if (scene.helps) {
    if (!help_)
      help_ = paint_sheet (
          player_ ? Player::keys_of () : WindowOptions::keys_of (job_.command),
          {scene.layout.size ().width, scene.layout.pane.height});
    paint_over (cairo, help_.get ());
  }
}

void
Window::draw_texts (cairo_t *cairo, const Scene &scene, ViewTime time)
{
  const Shown *coded = scene.shown[kCamera].get ();
  const Shown *subframe = scene.shown[kSubframes].get ();
  const bool other = painted_subframe_ != subframe;
  /* No picture follows that would be drawn later. */
  const bool stays =
      player_ &&
      (player_->is_paused () ||
          (subframe && player_->is_last (Nanoseconds (subframe->stream_time))));
  if (!panel_ || scene.snapshot || (!scene.live && other) || stays ||
      time < painted_ || time >= painted_ + kPanelPeriod) {
    panel_ = paint_panel (scene.layout, scene.text,
        coded ? coded->exposure.get () : nullptr,
        player_ ? Player::short_keys () : kKeys);
    if (!captions_ || written_ != scene.captions)
      captions_ = paint_captions (scene.layout, scene.captions);
    written_ = scene.captions;
    painted_ = time;
    painted_subframe_ = subframe;
  }
  paint_strip (cairo, captions_.get (), 0);
  paint_strip (
      cairo, panel_.get (), WindowLayout::kCaption + scene.layout.pane.height);
}

/* ", zoom 4, black 12, white 600 of 4095" */
std::string
Window::view_text () const
{
  const int largest = largest_pixel (bits_);
  const Tones tones = look_.tones (largest);
  std::string text;
  if (look_.zoom () > 1)
    text += format (", zoom %d", look_.zoom ());
  if (!look_.has_all_tones ())
    text += format (
        ", black %d, white %d of %d", tones.black, tones.white, largest);
  return text + (look_.marks () ? ", saturated pixels red" : "");
}

std::vector<PanelLine>
Window::lines (const Shown *subframe, const Shown *coded, ViewTime time) const
{
  std::vector<PanelLine> lines;
  if (player_)
    lines.push_back (
        {player_->line (subframe ? Nanoseconds (subframe->stream_time) : 0)});
  else if (replay_.is_live ())
    lines.push_back ({"live"});
  else {
    const std::string which = format (
        "subframe %zu of %zu, %.2f s before the last", replay_.shown (time) + 1,
        replay_.size (), 1e-9 * double (replay_.last () - replay_.time (time)));
    lines.push_back (
        {(replay_.mode () == Replay::Mode::kPaused ? "paused: "
                                                   : "loop at 1/4 speed: ") +
            which});
  }
  lines.back ().text += view_text ();
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
Window::take_snapshot (cairo_t *cairo, const Scene &scene)
{
  const Shown &subframe = *scene.shown[kSubframes];
  std::string name = job_.command;
  if (subframe.meta)
    name += format ("-frame%06" G_GUINT64_FORMAT "-slot%d",
        subframe.meta->frame, std::max (subframe.meta->subframe, 0));
  if (GST_CLOCK_TIME_IS_VALID (subframe.stream_time))
    name += format ("-%.3fs", 1e-9 * double (subframe.stream_time));
  Snapshot snapshot{copy_window (cairo, scene.layout), name, {}};
  for (std::size_t k = 0; k < panes_.size (); k++)
    if (const ShownPtr &shown = scene.shown[k];
        shown && is_pair (subframe, *shown))
      snapshot.pictures.emplace_back (panes_[k]->part.caption, shown);
  snapshots_.take (std::move (snapshot));
}

} // namespace codedexposure::app
