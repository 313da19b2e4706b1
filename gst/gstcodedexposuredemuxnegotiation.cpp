/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* From caps, schedule and settings to a plan, and to the caps of all pads. */
#include <algorithm>

#include "gstcodedexposuredemuxstate.h"

#define GST_CAT_DEFAULT codedexposure_demux_debug

namespace cexp::gst::demux
{

namespace
{

void
take_settings (GstCodedExposureDemux *self)
{
  DemuxState &st = state (self);
  const ObjectLock lock (self);
  if (!std::exchange (st.settings_changed, false))
    return;
  st.stream.settings = st.settings;
  st.stream.stale = true;
}

/* @region -1: the background. */
template <typename Pixel>
std::optional<AnyExtractor>
make_extractor (GstCodedExposureDemux *self, const Schedule &whole, int region,
    const Rect &rect)
{
  const Schedule &part = region < 0 ? whole : whole.region (region);
  const Stream &stream = state (self).stream;
  ExtractOptions options = stream.settings.extract;
  /* The gain is for a slot of the background; others are longer or shorter. */
  options.gain *= double (part.code ().slots ()) / whole.code ().slots ();
  options.bits = stream.bits_in_force ();
  auto made = Extractor<Pixel>::make (part, rect.width, rect.height, options);
  if (made)
    return AnyExtractor (std::move (*made));
  refuse (GST_ELEMENT (self), made.error ().message);
  return std::nullopt;
}

/* The element that is k-th in the order of open slots; none where two are open
 * for equally long, so that a rank says nothing of the slot. */
std::optional<int>
element_of_rank (const Code &code, int k)
{
  for (int element = 0; element < code.elements (); element++) {
    int shorter = 0, alike = 0;
    for (int other = 0; other < code.elements (); other++) {
      shorter += code.open_slots (other) < code.open_slots (element);
      alike += code.open_slots (other) == code.open_slots (element);
    }
    if (shorter == k && alike == 1)
      return element;
  }
  return std::nullopt;
}

/* First and last slot in which the light of subframe @k fell. */
std::pair<int, int>
slots_of (const Code &code, Method method, int k)
{
  if (method == Method::kDecode ||
      (method == Method::kSelect && code.one_hot ()))
    return {k, k};
  const auto element = method == Method::kRank ? element_of_rank (code, k) : k;
  int first = 0, last = code.slots () - 1;
  while (element && !code.open (*element, first))
    first++;
  while (element && !code.open (*element, last))
    last--;
  return {first, last};
}

std::vector<Window>
light_windows (const Schedule &part, Method method, const SlotPlan &slots)
{
  /* Slots of the exposure for which the part holds each of its masks. */
  const int held = slots.slots () / part.slots ();
  std::vector<Window> windows;
  for (int k = 0; k < part.slots (); k++) {
    const auto [first, last] = slots_of (part.code (), method, k);
    const Nanoseconds start = slots.start (first * held);
    const Nanoseconds end =
        slots.start (last * held + held - 1) + slots.active ();
    windows.push_back ({GstClockTime (start), GstClockTime (end - start)});
  }
  return windows;
}

std::vector<GstClockTime>
slot_boundaries (FrameRate rate, int n)
{
  std::vector<GstClockTime> boundaries;
  for (int k = 0; k <= n; k++)
    boundaries.push_back (GstClockTime (rate.time_of (0, k, n)));
  return boundaries;
}

/* Caps of coded frames as those of the part's subframes. */
CapsPtr
part_caps (const CodedFormat &coded, const Part &part, bool raised_rate)
{
  const CapsPtr cut = resized_caps (coded, {part.rect.width, part.rect.height});
  return CapsPtr (
      scale_caps (cut.get (), coded_to_subframes (part.schedule, raised_rate)));
}

PadCaps
output_caps (CodedFormat coded, const Plan &plan)
{
  PadCaps caps;
  caps.all = part_caps (coded, plan.background (), true);
  caps.one = part_caps (coded, plan.background (), false);
  for (std::size_t i = 1; i < plan.parts.size (); i++)
    caps.regions.push_back (part_caps (coded, plan.parts[i], true));
  caps.coded = std::move (coded.caps);
  return caps;
}

void
say_what_is_cropped (GstCodedExposureDemux *self, const Plan &plan)
{
  const Extent cell = plan.schedule.cell ();
  const GstVideoInfo &subframe = plan.background ().subframe;
  const int columns = plan.extracted.width - subframe.width * cell.width;
  const int rows = plan.extracted.height - subframe.height * cell.height;
  if (columns > 0 || rows > 0)
    GST_INFO_OBJECT (self,
        "%d columns and %d rows (pilot: %d) of the coded frames are cropped: "
        "they fill no cell of %dx%d pixels",
        columns, rows, plan.schedule.pilot_rows (), cell.width, cell.height);
}

/* A recording of such a schedule may meet somebody who does not know it. */
void
say_regions (GstCodedExposureDemux *self, const Schedule &schedule)
{
  if (schedule.regions ().empty ())
    return;
  const std::string text =
      "src and the subframe pads show the background; regions are black "
      "there and have pads of their own: " +
      pads_text (Output::Kind::kRegion, &schedule);
  /* gst-launch shows the second text only. */
  GST_ELEMENT_INFO (
      self, STREAM, FORMAT, ("%s", text.c_str ()), ("%s", text.c_str ()));
}

std::optional<Part>
make_part (GstCodedExposureDemux *self, const CodedFormat &coded,
    const SlotPlan &slots, const Schedule &whole, int region, const Rect &rect)
{
  const bool wide =
      GST_VIDEO_INFO_FORMAT (&coded.info) == GST_VIDEO_FORMAT_GRAY16_LE;
  const Schedule schedule =
      region < 0 ? whole.background () : whole.region (region);
  auto extractor =
      wide ? make_extractor<std::uint16_t> (self, whole, region, rect)
           : make_extractor<std::uint8_t> (self, whole, region, rect);
  if (!extractor)
    return std::nullopt;
  const Method method =
      std::visit ([] (const auto &e) { return e.method (); }, *extractor);
  Part part{region, schedule, rect, {}, std::move (*extractor), method,
      slot_boundaries ({coded.info.fps_n, coded.info.fps_d}, schedule.slots ()),
      light_windows (schedule, method, slots)};
  gst_video_info_from_caps (
      &part.subframe, part_caps (coded, part, false).get ());
  return part;
}

/* The background and the regions of a frame of @size pixels; none, with an
 * error on the bus, where one of them cannot be taken apart. */
std::vector<Part>
make_parts (GstCodedExposureDemux *self, const CodedFormat &coded,
    const SlotPlan &slots, const Schedule &schedule, Extent size)
{
  if (const auto within = schedule.check_size (size.width, size.height);
      !within) {
    refuse (GST_ELEMENT (self), within.error ().message);
    return {};
  }
  std::vector<Part> parts;
  for (int i = -1; i < int (schedule.regions ().size ()); i++) {
    const Rect rect = i < 0 ? Rect{0, 0, size.width, size.height}
                            : schedule.regions ()[std::size_t (i)].rect;
    auto part = make_part (self, coded, slots, schedule, i, rect);
    if (!part)
      return {};
    parts.push_back (std::move (*part));
  }
  return parts;
}

struct Proposal {
  Plan plan;
  PadCaps caps;
  bool assumed;
};

std::optional<Proposal>
propose (GstCodedExposureDemux *self)
{
  GstElement *element = GST_ELEMENT (self);
  Stream &stream = state (self).stream;
  auto format = find_format (element, stream, stream.settings);
  const auto found =
      format ? find_schedule (element, stream, stream.settings) : std::nullopt;
  if (!found)
    return std::nullopt;
  const Schedule &schedule = found->schedule;
  const GstVideoInfo info = format->info;

  const FrameRate rate{info.fps_n, info.fps_d};
  const auto slots =
      SlotPlan::fit (schedule.timing (), schedule.slots (), rate);
  if (!slots) {
    refuse (element, slots.error ().message);
    return std::nullopt;
  }
  std::shared_ptr<const Rectifier> rectifier;
  Extent size{info.width, info.height};
  if (!find_rectifier (
          element, stream, stream.settings, schedule, size, {}, rectifier))
    return std::nullopt;
  if (rectifier)
    size = rectifier->mirrors ();
  auto parts = make_parts (self, *format, *slots, schedule, size);
  if (parts.empty ())
    return std::nullopt;
  Plan plan{
      schedule, info, rate, std::move (parts), std::move (rectifier), size};
  PadCaps caps = output_caps (std::move (*format), plan);
  return Proposal{std::move (plan), std::move (caps), found->assumed};
}

/* Makes @proposal the plan in force. */
void
install (GstCodedExposureDemux *self, Proposal proposal)
{
  DemuxState &st = state (self);
  Stream &stream = st.stream;
  count_at_rate (stream, proposal.plan.rate,
      stream.plan ? std::optional (stream.plan->rate) : std::nullopt);
  stream.plan = std::move (proposal.plan);
  stream.stale = false;
  stream.scratch.clear ();
  const Part &background = stream.plan->background ();
  say_what_is_cropped (self, *stream.plan);
  say_mapping (GST_ELEMENT (self), st.counters, stream.plan->rectifier.get ());

  bool schedule_changed, method_changed;
  {
    const ObjectLock lock (self);
    schedule_changed = !st.in_force || !(*st.in_force == stream.plan->schedule);
    method_changed =
        std::exchange (st.method, background.method) != background.method;
    st.in_force = std::make_shared<const Schedule> (stream.plan->schedule);
    st.assumed = proposal.assumed;
    st.rectifies = stream.plan->rectifier != nullptr;
    st.caps = std::move (proposal.caps);
  }
  outputs (self)->each ([&] (const OutputRef &output) {
    output->allocation.reset ();
    push_caps (self, *output);
  });
  GST_INFO_OBJECT (self, "%s, %s, gain %g: %dx%d to %dx%d",
      stream.plan->schedule.text ().c_str (),
      std::string (method_name (background.method)).c_str (),
      std::visit (
          [] (const auto &e) { return e.gain (); }, background.extractor),
      stream.plan->coded.width, stream.plan->coded.height,
      background.subframe.width, background.subframe.height);
  if (schedule_changed) {
    notify (self, "schedule-in-force");
    say_regions (self, stream.plan->schedule);
  }
  if (method_changed)
    notify (self, "method-in-force");
}

} // namespace

GstCaps *
PadCaps::of (const Output &output) const
{
  switch (output.kind) {
  case Output::Kind::kCoded:
    return coded.get ();
  case Output::Kind::kOne:
    return one.get ();
  case Output::Kind::kRegion:
    return output.index < int (regions.size ())
               ? regions[std::size_t (output.index)].get ()
               : nullptr;
  default:
    return all.get ();
  }
}

GstFlowReturn
negotiate (GstCodedExposureDemux *self, GstBuffer *next)
{
  Stream &stream = state (self).stream;
  take_settings (self);
  take_bits (stream, next);
  if (stream.stale) {
    auto proposal = propose (self);
    if (!proposal)
      return GST_FLOW_NOT_NEGOTIATED;
    install (self, std::move (*proposal));
  }
  settle_events (self);
  return GST_FLOW_OK;
}

bool
check_pads (GstCodedExposureDemux *self, const Outputs &list)
{
  const Schedule &schedule = state (self).stream.plan->schedule;
  for (const auto *pads : {&list.ones, &list.regions}) {
    if (pads->empty ())
      continue;
    const OutputRef &last = pads->rbegin ()->second;
    if (last->index < numbered_pads (last->kind, &schedule))
      continue;
    const CharPtr name (gst_pad_get_name (last->pad.get ()));
    refuse (GST_ELEMENT (self), "Pad " + std::string (name.get ()) +
                                    " was requested, but " +
                                    pads_text (last->kind, &schedule));
    return false;
  }
  return true;
}

} // namespace cexp::gst::demux
