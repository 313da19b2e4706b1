/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-keep
 * @title: codedexposure-keep
 * @short_description: Keeps what has just happened
 *
 * Passes coded frames on and remembers those of the last seconds. When
 * something has happened that is worth it, they become a recording, with all
 * that is known of them, as high-speed cameras do ("post-trigger"). What
 * happens is said by #codedexposure-keep:keep, or found in the frames by
 * #codedexposure-keep:event, so that an experiment records itself.
 *
 * The stream does not wait for the disk: a thread of its own writes the frames.
 * At the end of the stream, the element waits for what is still written, and
 * for an event whose #codedexposure-keep:after has not passed, it keeps what
 * there is. Frames of one format and setup are kept; with others, and with a
 * flush or a segment that goes back or the other way, which a seek may bring,
 * it keeps such an event in the same way and begins anew. A recording is in the
 * order of time, also if the frames came backwards.
 *
 * The memory for the frames is bounded by #codedexposure-keep:max-bytes. Where
 * that is reached, a recording is shorter than #codedexposure-keep:length, and
 * an event is kept before its own frame would be forgotten.
 *
 * The message `codedexposure/kept` is posted when a recording is finished, and
 * `codedexposure/event` when an event is found; what could not be kept is a
 * warning. docs/streams.md describes the fields.
 *
 * ## Example pipelines
 * |[
 * gst-launch-1.0 -m codedexposure-scene scene=blown-out num-buffers=400 \
 *     ! video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 \
 *     ! codedexposure-sim \
 *     ! codedexposure-keep event=motion:0.5 after=1000000000 \
 *     ! codedexposure-demux ! fakesink
 * ]| A candle is blown out; the second that follows is kept, too.
 *
 * Since: 0.2
 */
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include <gst/base/gstbasetransform.h>

#include "base/memory.h"
#include "base/pixels.h"
#include "common/element.h"
#include "common/elements.h"
#include "common/kept_frame.h"
#include "common/messages.h"
#include "common/meta.h"
#include "common/tag.h"
#include "kept_file.h"
#include "parts.h"
#include "stats/event_watch.h"

using namespace codedexposure;
using namespace codedexposure::gst;

GST_DEBUG_CATEGORY_STATIC (codedexposure_keep_debug);
#define GST_CAT_DEFAULT codedexposure_keep_debug

namespace
{

struct Settings {
  std::string location = "kept";
  guint64 length = 10 * GST_SECOND;
  guint64 max_bytes = 0;
  std::string event;
  guint64 after = 5 * GST_SECOND;
  int bits = 0;
};

struct KeepState {
  /* Object lock: */
  Settings settings;
  bool keep = false; ///< frames are to be kept, or are being written
  guint64 recordings = 0;

  /* Streaming thread, and what excludes it: */
  Settings in_force;
  std::optional<EventWatch> events;
  std::optional<GstVideoInfo> info;
  std::optional<guint64> last; ///< number of a frame
  int tagged_bits = 0;
  bool has_new_segment = false; ///< since the last frame
  bool said_no_time = false;    ///< of a frame, in this run

