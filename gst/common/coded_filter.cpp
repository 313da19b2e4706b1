/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* GstCodedFilter: type, properties and state changes.
 *
 * coded_filter_pads.cpp has the source pads, coded_filter_events.cpp handles
 * events and queries, coded_filter_format.cpp finds schedule and mapping,
 * coded_filter_frames.cpp counts and reports frames. */
#include "coded_filter.h"

#include <utility>

GST_DEBUG_CATEGORY (coded_filter_debug);
#define GST_CAT_DEFAULT coded_filter_debug

namespace codedexposure::gst
{

/* ------------------------------------------------------------ properties -- */

PropertyTable<CodedFilter::Shared>
CodedFilter::properties ()
{
  static const auto set = [] (auto member) {
    return within (&Shared::settings, member);
  };
  return {
      {"schedule", "Schedule",
          "Schedule of the coded exposure: a preset such as "
          "\"sequential:2x2\" or \"staircase:2x2,active=9.8ms\", or the path "
          "of a JSON file, or its text; empty: that of the stream's tag, else "
          "sequential:2x2",
          kReadWrite, set (&CodedSettings::schedule)},
      {"require-schedule", "Require a schedule",
          "Refuse coded frames whose schedule is not known, instead of "
          "assuming "
          "sequential:2x2",
          kReadWrite, set (&CodedSettings::require_schedule)},
      {"mapping", "Mapping",
          "File with the mapping from camera pixels to mirrors (moirecalib "
          "writes one), or its text; empty: that of the stream's tags, or none",
          kReadWrite, set (&CodedSettings::mapping)},
      {"bench", "Bench profile",
          "What was measured of the bench, a JSON file or its text "
          "(docs/formats.md): leakage, black level, bits, noise and mapping, "
          "for which other properties and a leak of the schedule win; empty: "
          "that of the stream's tags, or none",
          kReadWrite, set (&CodedSettings::bench)},
      {"bits", "Bits",
          "Significant bits of a pixel, counted from the lowest, for example "
          "12 for a 12-bit camera in GRAY16_LE; pixels at the largest value "
          "are saturated; 0: as the frames, their tag or the bench profile "
          "say, or all "
          "bits of the format",
          kReadWrite, set (&CodedSettings::bits), 0, 16},
      {"frame-rate", "Frame rate",
          "Rate of the coded frames in frames/s, used if their caps have no "
          "framerate or 0/1; 0/1: from the caps only",
          kReadWrite, set (&CodedSettings::rate)},
      {"schedule-in-force", "Schedule in force",
          "The schedule that frames are decoded with: the property's, the "
          "tag's or the default; empty before the first frame; notifies",
          kReadOnly,
          [] (const Shared &shared) {
            return shared.schedule ? shared.schedule->text () : std::string ();
          }},
      {"stats", "Statistics",
          "Snapshot of all counters, kept until the next run starts; notifies "
          "when frames are lost, corrupted, saturated or not coded, and when a "
          "mapping "
          "takes effect",
          kReadOnly, [] (const Shared &shared) { return shared.stats (); }},
  };
}

StructurePtr
CodedFilter::Shared::stats () const
{
  StructurePtr stats (gst_structure_new_empty (names.structure));
  const std::pair<const char *, guint64> numbers[] = {
      {"frames-in", counters.frames_in},
      {names.out, counters.pictures_out},
      {"frames-lost", counters.frames_lost},
      {"frames-corrupted", counters.frames_corrupted},
      {"frames-not-coded", counters.frames_not_coded},
      {names.dropped, counters.pictures_dropped},
      {"saturated-frames", counters.saturated_frames},
      {"mirrors-exact", counters.mirrors.exact},
      {"mirrors-weighted", counters.mirrors.weighted},
      {"mirrors-mixed", counters.mirrors.mixed},
      {"mirrors-unseen", counters.mirrors.unseen},
  };
  for (const auto &[name, number] : numbers)
    if (name)
      gst_structure_set (stats.get (), name, G_TYPE_UINT64, number, nullptr);
  return stats;
}

CodedFilter::Shared &
CodedFilter::shared_of (GObject *object)
{
  return filter_of (object).shared_;
}

void
CodedFilter::settings_changed (GObject *object, const GParamSpec *)
{
  shared_of (object).settings_changed = true;
}

/* ----------------------------------------------------------------- class -- */

void
CodedFilter::set_up_class (gpointer klass)
{
  install_properties<properties, shared_of, settings_changed> (
      G_OBJECT_CLASS (klass));
  static constexpr StateHooks kRun{
      .open =
          [] (GstElement *self) { return filter_of (self).read_settings (); },
      .begin =
          [] (GstElement *self) {
            filter_of (self).begin ();
            return true;
          },
      .halt = [] (GstElement *self) { filter_of (self).cancel (); },
      .end = [] (GstElement *self) { filter_of (self).forget_stream (); }};
  GST_DEBUG_CATEGORY_INIT (coded_filter_debug, "codedexposure-filter", 0,
      "base class of filters of coded frames");
  install_run<kRun> (klass);
  auto *element_class = GST_ELEMENT_CLASS (klass);
  element_class->request_new_pad = [] (GstElement *self, GstPadTemplate *templ,
                                       const gchar *name,
                                       const GstCaps *) noexcept {
    return filter_of (self).request_pad (templ, name);
  };
  element_class->release_pad = [] (GstElement *self, GstPad *pad) noexcept {
    filter_of (self).release_pad (pad);
  };
  add_pad_template (klass, "sink");
  add_pad_template (klass, "src", {.type = coded_pad_type ()});
  add_pad_template (
      klass, "coded", {.presence = GST_PAD_REQUEST, .type = coded_pad_type ()});
  for (const GType type : {G_TYPE_FROM_CLASS (klass), coded_pad_type ()})
    gst_type_mark_as_plugin_api (type, GstPluginAPIFlags (0));
}

GType
coded_filter_type ()
{
  return type_of<GstCodedFilter, CodedFilter::set_up_class> (
      "GstCodedFilter", GST_TYPE_ELEMENT, G_TYPE_FLAG_ABSTRACT);
}

CodedFilter::CodedFilter (GstElement *element, const StatsNames &names)
    : element_ (element),
      sinkpad_ (gst_pad_new_from_template (
          gst_element_get_pad_template (element_, "sink"), "sink"))
{
  state_in<GstCodedFilter> (element) = this;
  shared_.names = names;
  gst_pad_set_chain_function (
      sinkpad_, [] (GstPad *, GstObject *parent, GstBuffer *frame) noexcept {
        return filter_of (parent).chain (BufferPtr (frame));
      });
  gst_pad_set_event_function (
      sinkpad_, [] (GstPad *, GstObject *parent, GstEvent *event) noexcept {
        return filter_of (parent).sink_event (EventPtr (event));
      });
  gst_pad_set_query_function (
      sinkpad_, [] (GstPad *, GstObject *parent, GstQuery *query) noexcept {
        return filter_of (parent).sink_query (query);
      });
  /* Caps without a frame rate are not a subset of the template; a missing rate
   * is reported with the first frame. */
  GST_PAD_SET_ACCEPT_INTERSECT (sinkpad_);
  GST_PAD_SET_ACCEPT_TEMPLATE (sinkpad_);
  gst_element_add_pad (element_, sinkpad_);
  add_pad ("src", PadKind::all, "src", -1);
}

/* ---------------------------------------------------------------- states -- */

/* Files that cannot be read should be reported before anything runs. */
bool
CodedFilter::read_settings ()
{
  const auto check = [this] (const char *property, auto &named) {
    return check_named (element_, property, read_again (element_, named));
  };
  CodedSettings &settings = shared_.settings;
  return check ("schedule", settings.schedule) &&
         check ("mapping", settings.mapping) && check ("bench", settings.bench);
}

/* The counters of a run can be read until the next one begins. */
void
CodedFilter::begin ()
{
  resume ();
  const ObjectLock lock (element_);
  shared_.counters = CodedCounters ();
  reset_counters ();
}

void
CodedFilter::forget_stream ()
{
  SeekBook::forget (this);
  stream_ = Stream ();
  each_pad ([this] (GstCodedPad *pad) {
    pad->state.discont = true;
    pad->state.offset = 0;
    pad->state.allocation.reset ();
    const ObjectLock lock (element_);
    forget_lateness (pad);
  });
  forget ();
  const ObjectLock lock (element_);
  gst_flow_combiner_reset (combiner_.get ());
  caps_ = PadCaps ();
  ended_ = false;
  shared_.settings_changed = true;
  static_cast<InForce &> (shared_) = {};
}

void
CodedFilter::notify (const char *property) const
{
  g_object_notify (G_OBJECT (element_), property);
}

bool
CodedFilter::post_error (const std::string &why) const
{
  POST_ERROR (element_, STREAM, FORMAT, why);
  return false;
}

GstFlowReturn
CodedFilter::post_decode_error (const Error &error) const
{
  if (error.code == ErrorCode::cancelled)
    return GST_FLOW_FLUSHING;
  POST_ERROR (element_, STREAM, DECODE,
      "A coded frame could not be decoded: " + error.message + ".");
  return GST_FLOW_ERROR;
}

} // namespace codedexposure::gst
