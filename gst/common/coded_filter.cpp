/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* GObject type, properties and states of what consumes coded frames.
 *
 * coded_filter_events.cpp takes its events and queries, coded_filter_format.cpp
 * finds what frames are decoded with, coded_filter_frames.cpp admits them. */
#include "coded_filter.h"

#include <utility>

#include "properties.h"

GST_DEBUG_CATEGORY (coded_filter_debug);
#define GST_CAT_DEFAULT coded_filter_debug

using codedexposure::gst::CodedFilter;

struct GstCodedFilterPrivate {
  CodedFilter *filter;
};

G_DEFINE_ABSTRACT_TYPE_WITH_CODE (
    GstCodedFilter, gst_coded_filter, GST_TYPE_ELEMENT,
    G_ADD_PRIVATE (GstCodedFilter);
    GST_DEBUG_CATEGORY_INIT (coded_filter_debug, "codedexposure-filter", 0,
        "what consumers of coded frames share"))

namespace codedexposure::gst
{

void
adopt_filter (GstCodedFilter *element, std::unique_ptr<CodedFilter> filter)
{
  static_cast<GstCodedFilterPrivate *> (
      gst_coded_filter_get_instance_private (element))
      ->filter = filter.release ();
}

CodedFilter &
filter_of (gpointer element)
{
  return *static_cast<GstCodedFilterPrivate *> (
      gst_coded_filter_get_instance_private (GST_CODED_FILTER (element)))
              ->filter;
}

namespace
{

enum {
  PROP_0,
  PROP_SCHEDULE,
  PROP_MAPPING,
  PROP_BITS,
  PROP_FRAME_RATE,
  PROP_SCHEDULE_IN_FORCE,
  PROP_STATS,
};

GstStaticPadTemplate sink_template = GST_STATIC_PAD_TEMPLATE ("sink",
    GST_PAD_SINK, GST_PAD_ALWAYS, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));
GstStaticPadTemplate src_template = GST_STATIC_PAD_TEMPLATE ("src", GST_PAD_SRC,
    GST_PAD_ALWAYS, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));