  /** Of what follows; taken after the object lock where both are held. Never
   * held while it writes or posts. */
  std::mutex mutex;
  KeptFrames frames;       ///< changed by the streaming thread only
  int tasks = 0;           ///< threads that write, or say why not
  bool is_writing = false; ///< one of them
  std::condition_variable is_done;
  /** PTS of the event that is followed, and of one that came meanwhile. */
  std::optional<GstClockTime> followed, next;
};

struct GstCodedExposureKeep : Instance<GstBaseTransform, KeepState> {
};

using Taken = Result<KeptFrames>;

/* What is remembered now, for the only task that writes it. The mutex is held.
 */
Taken
take_frames (KeepState &state)
{
  if (state.is_writing)
    return Error{"The frames that were kept before are still being written; "
                 "keep again then."};
  if (state.frames.buffers.empty () || !state.frames.caps)
    return Error{"There is no coded frame to be kept yet; keep again "
                 "when frames have come."};
  state.is_writing = true;
  return state.frames.copy ();
}

void
write_frames (GstCodedExposureKeep *self, KeptFrames frames)
{
  KeepState &state = self->state;
  const auto meta = get_frame_meta (frames.buffers.front ().get ());
  Kept kept{.frames = frames.buffers.size (),
      .duration = frames.length (),
      .frame = meta ? std::optional (meta->frame) : std::nullopt};
  const auto written = write_kept (std::move (frames),
      locked (self, [&] { return state.settings.location; }));
  locked (state.mutex, [&] { state.is_writing = false; });
  locked (self, [&] { state.recordings += written ? 1 : 0; });
  if (written) {
    kept.location = *written;
    post_message (self, kept);
  } else {
    POST_WARNING (self, RESOURCE, WRITE, written.error ().message + ".");
  }
}

/* A thread of its own. */
void
run_task (GstElement *element, gpointer data) noexcept
{
  auto *self = as<GstCodedExposureKeep> (element);
  KeepState &state = self->state;
  Taken &taken = *static_cast<Taken *> (data);
  if (taken)
    write_frames (self, *std::move (taken));
  else
    POST_WARNING (self, RESOURCE, BUSY, taken.error ().message);
  const bool goes_on = locked (state.mutex, [&] { return state.is_writing; });
  locked (self, [&] { return state.keep &= goes_on; });
  const std::lock_guard lock (state.mutex);
  state.tasks--;
  state.is_done.notify_all ();
}

/* Keeps what is remembered now. The mutex is held. */
void
begin_task (GstCodedExposureKeep *self)
{
  self->state.tasks++;
  gst_element_call_async (GST_ELEMENT (self), run_task,
      new Taken (take_frames (self->state)),
      [] (gpointer taken) { delete static_cast<Taken *> (taken); });
}

/* What was to be kept is written when it returns. */
void
finish (GstCodedExposureKeep *self)
{
  KeepState &state = self->state;
  std::unique_lock lock (state.mutex);
  const auto idle = [&state] { return state.tasks == 0; };
  state.is_done.wait (lock, idle);
  state.next.reset ();
  if (!std::exchange (state.followed, std::nullopt))
    return;
  begin_task (self);
  state.is_done.wait (lock, idle);
}

/* An event is kept before frames of another format, setup or place come, and
 * that these differ from those before is none. */
void
begin_anew (GstCodedExposureKeep *self)
{
  KeepState &state = self->state;
  finish (self);
  if (state.events)
    state.events.emplace (EventRule (state.events->rule ()));
  const std::lock_guard lock (state.mutex);
  state.frames.clear ();
}

/* An event is followed for its time, or until its own frame would be forgotten,
 * where there is memory for less. One that came meanwhile is followed for as
 * long. */
void
keep_what_is_due (GstCodedExposureKeep *self, GstClockTime pts)
{
  KeepState &state = self->state;
  const std::lock_guard lock (state.mutex);
  if (!state.followed || state.tasks > 0)
    return;
  const bool goes_back = GST_BASE_TRANSFORM (self)->segment.rate < 0;
  const auto since = [&] (GstClockTime time) {
    return goes_back ? gint64 (time - pts) : gint64 (pts - time);
  };
  const GstClockTime event = *state.followed;
  const GstClockTime oldest =
      GST_BUFFER_PTS (state.frames.buffers.front ().get ());
  if (since (event) < gint64 (state.in_force.after) &&
      since (oldest) > since (event))
    return;
  state.followed = std::exchange (state.next, std::nullopt);
  begin_task (self);
}

void
on_event (GstCodedExposureKeep *self, GstBuffer *frame, double jump)
{
  KeepState &state = self->state;
  const auto meta = get_frame_meta (frame);
  const GstClockTime pts = GST_BUFFER_PTS (frame);
  locked (state.mutex,
      [&] { return (state.followed ? state.next : state.followed) = pts; });
  const bool is_mean = state.events->rule ().kind == EventRule::Kind::mean;
  post_message (
      self, EventFound{.kind = is_mean ? "mean" : "motion",
                .frame = meta ? std::optional (meta->frame) : std::nullopt,
                .time = pts,
                .jump = jump,
                .after = state.in_force.after});
}

/* Frames that are damaged or show a pattern are no events. */
void
watch (GstCodedExposureKeep *self, GstBuffer *frame)
{
  KeepState &state = self->state;
  const auto meta = get_frame_meta (frame);
  if (is_corrupted (frame) || shows_pattern (frame))
    return state.events->skip ();
  const bool goes_back = GST_BASE_TRANSFORM (self)->segment.rate < 0;
  if (meta && state.last &&
      meta->frame != (goes_back ? *state.last - 1 : *state.last + 1))
    state.events->skip ();
  state.last = meta ? std::optional (meta->frame) : std::nullopt;
  MappedFrame mapped (*state.info, frame, GST_MAP_READ);
  if (!mapped)
    return state.events->skip ();
  const int largest = largest_pixel (
      bits_of (frame, *state.info, state.in_force.bits, state.tagged_bits));
  const auto jump = read_pixels (mapped,
      [&] (auto pixels) { return state.events->add (pixels, largest); });
  if (jump)
    on_event (self, frame, *jump);
}

/* Whether the frame of a new segment follows those that are remembered. */
bool
follows (const KeepState &state, GstClockTime pts, double rate)
{
  const auto &buffers = state.frames.buffers;
  if (buffers.empty ())
    return true;
  const GstClockTime first = GST_BUFFER_PTS (buffers.front ().get ());
  const GstClockTime last = GST_BUFFER_PTS (buffers.back ().get ());
  return rate < 0 ? first >= last && last > pts : first <= last && last < pts;
}

GstFlowReturn
transform_ip (GstBaseTransform *base, GstBuffer *frame) noexcept
{
  auto *self = as<GstCodedExposureKeep> (base);
  KeepState &state = self->state;
  const GstClockTime pts = GST_BUFFER_PTS (frame);
  if (!GST_CLOCK_TIME_IS_VALID (pts) &&
      !std::exchange (state.said_no_time, true))
    POST_WARNING (self, STREAM, FORMAT,
        "A coded frame has no time stamp (PTS), and such frames are not kept. "
        "Let the source set one, for example with do-timestamp=true.");
  if (!GST_CLOCK_TIME_IS_VALID (pts) || !state.info)
    return GST_FLOW_OK;
  if (!holds_frame (base, *state.info, frame))
    return GST_FLOW_ERROR;
  if (std::exchange (state.has_new_segment, false) &&
      !follows (state, pts, base->segment.rate))
    begin_anew (self);
  BufferPtr kept = kept_frame (frame);
  locked (state.mutex, [&] {
    state.frames.buffers.push_back (std::move (kept));
    state.frames.bytes += bytes_of (frame);
    state.frames.limit (state.in_force.length, state.in_force.max_bytes);
  });
  if (state.events)
    watch (self, frame);
  keep_what_is_due (self, pts);
  return GST_FLOW_OK;
}

gboolean
set_caps (GstBaseTransform *base, GstCaps *caps, GstCaps *) noexcept
{
  auto *self = as<GstCodedExposureKeep> (base);
  KeepState &state = self->state;
  GstVideoInfo info;
  if (!gst_video_info_from_caps (&info, caps))
    return FALSE;
  state.info = info;
  const auto &before = state.frames.caps;
  if (before && !gst_caps_is_equal (before.get (), caps))
    begin_anew (self);
  locked (state.mutex, [&] { state.frames.caps.reset (gst_caps_ref (caps)); });
  if (state.events && !state.events->fits ({info.width, info.height}))
    POST_WARNING (self, STREAM, FORMAT,
        "The region " + rect_text (*state.events->rule ().region) +
            " is not within the frames of " +
            size_text ({info.width, info.height}) +
            " pixels, so no event is seen. Set another region.");
  return TRUE;
}

void
follow_tags (GstCodedExposureKeep *self, GstEvent *event)
{
  KeepState &state = self->state;
  const auto setup = setup_from_tags (tags_of (event));
  if (!setup || !*setup)
    return;
  GstEvent *tag = state.frames.tag.get ();
  const auto before = tag ? setup_from_tags (tags_of (tag)) : std::nullopt;
  if (before && *before && !(before->value () == setup->value ()))
    begin_anew (self);
  const std::lock_guard lock (state.mutex);
  state.frames.tag.reset (gst_event_ref (event));
}

gboolean
sink_event (GstBaseTransform *base, GstEvent *event) noexcept
{
  auto *self = as<GstCodedExposureKeep> (base);
  follow_tagged_bits (event, self->state.tagged_bits);
  if (GST_EVENT_TYPE (event) == GST_EVENT_TAG)
    follow_tags (self, event);
  else if (GST_EVENT_TYPE (event) == GST_EVENT_FLUSH_STOP)
    begin_anew (self);
  else if (GST_EVENT_TYPE (event) == GST_EVENT_SEGMENT)
    self->state.has_new_segment = true;
  else if (GST_EVENT_TYPE (event) == GST_EVENT_EOS)
    finish (self);
  return base_transform_class ()->sink_event (base, event);
}

bool
begin_run (GstElement *element)
{
  auto *self = as<GstCodedExposureKeep> (element);
  KeepState &state = self->state;
  state.in_force = locked (self, [&state] {
    state.recordings = 0;
    return state.settings;
  });
  if (state.in_force.max_bytes == 0)
    state.in_force.max_bytes = room_in_memory ();
  state.events.reset ();
  const std::string &event = state.in_force.event;
  const auto rule = parse_event_rule (event);
  if (!event.empty () && !rule)
    return refuse_settings (self,
        "The event property \"" + event +
            "\" is not an event such as mean:10, motion:2 or "
            "motion:2@64x48+100+80: what changes, by how many percent of the "
            "largest pixel value, in which region");
  if (rule && state.in_force.after > state.in_force.length)
    return refuse_settings (self,
        "The after property, " + std::to_string (state.in_force.after) +
            " ns, is more than length, " +
            std::to_string (state.in_force.length) +
            " ns: an event would be forgotten before it is kept. Set a greater "
            "length");
  if (rule)
    state.events.emplace (*rule);
  state.last.reset ();
  state.said_no_time = false;
  return true;
}

void
end_run (GstElement *element)
{
  auto *self = as<GstCodedExposureKeep> (element);
  finish (self);
  KeepState &state = self->state;
  const std::lock_guard lock (state.mutex);
  state.frames = {};
}

PropertyTable<KeepState>
properties ()
{
  static const auto set = [] (auto member) {
    return within (&KeepState::settings, member);
  };
  return {
      {"location", "Beginning of names",
          "Recordings are LOCATION-frameN.mkv, N: the number of the first "
          "frame, 0 if it has none, with their JSON lines beside them; no file "
          "is replaced, and -2 and so on follow where one is there",
          kReadWrite, set (&Settings::location)},
      {"length", "Length", "Frames of this time are remembered (ns)",
          kReadWriteReady, set (&Settings::length), guint64 (0),
          guint64 (G_MAXINT64)},
      {"max-bytes", "Most bytes",
          "Memory for these frames; 0: a quarter of what is free at the "
          "beginning, at most 4 GB",
          kReadWriteReady, set (&Settings::max_bytes), guint64 (0),
          guint64 (G_MAXINT64)},
      {"event", "Event",
          "Frames are kept when they change suddenly: mean:10, by 10 % of the "
          "largest value on average; motion:2, by 2 % from one frame to the "
          "next more than before; motion:2@64x48+100+80, in that region; "
          "empty: never",
          kReadWriteReady, set (&Settings::event)},
      {"after", "Time after an event",
          "How long an event is followed before the frames are kept (ns)",
          kReadWriteReady, set (&Settings::after), guint64 (0),
          guint64 (G_MAXINT64)},
      {"bits", "Significant bits",
          "Significant bits of a pixel, for the largest value. 0: as the frame "
          "metadata or the tags say, or all bits of the format",
          kReadWriteReady, set (&Settings::bits), 0, 16},
      {"keep", "Keep",
          "TRUE keeps what is remembered now; reads TRUE until that is written",
          kReadWrite, &KeepState::keep},
      {"recordings", "Recordings", "Recordings that were written in this run",
          kReadOnly, &KeepState::recordings, guint64 (0), guint64 (G_MAXINT64)},
  };
}

void
changed (GObject *object, const GParamSpec *spec)
{
  auto *self = as<GstCodedExposureKeep> (object);
  if (std::string_view (spec->name) != "keep" || !self->state.keep)
    return;
  const std::lock_guard lock (self->state.mutex);
  begin_task (self);
}

constexpr StateHooks kRun{.begin = begin_run, .end = end_run};

void
set_up (gpointer klass)
{
  GST_DEBUG_CATEGORY_INIT (codedexposure_keep_debug, "codedexposure-keep", 0,
      "keeps what has just happened");
  install_state<GstCodedExposureKeep, properties, changed> (klass);
  install_run<kRun> (klass);
  describe_element (klass, "Coded exposure keep", "Filter/Analyzer/Video",
      "Remembers the coded frames of the last seconds, and makes a recording "
      "of them after something has happened");

  auto *transform_class = GST_BASE_TRANSFORM_CLASS (klass);
  transform_class->set_caps = GST_DEBUG_FUNCPTR (set_caps);
  transform_class->sink_event = GST_DEBUG_FUNCPTR (sink_event);
  transform_class->transform_ip = GST_DEBUG_FUNCPTR (transform_ip);
}

} // namespace

GST_ELEMENT_REGISTER_DEFINE (codedexposure_keep, "codedexposure-keep",
    GST_RANK_NONE,
    (type_of<GstCodedExposureKeep, set_up, set_up_passing> (
        "GstCodedExposureKeep", GST_TYPE_BASE_TRANSFORM)))
