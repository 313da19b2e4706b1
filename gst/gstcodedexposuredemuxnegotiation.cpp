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

template <typename Pixel>
std::optional<AnyExtractor>
make_extractor (
    GstCodedExposureDemux *self, const Schedule &schedule, Extent size)
{
  const Stream &stream = state (self).stream;
  ExtractOptions options = stream.settings.extract;
  options.bits = stream.bits_in_force ();
  auto made =
      Extractor<Pixel>::make (schedule, size.width, size.height, options);
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
light_windows (const Schedule &schedule, Method method, const SlotPlan &slots)
{
  std::vector<Window> windows;
  for (int k = 0; k < schedule.slots (); k++) {
    const auto [first, last] = slots_of (schedule.code (), method, k);
    const Nanoseconds start = slots.start (first);
    windows.push_back ({GstClockTime (start),
        GstClockTime (slots.start (last) + slots.active () - start)});
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

PadCaps
output_caps (CodedFormat coded, Extent extracted, const Schedule &schedule)
{
  const CapsPtr with_aspect = resized_caps (coded, extracted);
  PadCaps caps;
  caps.all.reset (
      scale_caps (with_aspect.get (), coded_to_subframes (schedule, true)));
  caps.one.reset (
      scale_caps (with_aspect.get (), coded_to_subframes (schedule, false)));
  caps.coded = std::move (coded.caps);
  return caps;
}

void
say_what_is_cropped (GstCodedExposureDemux *self, const Plan &plan)
{
  const Extent cell = plan.schedule.cell ();
  const int columns = plan.extracted.width - plan.subframe.width * cell.width;
  const int rows = plan.extracted.height - plan.subframe.height * cell.height;
  if (columns > 0 || rows > 0)
    GST_INFO_OBJECT (self,
        "%d columns and %d rows (pilot: %d) of the coded frames are cropped: "
        "they fill no cell of %dx%d pixels",
        columns, rows, plan.schedule.pilot_rows (), cell.width, cell.height);
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
  auto extractor = GST_VIDEO_INFO_FORMAT (&info) == GST_VIDEO_FORMAT_GRAY8
                       ? make_extractor<std::uint8_t> (self, schedule, size)
                       : make_extractor<std::uint16_t> (self, schedule, size);
  if (!extractor)
    return std::nullopt;
  const Method method =
      std::visit ([] (const auto &e) { return e.method (); }, *extractor);

  PadCaps caps = output_caps (std::move (*format), size, schedule);
  GstVideoInfo subframe;
  gst_video_info_from_caps (&subframe, caps.one.get ());
  return Proposal{Plan{schedule, info, subframe, std::move (*extractor), method,
                      rate, slot_boundaries (rate, schedule.slots ()),
                      light_windows (schedule, method, *slots),
                      std::move (rectifier), size},
      std::move (caps), found->assumed};
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
  say_what_is_cropped (self, *stream.plan);
  say_mapping (GST_ELEMENT (self), st.counters, stream.plan->rectifier.get ());

  bool schedule_changed, method_changed;
  {
    const ObjectLock lock (self);
    schedule_changed = !st.in_force || !(*st.in_force == stream.plan->schedule);
    method_changed =
        std::exchange (st.method, stream.plan->method) != stream.plan->method;
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
      std::string (method_name (stream.plan->method)).c_str (),
      std::visit (
          [] (const auto &e) { return e.gain (); }, stream.plan->extractor),
      stream.plan->coded.width, stream.plan->coded.height,
      stream.plan->subframe.width, stream.plan->subframe.height);
  if (schedule_changed)
    notify (self, "schedule-in-force");
  if (method_changed)
    notify (self, "method-in-force");
}

} // namespace

GstCaps *
PadCaps::of (Output::Kind kind) const
{
  switch (kind) {
  case Output::Kind::kCoded:
    return coded.get ();
  case Output::Kind::kOne:
    return one.get ();
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
  const int n = schedule.elements ();
  if (list.ones.empty () || list.ones.rbegin ()->first < n)
    return true;
  refuse (GST_ELEMENT (self),
      "Pad subframe_" + std::to_string (list.ones.rbegin ()->first) +
          " was requested, but " + schedule.text () +
          " has subframe_0 to subframe_" + std::to_string (n - 1) + ".");
  return false;
}

} // namespace cexp::gst::demux