void
install_properties (GObjectClass *klass)
{
  /**
   * GstCodedFilter:schedule:
   *
   * Tile, code and timing of the exposure. Applied at the next frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_SCHEDULE,
      g_param_spec_string ("schedule", "Schedule",
          "Schedule of the coded exposure: a preset such as "
          "\"sequential:2x2\" or \"staircase:2x2,active=9.8ms\", or the path "
          "of a JSON file; empty: what the stream's tag says, else "
          "sequential:2x2",
          "", kReadWrite));
  /**
   * GstCodedFilter:mapping:
   *
   * A file with the mapping from camera pixels to mirrors, as moirecalib writes
   * it. It wins over the stream's tag. Each frame is first rectified to one
   * pixel a mirror, so that sizes follow from the mirrors. Empty: the mapping
   * of the tag, or none. Applied at the next frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_MAPPING,
      g_param_spec_string ("mapping", "Mapping",
          "File with the mapping from camera pixels to mirrors (moirecalib "
          "writes one); empty: that of the stream's tags, or none",
          "", kReadWrite));
  /**
   * GstCodedFilter:bits:
   *
   * Significant bits, for pixels that fill only a part of GRAY16_LE.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_BITS,
      g_param_spec_int ("bits", "Bits",
          "Significant bits of a pixel, counted from the lowest, for example "
          "12 for a 12-bit camera in GRAY16_LE; they decide what is "
          "saturated; 0: all bits of the format",
          0, 16, 0, kReadWrite));
  /**
   * GstCodedFilter:frame-rate:
   *
   * Rate of the coded frames, where their caps have none.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_FRAME_RATE,
      gst_param_spec_fraction ("frame-rate", "Frame rate",
          "Rate of the coded frames in 1/s, used where their caps have no "
          "framerate or 0/1; 0/1: only from the caps",
          0, 1, G_MAXINT, 1, 0, 1, kReadWrite));
  /**
   * GstCodedFilter:schedule-in-force:
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_SCHEDULE_IN_FORCE,
      g_param_spec_string ("schedule-in-force", "Schedule in force",
          "The schedule that frames are decoded by, from the property, the "
          "tag or by default; empty before the first frame; notifies",
          "", kReadOnly));
  /**
   * GstCodedFilter:stats:
   *
   * All counters at one moment, each a guint64. They can be read until the next
   * run begins.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_STATS,
      g_param_spec_boxed ("stats", "Statistics",
          "All counters at one moment; notifies when frames are lost, "
          "corrupted or saturated, and when a mapping comes into force",
          GST_TYPE_STRUCTURE, kReadOnly));
}

void
set_property (
    GObject *object, guint id, const GValue *value, GParamSpec *pspec) noexcept
{
  filter_of (object).set_property (id, value, pspec);
}

void
get_property (
    GObject *object, guint id, GValue *value, GParamSpec *pspec) noexcept
{
  filter_of (object).get_property (id, value, pspec);
}

void
set_own_property (
    GObject *object, guint id, const GValue *value, GParamSpec *pspec) noexcept
{
  filter_of (object).set_own_property (id, value, pspec);
}

void
get_own_property (
    GObject *object, guint id, GValue *value, GParamSpec *pspec) noexcept
{
  filter_of (object).get_own_property (id, value, pspec);
}

GstStateChangeReturn
change_state (GstElement *element, GstStateChange transition) noexcept
{
  CodedFilter &filter = filter_of (element);
  if (!filter.before_state_change (transition))
    return GST_STATE_CHANGE_FAILURE;
  const GstStateChangeReturn changed =
      GST_ELEMENT_CLASS (gst_coded_filter_parent_class)
          ->change_state (element, transition);
  filter.after_state_change (transition);
  return changed;
}

void
finalize (GObject *object) noexcept
{
  delete &filter_of (object);
  G_OBJECT_CLASS (gst_coded_filter_parent_class)->finalize (object);
}

GstFlowReturn
chain (GstPad *, GstObject *parent, GstBuffer *frame) noexcept
{
  return filter_of (parent).chain (BufferPtr (frame));
}

gboolean
sink_event (GstPad *, GstObject *parent, GstEvent *event) noexcept
{
  return filter_of (parent).sink_event (EventPtr (event));
}

gboolean
src_event (GstPad *pad, GstObject *parent, GstEvent *event) noexcept
{
  return filter_of (parent).src_event (GST_CODED_PAD (pad), event);
}

gboolean
sink_query (GstPad *, GstObject *parent, GstQuery *query) noexcept
{
  return filter_of (parent).sink_query (query);
}

gboolean
src_query (GstPad *pad, GstObject *parent, GstQuery *query) noexcept
{
  return filter_of (parent).src_query (GST_CODED_PAD (pad), query);
}

} // namespace

} // namespace codedexposure::gst

static void
gst_coded_filter_class_init (GstCodedFilterClass *klass)
{
  using namespace codedexposure::gst;
  auto *object = G_OBJECT_CLASS (klass);
  object->set_property = set_property;
  object->get_property = get_property;
  object->finalize = finalize;
  install_properties (object);

  auto *element = GST_ELEMENT_CLASS (klass);
  element->change_state = GST_DEBUG_FUNCPTR (change_state);
  gst_element_class_add_static_pad_template (element, &sink_template);
  gst_element_class_add_static_pad_template_with_gtype (
      element, &src_template, GST_TYPE_CODED_PAD);
  for (const GType type : {GST_TYPE_CODED_FILTER, GST_TYPE_CODED_PAD})
    gst_type_mark_as_plugin_api (type, GstPluginAPIFlags (0));
}

static void
gst_coded_filter_init (GstCodedFilter *)
{
}

namespace codedexposure::gst
{

void
use_own_properties (GObjectClass *klass)
{
  klass->set_property = gst::set_own_property;
  klass->get_property = gst::get_own_property;
}

CodedFilter::CodedFilter (GstCodedFilter *element, const StatsNames &names)
    : element_ (GST_ELEMENT (element)),
      sinkpad_ (gst_pad_new_from_static_template (&sink_template, "sink")),
      names_ (names)
{
  gst_pad_set_chain_function (sinkpad_, GST_DEBUG_FUNCPTR (gst::chain));
  gst_pad_set_event_function (sinkpad_, GST_DEBUG_FUNCPTR (gst::sink_event));
  gst_pad_set_query_function (sinkpad_, GST_DEBUG_FUNCPTR (gst::sink_query));
  /* Caps without a frame rate are no subset of the template. An error about a
   * missing rate comes with the first frame. */
  GST_PAD_SET_ACCEPT_INTERSECT (sinkpad_);
  GST_PAD_SET_ACCEPT_TEMPLATE (sinkpad_);
  gst_element_add_pad (element_, sinkpad_);
}

