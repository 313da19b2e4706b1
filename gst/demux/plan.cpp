/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Properties; the plan and the caps of all pads, which follow from them and the
 * format; which numbered pads there can be. */
#include "demux.h"

#include <utility>

#include "common/element.h"

GST_DEBUG_CATEGORY_EXTERN (codedexposure_demux_debug);
#define GST_CAT_DEFAULT codedexposure_demux_debug

namespace codedexposure::gst::demux
{

G_DEFINE_ENUM_TYPE (GstCodedExposureMethod, gst_coded_exposure_method,
    {int (Method::kAuto),
        "select for one-hot codes without off-state leakage, decode for other "
        "invertible codes, else rank",
        "auto"},
    {int (Method::kRank), "subframe k is the k-th smallest pixel of each group",
        "rank"},
    {int (Method::kSelect), "subframe k is the element that is on in slot k",
        "select"},
    {int (Method::kDecode), "solves the code for the light of each slot",
        "decode"});

PropertyTable<Settings>
Demux::properties ()
{
  static const auto set = [] (auto member) {
    return within (&Settings::extract, member);
  };
  static const GType method = gst_coded_exposure_method_get_type ();
  return {
      {"method", "Method", "How subframes are found in a coded frame",
          kReadWrite, set (&ExtractOptions::method), method},
      {"gain", "Gain",
          "Gain of method decode; 0: automatic, white in a slot maps to the "
          "largest value",
          kReadWrite, set (&ExtractOptions::gain), 0.0,
          ExtractOptions::kMaxGain},
      {"interpolate", "Interpolate",
          "Interpolate the elements to the centre of their cell before "
          "decoding (method decode on raster tiles)",
          kReadWrite, set (&ExtractOptions::interpolate)},
      {"qos", "QoS",
          "Drop subframes that would reach their sink too late, and post a QoS "
          "message for each; if false, none is dropped",
          kReadWrite, &Settings::qos},
      {"method-in-force", "Method in force",
          "The method that splits frames; auto before the first frame; "
          "notifies",
          kReadOnly, &Settings::method_in_force, method},
  };
}

std::string
Demux::method_name () const
{
  auto *methods =
      G_ENUM_CLASS (g_type_class_peek (gst_coded_exposure_method_get_type ()));
  return g_enum_get_value (methods, int (plan_->background ().method ()))
      ->value_nick;
}

Settings &
Demux::settings_of (GObject *object)
{
  return static_cast<Demux &> (filter_of (object)).settings_;
}

namespace
{

/* How many numbered pads of @kind @schedule allows; null: any schedule. */
int
numbered_pads (PadKind kind, const Schedule *schedule)
{
  if (kind == PadKind::region)
    return schedule ? int (schedule->regions ().size ())
                    : Schedule::kMaxRegions;
  return schedule ? schedule->elements () : Tile::kMaxElements;
}

/* The names of the numbered pads that @schedule allows, in a sentence. */
std::string
pads_text (PadKind kind, const Schedule *schedule)
{
  const int n = numbered_pads (kind, schedule);
  const std::string prefix = prefix_of (kind);
  const std::string owner =
      schedule ? schedule->text () : "the largest schedule";
  if (n == 0)
    return owner + " has no regions.";
  return owner + " has " + prefix + "0" +
         (n > 1 ? " to " + prefix + std::to_string (n - 1) : "") + ".";
}

CapsPtr
part_caps (const CodedFormat &format, const SplitPart &part, bool raised_rate)
{
  const CapsPtr cut = format.resized ({part.rect.width, part.rect.height});
  return CapsPtr (
      scale_caps (cut.get (), coded_to_subframes (part.schedule, raised_rate)));
}

/* Converts @caps of the pad of region @i to those of coded frames, or back. The
 * size of a region does not follow from that of the frames. */
CapsPtr
convert_region (const Schedule &schedule, int i, GstCaps *caps, bool to_coded)
{
  if (i >= int (schedule.regions ().size ()))
    return unbind_caps (caps);
  const CapsScale scale = coded_to_subframes (schedule.region (i), true);
  if (to_coded) {
    const CapsPtr scaled (scale_caps (caps, scale.inverse ()));
    return without_fields (scaled.get (), {"width", "height"});
  }
  const Rect &rect = schedule.regions ()[std::size_t (i)].rect;
  const CapsPtr cut (gst_caps_copy (caps));
  gst_caps_set_simple (cut.get (), "width", G_TYPE_INT, rect.width, "height",
      G_TYPE_INT, rect.height, nullptr);
  return CapsPtr (scale_caps (cut.get (), scale));
}

void
log_plan (GstElement *element, const CodedFormat &format, const Plan &plan)
{
  const SplitPart &background = plan.background ();
  const GstVideoInfo &subframe = plan.infos.front ();
  GST_INFO_OBJECT (element, "%s, gain %g: subframes of %dx%d",
      std::string (method_name (background.method ())).c_str (),
      background.gain (), subframe.width, subframe.height);
  const Extent cell = format.schedule.cell ();
  const int columns = format.size.width - subframe.width * cell.width;
  const int rows = format.size.height - subframe.height * cell.height;
  if (columns > 0 || rows > 0)
    GST_INFO_OBJECT (element,
        "%d columns and %d rows (pilot: %d) of the coded frames are cropped: "
        "they fill no cell of %dx%d pixels",
        columns, rows, format.schedule.pilot_rows (), cell.width, cell.height);
}

/* Users of a recording may not know that its schedule has regions. */
void
report_regions (GstElement *element, const Schedule &schedule)
{
  if (schedule.regions ().empty ())
    return;
  POST_INFO (element, STREAM, FORMAT,
      "src and the subframe pads show the background; regions are black "
      "there and have pads of their own: " +
          pads_text (PadKind::region, &schedule));
}

} // namespace

bool
Demux::plan (const CodedFormat &format, PadCaps &caps)
{
  ExtractOptions options = in_force_.extract;
  options.bits = significant_bits ();
  auto parts = make_split_plan (format.schedule,
      {format.size, format.wide (), format.rate, format.slots}, options);
  if (!parts)
    return post_error (parts.error ().message);
  Plan made{std::move (*parts), {}, {}};
  for (const SplitPart &part : made.parts) {
    CapsPtr one = part_caps (format, part, false);
    gst_video_info_from_caps (&made.infos.emplace_back (), one.get ());
    CapsPtr all = part_caps (format, part, true);
    const bool is_region = part.region >= 0;
    caps.of (is_region ? PadKind::region : PadKind::all, part.region) =
        std::move (all);
    if (!is_region)
      caps.of (PadKind::one) = std::move (one);
  }
  for (const bool backwards : {false, true})
    made.turns[backwards] = order_subframes (made.parts, backwards);
  log_plan (element (), format, made);
  plan_ = std::move (made);
  scratch_.clear ();
  return true;
}

void
Demux::planned (bool schedule_changed)
{
  if (schedule_changed)
    report_regions (element (), format ().schedule);
  const Method method = plan_->background ().method ();
  if (locked (element (), [&] {
        return std::exchange (settings_.method_in_force, method) != method;
      }))
    notify ("method-in-force");
}

void
Demux::forget ()
{
  plan_.reset ();
  live_.reset ();
  scratch_.clear ();
  const ObjectLock lock (element ());
  settings_.method_in_force = Method::kAuto;
}

CapsScale
Demux::scale_for (const Schedule &schedule, const GstCodedPad *pad) const
{
  return coded_to_subframes (schedule, pad->state.kind == PadKind::all);
}

CapsPtr
Demux::convert_caps (const CapsContext &context, const GstCodedPad *pad,
    GstCaps *caps, bool to_coded) const
{
  if (pad->state.kind == PadKind::region && context.schedule)
    return convert_region (*context.schedule, pad->state.index, caps, to_coded);
  return CodedFilter::convert_caps (context, pad, caps, to_coded);
}

int
Demux::pictures_a_frame (const GstCodedPad *pad) const
{
  const ScheduleRef schedule = shared_.schedule;
  const auto &[kind, index] = std::tie (pad->state.kind, pad->state.index);
  if (kind == PadKind::all)
    return schedule->elements ();
  return kind == PadKind::region && index < int (schedule->regions ().size ())
             ? schedule->region (index).elements ()
             : 1;
}

/* --------------------------------------------------------- numbered pads -- */

/* Before a schedule is in force, any number that a schedule can have is
 * allowed; check_pads () checks again. */
bool
Demux::allows_pad (PadKind kind, int index) const
{
  const ScheduleRef schedule =
      locked (element (), [&] { return shared_.schedule; });
  if (index >= 0 && index < numbered_pads (kind, schedule.get ()))
    return true;
  POST_WARNING (element (), STREAM, WRONG_TYPE,
      "There is no pad " + (prefix_of (kind) + std::to_string (index)) + ": " +
          pads_text (kind, schedule.get ()));
  return false;
}

/* Whether the schedule has a subframe or a region for each of @pads. */
bool
Demux::check_pads (const PadMap &pads) const
{
  const Schedule &schedule = format ().schedule;
  for (const PadKind kind : {PadKind::one, PadKind::region}) {
    const auto beyond =
        pads.lower_bound ({kind, numbered_pads (kind, &schedule)});
    if (beyond == pads.end () || beyond->first.first != kind)
      continue;
    return post_error (
        "Pad " + (prefix_of (kind) + std::to_string (beyond->first.second)) +
        " was requested, but " + pads_text (kind, &schedule));
  }
  return true;
}

/* Subframe k alone is pushed at the time of its slot, and so is what replaces
 * it. */
EventPtr
Demux::gap_for (const GstCodedPad *pad, GstEvent *gap) const
{
  const auto k = std::size_t (pad->state.index);
  if (pad->state.kind != PadKind::one || !plan_ ||
      k >= plan_->background ().boundaries.size ())
    return EventPtr (gst_event_ref (gap));
  GstClockTime pts, duration;
  gst_event_parse_gap (gap, &pts, &duration);
  return gap_like (
      gap, pts + GstClockTime (plan_->background ().boundaries[k]), duration);
}

} // namespace codedexposure::gst::demux
