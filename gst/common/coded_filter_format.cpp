/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* GstCodedFilter: finds format, schedule and mapping in properties, caps and
 * tags. */
#include "coded_filter.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "tag.h"

#define GST_CAT_DEFAULT coded_filter_debug

namespace codedexposure::gst
{

namespace
{

std::string
text_of (GstClockTime time)
{
  return CharPtr (g_strdup_printf ("%" GST_TIME_FORMAT, GST_TIME_ARGS (time)))
      .get ();
}

} // namespace

CapsPtr
CodedFormat::resized (Extent other) const
{
  CapsPtr changed (gst_caps_copy (caps.get ()));
  gst_caps_set_simple (changed.get (), "pixel-aspect-ratio", GST_TYPE_FRACTION,
      info.par_n, info.par_d, "width", G_TYPE_INT, other.width, "height",
      G_TYPE_INT, other.height, nullptr);
  return changed;
}

GstFlowReturn
CodedFilter::negotiate (GstBuffer *next)
{
  const auto meta = next ? get_frame_meta (next) : std::nullopt;
  const int bits = meta ? std::max (0, meta->bits) : 0;
  if (meta && std::exchange (stream_.bits, bits) != bits)
    stream_.stale = true;
  locked (element_, [&] {
    if (std::exchange (shared_.settings_changed, false)) {
      stream_.settings = shared_.settings;
      take_settings ();
      stream_.stale = true;
    }
  });
  if (stream_.stale) {
    if (const GstFlowReturn flow = drain (); flow != GST_FLOW_OK)
      return flow;
    auto format = find_format ();
    if (!format)
      return GST_FLOW_NOT_NEGOTIATED;
    PadCaps caps;
    caps.of (PadKind::coded).reset (gst_caps_ref (format->caps.get ()));
    if (!plan (*format, caps))
      return GST_FLOW_NOT_NEGOTIATED;
    locked (element_, [&] { caps_ = std::move (caps); });
    adopt (std::move (*format), next);
  }
  if (awaits_excerpt ())
    return GST_FLOW_OK;
  settle_events ();
  push_provenance ();
  return GST_FLOW_OK;
}

std::optional<CodedFormat>
CodedFilter::find_format ()
{
  const auto refused = [this] (const std::string &why) {
    post_error (why);
    return std::nullopt;
  };
  if (!stream_.caps)
    return refused ("Coded frames came without caps.");
  CodedFormat format{};
  format.caps = fill_in_rate (stream_.settings.rate, stream_.caps.get ());
  GstVideoInfo &info = format.info;
  if (!gst_video_info_from_caps (&info, format.caps.get ()))
    return refused ("The caps of the coded frames cannot be read.");
  if (GST_VIDEO_INFO_IS_INTERLACED (&info))
    return refused ("The coded frames are interlaced. A coded exposure needs a "
                    "progressive camera with a global shutter.");
  if (info.fps_n == 0)
    return refused (
        "The coded frames have no frame rate, so pictures have no duration. "
        "Set the frame-rate property, for example frame-rate=25/1.");
  format.rate = {info.fps_n, info.fps_d};
  stream_.tagged_bits = significant_bits_of (tagged ().bits, info);
  format.size = {info.width, info.height};
  if (stream_.not_coded)
    return refused (*stream_.not_coded);
  if (!find_schedule (format) || !match_camera (format) || !find_bench (format))
    return std::nullopt;
  auto slots = SlotPlan::fit (
      format.schedule.timing (), format.schedule.slots (), format.rate);
  if (!slots)
    return refused (slots.error ().message);
  format.slots = *slots;
  if (!find_rectifier (format))
    return std::nullopt;
  return format;
}

/* The property wins over the stream's tag, which wins over the default. */
bool
CodedFilter::find_schedule (CodedFormat &format)
{
  if (const auto &asked = stream_.settings.schedule.read) {
    if (!check_named (element_, "schedule", stream_.settings.schedule))
      return false;
    format.schedule = asked->value ();
    report_overruled (format.schedule);
    return true;
  }
  if (stream_.tagged) {
    if (!*stream_.tagged)
      return post_error ("The schedule in the stream's tags cannot be read: " +
                         stream_.tagged->error ().message);
    format.schedule = tagged ().schedule;
    return true;
  }
  if (stream_.settings.require_schedule)
    return post_error (
        "The stream has no schedule, neither in its tags nor in its "
        "track. Set the schedule property (or --schedule).");
  format.assumed = true;
  if (!std::exchange (stream_.warned_assumed, true))
    POST_WARNING (element_, STREAM, FORMAT,
        "The stream has no schedule tag; assuming " + format.schedule.text () +
            ". Set the schedule property (or --schedule) if it is another.");
  return true;
}

/* Frames that were cropped, scaled or timed anew no longer show what the tag
 * says. The rate becomes that of the tag: a container has the frame period, in
 * whole nanoseconds. */
bool
CodedFilter::match_camera (CodedFormat &format) const
{
  if (stream_.settings.schedule.read)
    return true;
  const StreamSetup &camera = tagged ();
  if (camera.off_beam)
    return post_error (
        "These are frames of the beam of the mirrors that are off, partners of "
        "those of another camera. Link them to the pad off of "
        "codedexposure-pair, and the others to its pad on, or " +
        std::string (kDecodeTwo));
  const std::string remedy =
      " Decode the frames as the camera gave them, or set the schedule "
      "property (or --schedule).";
  if (camera.size && *camera.size != format.size)
    return post_error ("The coded frames have " + size_text (format.size) +
                       " pixels, but the camera gave " +
                       size_text (*camera.size) +
                       ": they were cropped or scaled." + remedy);
  const FrameRate rate = camera.rate.value_or (format.rate);
  if (std::abs (rate.period () - format.rate.period ()) <= 1) {
    format.rate = rate;
    return true;
  }
  const auto text = [] (FrameRate of) {
    return std::to_string (of.num) + "/" + std::to_string (of.den);
  };
  return post_error ("The caps say " + text (format.rate) +
                     " coded frames a second, but the camera gave " +
                     text (rate) + "." + remedy);
}

void
CodedFilter::report_overruled (const Schedule &asked)
{
  if (!stream_.tagged || !*stream_.tagged)
    return;
  const Schedule &said = tagged ().schedule;
  if (said == asked || stream_.overruled == said)
    return;
  stream_.overruled = said;
  POST_WARNING (element_, STREAM, FORMAT,
      "The schedule property (or --schedule), " + asked.text () +
          ", overrides the schedule of the stream, " + said.text () + ".");
}

/* Whether frames of @info can be those of the bench. */
Result<void>
CodedFilter::check_bench (const GstVideoInfo &info) const
{
  int bits = stream_.settings.bits > 0 ? stream_.settings.bits : said_bits ();
  if (const int all = GST_VIDEO_FORMAT_INFO_BITS (info.finfo);
      bits == 0 && stream_.bench->bits > all)
    bits = all;
  return stream_.bench->check_frames ({info.width, info.height}, bits);
}

/* The property wins over the stream's tag. The leak of the profile becomes that
 * of the schedule. Frames that were cropped on purpose, as the schedule
 * property says, are decoded without the tag's profile. */
bool
CodedFilter::find_bench (CodedFormat &format)
{
  stream_.bench = tagged ().bench;
  const auto fits = [this] (const auto &good) {
    if (!good)
      post_error (
          "The bench profile does not fit: " + good.error ().message + ".");
    return good.ok ();
  };
  if (const auto &asked = stream_.settings.bench.read) {
    if (!check_named (element_, "bench", stream_.settings.bench))
      return false;
    const BenchProfile given = asked->value ().of_beam (tagged ().off_beam);
    if (stream_.bench && !fits (given.check_bench (*stream_.bench)))
      return false;
    stream_.bench = given;
    const auto old = given.why_doubtful (now_utc ());
    if (old && !std::exchange (stream_.warned_of_bench, true))
      POST_WARNING (element_, RESOURCE, SETTINGS, *old);
  } else if (stream_.bench && stream_.settings.schedule.read) {
    const auto good = check_bench (format.info);
    if (!good && !std::exchange (stream_.warned_of_bench, true))
      POST_WARNING (element_, STREAM, FORMAT,
          "The bench profile in the stream's tags is not used: " +
              good.error ().message + ".");
    if (!good)
      stream_.bench.reset ();
  }
  if (!stream_.bench)
    return true;
  auto leaky = stream_.bench->with_leak (format.schedule);
  if (!fits (check_bench (format.info)) || !fits (leaky))
    return false;
  format.schedule = *std::move (leaky);
  return true;
}

/* The property wins over the stream's tag, and a mapping over that of a bench
 * profile from the same place; a blur without a mapping comes last. Frames that
 * were scaled or cropped after calibration are decoded without the tag's
 * mapping. */
bool
CodedFilter::find_mapping (Extent camera, std::optional<Mapping> &mapping)
{
  if (const auto &asked = stream_.settings.mapping.read) {
    if (!check_named (element_, "mapping", stream_.settings.mapping))
      return false;
    mapping = asked->value ();
    if (mapping->camera () == camera)
      return true;
    return post_error (
        "The mapping " + stream_.settings.mapping.text + " is for frames of " +
        size_text (mapping->camera ()) + " pixels, but these have " +
        size_text (camera) +
        ". Measure a new mapping with moirecalib or \"codedexposure "
        "calibrate\".");
  }
  if (stream_.settings.bench.read)
    mapping = stream_.bench->mapping;
  if (!mapping)
    mapping = tagged ().mapping;
  if (!mapping && stream_.bench)
    mapping = stream_.bench->known_mapping ();
  if (!mapping || mapping->camera () == camera)
    return true;
  if (!std::exchange (stream_.warned_of_mapping, true))
    POST_WARNING (element_, STREAM, FORMAT,
        "The mapping in the stream's tags is for frames of " +
            size_text (mapping->camera ()) + " pixels, but these have " +
            size_text (camera) +
            "; they are decoded without it. Do not scale or crop coded "
            "frames.");
  mapping.reset ();
  return true;
}

bool
CodedFilter::find_rectifier (CodedFormat &format)
{
  std::optional<Mapping> mapping;
  if (!find_mapping (format.size, mapping))
    return false;
  if (!mapping)
    return true;

  const RectifyOptions options = rectify_options (format.schedule);
  auto &cache = stream_.rectifiers;
  if (!cache || !(cache->mapping == *mapping) ||
      !(cache->schedule == format.schedule) || !(cache->options == options)) {
    auto made = Rectifier::make (*mapping, format.schedule, options);
    if (!made)
      return post_error (
          "The mapping cannot be used: " + made.error ().message);
    cache.emplace (RectifierCache{*mapping, format.schedule, options,
        std::make_shared<const Rectifier> (*std::move (made))});
  }
  format.rectifier = cache->rectifier;
  format.size = format.rectifier->mirrors ();
  return true;
}

/* Pictures before and after @next, the first frame of the new schedule, do not
 * continue each other. */
void
CodedFilter::report_change (const Schedule &before, GstBuffer *next)
{
  break_off ();
  POST_INFO (element_, STREAM, FORMAT,
      "The schedule changes from " + before.text () + " to " +
          format ().schedule.text () +
          (next ? " at " + text_of (GST_BUFFER_PTS (next))
                : " with the next coded frame") +
          ".");
}

void
CodedFilter::set_provenance (GstBuffer *next)
{
  const auto meta = next ? get_frame_meta (next) : std::nullopt;
  Provenance made{{format ().schedule, {}}, method_name (),
      meta ? meta->frame : stream_.sequence->next_number (), 0};
  if (format ().rectifier)
    made.setup.mapping = stream_.rectifiers->mapping;
  const GstVideoInfo &info = format ().info;
  made.setup.size = Extent{info.width, info.height};
  made.setup.rate = format ().rate;
  made.setup.bits = significant_bits_of (significant_bits (), info);
  made.setup.simulated = tagged ().simulated;
  if ((made.setup.bench = stream_.bench))
    made.setup.bench->mapping.reset ();
  stream_.provenance_due = true;
  const ObjectLock lock (element_);
  shared_.provenance = std::make_shared<const Provenance> (std::move (made));
}

std::shared_ptr<const Provenance>
CodedFilter::provenance () const
{
  const ObjectLock lock (element_);
  return shared_.provenance;
}

/* After segment and tags from upstream. */
void
CodedFilter::push_provenance ()
{
  if (!std::exchange (stream_.provenance_due, false))
    return;
  const auto made = provenance ();
  each_pad ([&] (GstCodedPad *pad) {
    if (pad->state.kind != PadKind::coded)
      gst_pad_push_event (
          GST_PAD (pad), provenance_to_event (provenance_for (pad, *made)));
  });
}

/* Puts @format, for which the subclass has a plan, into force from the frame
 * @next on. */
void
CodedFilter::adopt (CodedFormat format, GstBuffer *next)
{
  const std::optional<Schedule> before =
      has_format () ? std::optional (stream_.format->schedule) : std::nullopt;
  if (!has_format () || !(stream_.format->rate == format.rate))
    stream_.sequence.emplace (
        format.rate, stream_.sequence ? stream_.sequence->next_number () : 0);
  stream_.format = std::move (format);
  stream_.stale = false;
  stream_.workers.reset ();
  report_mirrors ();
  const CodedFormat &adopted = *stream_.format;
  if (before && !(*before == adopted.schedule))
    report_change (*before, next);
  set_provenance (next);
  const bool schedule_changed = locked (element_, [&] {
    const bool changed =
        !shared_.schedule || !(*shared_.schedule == adopted.schedule);
    shared_.schedule = std::make_shared<const Schedule> (adopted.schedule);
    shared_.assumed = adopted.assumed;
    shared_.rectifies = adopted.rectifier != nullptr;
    shared_.period = adopted.period ();
    return changed;
  });
  SeekBook::read (this, stream_.id, reach ());
  each_pad ([this] (GstCodedPad *pad) {
    pad->state.allocation.reset ();
    push_caps (pad);
  });
  GST_INFO_OBJECT (element_, "%s: %dx%d", adopted.schedule.text ().c_str (),
      adopted.size.width, adopted.size.height);
  if (schedule_changed)
    notify ("schedule-in-force");
  planned (schedule_changed);
}

void
CodedFilter::push_caps (GstCodedPad *pad)
{
  const CapsPtr caps = caps_for (pad);
  const CapsPtr current (gst_pad_get_current_caps (GST_PAD (pad)));
  if (!caps || (current && gst_caps_is_equal (current.get (), caps.get ())))
    return;
  GstEvent *event = gst_event_new_caps (caps.get ());
  gst_event_set_seqnum (event, stream_.caps_seqnum);
  gst_pad_push_event (GST_PAD (pad), event);
}

void
CodedFilter::report_mirrors ()
{
  const auto &rectifier = stream_.format->rectifier;
  const RectifyReport report =
      rectifier ? rectifier->report () : RectifyReport ();
  const MirrorsSeen mirrors{
      report.exact, report.weighted, report.mixed, report.unseen};
  locked (element_, [&] { shared_.counters.mirrors = mirrors; });
  if (!rectifier)
    return;
  notify ("stats");
  post_message (element_, mirrors);
}

int
CodedFilter::significant_bits () const
{
  if (stream_.settings.bits > 0)
    return stream_.settings.bits;
  if (const int said = said_bits (); said > 0 || !bench ())
    return said;
  return bench ()->bits;
}

} // namespace codedexposure::gst