ObjectPtr<GstCodedPad>
CodedFilter::new_source_pad (
    const char *templ, const std::string &name, PadKind kind, int index) const
{
  GstPad *pad = gst_pad_new_from_template (
      gst_element_get_pad_template (element_, templ), name.c_str ());
  gst_pad_set_event_function (pad, GST_DEBUG_FUNCPTR (gst::src_event));
  gst_pad_set_query_function (pad, GST_DEBUG_FUNCPTR (gst::src_query));
  GST_PAD_SET_ACCEPT_TEMPLATE (pad);
  CodedPad &coded = GST_CODED_PAD (pad)->coded;
  coded.kind = kind;
  coded.index = index;
  return ObjectPtr<GstCodedPad> (GST_CODED_PAD (gst_object_ref_sink (pad)));
}

namespace
{

/* Reads @text anew; without it, what was named before. */
template <typename T, typename Read>
void
set_named (GstElement *element, Named<T> &named, Read read,
    std::optional<std::string> text = {})
{
  if (!text) {
    const ObjectLock lock (element);
    text = named.text;
  }
  Named<T> anew{*text, nullptr};
  if (!text->empty ())
    anew.read = std::make_shared<const Result<T>> (read (*text));
  if (anew.read && !*anew.read)
    GST_WARNING_OBJECT (element, "%s", anew.read->error ().message.c_str ());
  const ObjectLock lock (element);
  named = std::move (anew);
}

template <typename T>
bool
check_read (GstElement *element, const char *property, const Named<T> &named)
{
  if (!named.read || *named.read)
    return true;
  GST_ELEMENT_ERROR (element, RESOURCE, SETTINGS,
      ("The %s property cannot be read: %s", property,
          named.read->error ().message.c_str ()),
      (nullptr));
  return false;
}

} // namespace

void
CodedFilter::set_property (guint id, const GValue *value, GParamSpec *pspec)
{
  if (id == PROP_SCHEDULE)
    set_named (element_, settings_.schedule, Schedule::parse,
        g_value_get_string (value) ?: "");
  if (id == PROP_MAPPING)
    set_named (element_, settings_.mapping, Mapping::load,
        g_value_get_string (value) ?: "");

  const ObjectLock lock (element_);
  settings_changed_ = true;
  switch (id) {
  case PROP_SCHEDULE:
  case PROP_MAPPING:
    break;
  case PROP_BITS:
    settings_.bits = g_value_get_int (value);
    break;
  case PROP_FRAME_RATE:
    settings_.rate = {gst_value_get_fraction_numerator (value),
        gst_value_get_fraction_denominator (value)};
    break;
  default:
    G_OBJECT_WARN_INVALID_PROPERTY_ID (element_, id, pspec);
  }
}

void
CodedFilter::get_property (guint id, GValue *value, GParamSpec *pspec) const
{
  const ObjectLock lock (element_);
  switch (id) {
  case PROP_SCHEDULE:
    g_value_set_string (value, settings_.schedule.text.c_str ());
    break;
  case PROP_MAPPING:
    g_value_set_string (value, settings_.mapping.text.c_str ());
    break;
  case PROP_BITS:
    g_value_set_int (value, settings_.bits);
    break;
  case PROP_FRAME_RATE:
    gst_value_set_fraction (value, settings_.rate.num, settings_.rate.den);
    break;
  case PROP_SCHEDULE_IN_FORCE:
    g_value_set_string (value, in_force_ ? in_force_->text ().c_str () : "");
    break;
  case PROP_STATS:
    g_value_take_boxed (value, stats ());
    break;
  default:
    G_OBJECT_WARN_INVALID_PROPERTY_ID (element_, id, pspec);
  }
}

void
CodedFilter::set_own_property (guint id, const GValue *value, GParamSpec *pspec)
{
  const ObjectLock lock (element_);
  settings_changed_ = true;
  if (!set_own (id, value))
    G_OBJECT_WARN_INVALID_PROPERTY_ID (element_, id, pspec);
}

void
CodedFilter::get_own_property (guint id, GValue *value, GParamSpec *pspec) const
{
  const ObjectLock lock (element_);
  if (!get_own (id, value))
    G_OBJECT_WARN_INVALID_PROPERTY_ID (element_, id, pspec);
}

GstStructure *
CodedFilter::stats () const
{
  GstStructure *stats = gst_structure_new_empty (names_.structure);
  set_field (stats, "frames-in", counters_.frames_in);
  set_field (stats, names_.out, counters_.pictures_out);
  set_field (stats, "frames-lost", counters_.frames_lost);
  set_field (stats, "frames-corrupted", counters_.frames_corrupted);
  if (names_.dropped)
    set_field (stats, names_.dropped, counters_.pictures_dropped);
  set_field (stats, "saturated-frames", counters_.saturated_frames);
  set_field (stats, "mirrors-exact", counters_.mirrors.exact);
  set_field (stats, "mirrors-weighted", counters_.mirrors.weighted);
  set_field (stats, "mirrors-mixed", counters_.mirrors.mixed);
  set_field (stats, "mirrors-unseen", counters_.mirrors.unseen);
  return stats;
}

/* Files may have changed since they were named; what cannot be read should be
 * known before anything runs. */
bool
CodedFilter::read_settings ()
{
  set_named (element_, settings_.schedule, Schedule::parse);
  set_named (element_, settings_.mapping, Mapping::load);
  CodedSettings read;
  {
    const ObjectLock lock (element_);
    read = settings_;
  }
  return check_read (element_, "schedule", read.schedule) &&
         check_read (element_, "mapping", read.mapping);
}

bool
CodedFilter::before_state_change (GstStateChange transition)
{
  switch (transition) {
  case GST_STATE_CHANGE_NULL_TO_READY:
    return read_settings ();
  case GST_STATE_CHANGE_READY_TO_PAUSED: {
    resume ();
    /* The counters of a run can be read until the next one begins. */
    const ObjectLock lock (element_);
    counters_ = CodedCounters ();
    return true;
  }
  case GST_STATE_CHANGE_PAUSED_TO_READY:
    cancel ();
    return true;
  default:
    return true;
  }
}

void
CodedFilter::after_state_change (GstStateChange transition)
{
  if (transition != GST_STATE_CHANGE_PAUSED_TO_READY)
    return;
  stream_ = Stream ();
  each_pad ([this] (GstCodedPad *pad) {
    pad->coded.discont = true;
    pad->coded.offset = 0;
    pad->coded.allocation.reset ();
    const ObjectLock lock (element_);
    forget_lateness (pad);
  });
  forget ();
  const ObjectLock lock (element_);
  settings_changed_ = true;
  in_force_.reset ();
  assumed_ = false;
  rectifies_ = false;
  latency_ = 0;
}

void
CodedFilter::notify (const char *property) const
{
  g_object_notify (G_OBJECT (element_), property);
}

void
CodedFilter::post_error (const std::string &why) const
{
  GST_ELEMENT_ERROR (element_, STREAM, FORMAT, ("%s", why.c_str ()), (nullptr));
}

GstFlowReturn
CodedFilter::post_decode_error (const Error &error) const
{
  GST_ELEMENT_ERROR (element_, STREAM, DECODE,
      ("A coded frame could not be decoded: %s.", error.message.c_str ()),
      (nullptr));
  return GST_FLOW_ERROR;
}

} // namespace codedexposure::gst
