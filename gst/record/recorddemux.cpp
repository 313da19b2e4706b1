/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-recorddemux
 * @title: codedexposure-recorddemux
 * @short_description: The bytes of a recording to coded frames
 *
 * Takes a recording, from a file or from a network, and gives its coded frames
 * with all that is known of them: number, exact time, exposure,
 * synchronisation, lost frames and flags, and the schedule and mapping as a
 * tag. It compares the pixels of each frame with the hash of those that were
 * recorded.
 *
 * A frame whose pixels are not those that were recorded, or that has no line in
 * the track, or whose time was moved against the frames before, or whose
 * schedule was lost, is CORRUPTED.
 * The element messages `codedexposure/frames-damaged`
 * (`active`, `frame`, `from`, `reason`, at the end `count`),
 * `codedexposure/frames-missing` (`count`, `from`),
 * `codedexposure/frames-lost` (`count`, `from`, `to`: never recorded),
 * `codedexposure/stream-cut` (`frames`: the stream ended without its last line)
 * and `codedexposure/stream-incomplete` (`count`: frames are missing together
 * with their lines) report damage; #codedexposure-recorddemux:stats counts it.
 *
 * Frames of a recording of two cameras have their partners, as those of
 * codedexposure-pair. One whose partner is missing or damaged goes on alone,
 * and `codedexposure/partner-lost` (`active`, `reason`, `from`, at the end `to`
 * and `frames`) says so. Messages of the second camera's frames have the field
 * `camera`, "second".
 *
 * The schedule of the track wins over that in the container's tags; a
 * difference is a warning. If the tags say that there is a track, a missing one
 * is damage: all frames are CORRUPTED, with a warning. Any other recording
 * without a track passes unchanged, with a warning: it is unknown whether its
 * frames are synchronised or damaged.
 *
 * ## Damaged recordings
 *
 * If the index or another part of the container is damaged, the element posts
 * an error, often before the first frame. With
 * #codedexposure-recorddemux:salvage, it reads the recording from front to
 * back, without the index, and leaves out what is no cluster of frames: behind
 * damage, it goes on with the next one. Frames that are lost by it are counted
 * by the track. Other damage of the container is a warning, at which the stream
 * ends.
 *
 * ## Example pipeline
 * |[
 * gst-launch-1.0 filesrc location=coded.mkv ! codedexposure-recorddemux \
 *     ! codedexposure-demux ! queue ! videoconvert ! autovideosink
 * ]|
 *
 * Since: 0.2
 */
#include <atomic>
#include <memory>
#include <string>
#include <utility>

#include <gst/gst.h>

#include "camera_tracks.h"
#include "common/element.h"
#include "common/elements.h"
#include "common/raii.h"
#include "large_frames.h"
#include "parts.h"
#include "record/cluster_gate.h"
#include "record/matroska.h"

using namespace codedexposure;
using namespace codedexposure::gst;

namespace
{

/** What the demuxer of one run has read. */
struct Stream {
  std::string begin; ///< of the file, until its head is complete
  guint64 pushed = 0;
  std::optional<MatroskaHead> head;
  gsize bytes_without_frame = 0;
  bool has_failed = false; ///< and the rest is salvaged
  ClusterGate gate;        ///< of what is salvaged
  LargeFrames large;
  bool is_discont = false; ///< the next bytes that the demuxer gets are
  bool is_over = false;    ///< what follows is another recording
  bool said_over = false;
};

struct RecordDemuxState {
  explicit RecordDemuxState (GstElement *self = nullptr)
      : coded (self), partner (self)
  {
  }

  /* Object lock: */
  bool salvage = false;
  bool decode = true;
  guint threads = 0;

  /* Of the bin: */
  GstElement *file = nullptr;               ///< null: matroskademux is missing
  GstPadChainFunction chain = nullptr;      ///< of the demuxer
  GstPadEventFunction take_event = nullptr; ///< of the demuxer

  std::atomic<bool> has_new_frame = false;
  std::atomic<bool> has_segment = false; ///< since a seek or a gap

  /* Streaming thread of the demuxer, and changes of the state: */
  Stream stream;
  CameraTracks coded;
  CameraTracks partner; ///< of the second camera
};

struct GstCodedExposureRecordDemux : Instance<GstBin, RecordDemuxState> {
};
using Self = GstCodedExposureRecordDemux;

/* --------------------------------------------------------------- tracks -- */

bool
is_text (GstPad *pad)
{
  const CapsPtr caps (gst_pad_query_caps (pad, nullptr));
  return gst_caps_get_size (caps.get ()) > 0 &&
         gst_structure_has_name (
             gst_caps_get_structure (caps.get (), 0), "text/x-raw");
}

/* From a track of @pad, as the head of the file says. */
void
add_frames (Self *self, CameraTracks &tracks, GstPad *pad)
{
  const RecordDemuxState &state = self->state;
  auto how = locked (self, [&] {
    return FrameReading{.decode = state.decode, .threads = int (state.threads)};
  });
  if (const auto &head = state.stream.head) {
    const bool first = &tracks == &state.coded;
    how.size = first ? head->size : head->partner_size;
    how.pixel_bytes = first ? head->pixel_bytes : head->partner_pixel_bytes;
    how.duration = head->duration;
  }
  tracks.add_frames (pad, how);
}

/* A frame whose time is damaged is dropped; the track says that it is missing.
 */
GstPadProbeReturn
on_stored (GstPad *pad, GstPadProbeInfo *info, gpointer self) noexcept
{
  if (!GST_BUFFER_PTS_IS_VALID (GST_PAD_PROBE_INFO_BUFFER (info)))
    return GST_PAD_PROBE_DROP;
  const Stream &stream = state_in<Self> (self).stream;
  if (stream.is_over)
    return GST_PAD_PROBE_DROP;
  const ObjectPtr<GstElement> demuxer (gst_pad_get_parent_element (pad));
  info->data = stream.large.put_back (
      pad_of (demuxer.get (), "sink").get (), GST_PAD_PROBE_INFO_BUFFER (info));
  return info->data ? GST_PAD_PROBE_OK : GST_PAD_PROBE_HANDLED;
}

/* A demuxer goes on behind a recording without a length: it begins another
 * segment without a seek. */
GstPadProbeReturn
on_segments (GstPad *, GstPadProbeInfo *info, gpointer self) noexcept
{
  auto &state = state_in<Self> (self);
  Stream &stream = state.stream;
  const GstEventType type = GST_EVENT_TYPE (GST_PAD_PROBE_INFO_EVENT (info));
  if (type == GST_EVENT_SEEK || type == GST_EVENT_FLUSH_STOP)
    state.has_segment = false;
  if (type != GST_EVENT_SEGMENT)
    return GST_PAD_PROBE_OK;
  stream.is_over = state.has_segment.exchange (true);
  if (!stream.is_over || std::exchange (stream.said_over, true))
    return GST_PAD_PROBE_OK;
  POST_WARNING (self, STREAM, DEMUX,
      "Behind the end of the recording, the file goes on with another one, "
      "which is not read. Use each recording from a file of its own.");
  return GST_PAD_PROBE_OK;
}

void
on_pad_added (GstElement *, GstPad *pad, gpointer self)
{
  auto &tracks = state_in<Self> (self).coded;
  if (g_str_has_prefix (GST_OBJECT_NAME (pad), "video_"))
    gst_pad_add_probe (
        pad, GST_PAD_PROBE_TYPE_BUFFER, on_stored, self, nullptr);
  if (g_str_has_prefix (GST_OBJECT_NAME (pad), "video_") &&
      !tracks.has_frames ()) {
    gst_pad_add_probe (
        pad, GST_PAD_PROBE_TYPE_EVENT_BOTH, on_segments, self, nullptr);
    add_frames (as<Self> (self), tracks, pad);
  } else if (is_text (pad))
    tracks.add_lines (pad);
}

/* The second track of frames and the second one of lines, if the file has both.
 */
void
add_partner (Self *self)
{
  RecordDemuxState &state = self->state;
  std::pair<GstPad *, GstPad *> second;
  const auto find = [] (GstElement *, GstPad *pad, gpointer data) {
    auto &[video, text] = *static_cast<decltype (second) *> (data);
    if (gst_pad_is_linked (pad))
      return gboolean (TRUE);
    if (g_str_has_prefix (GST_OBJECT_NAME (pad), "video_"))
      video = video ? video : pad;
    else if (is_text (pad))
      text = text ? text : pad;
    return gboolean (TRUE);
  };
  gst_element_foreach_src_pad (state.file, find, &second);
  const auto [video, text] = second;
  if (!video || !text || !state.coded.has_frames ())
    return;
  state.partner.begin (state.stream.head ? state.stream.head->tick : 1);
  state.partner.add_restore ();
  gst_element_link_pads (
      state.partner.restore (), "src", state.coded.restore (), "partner");
  state.partner.add_lines (text);
  add_frames (self, state.partner, video);
  state.partner.tell_left_segments ();
}

void
on_no_more_pads (GstElement *file, gpointer self)
{
  struct {
    bool any = false, unread = false;
  } video;
  const auto look = [] (GstElement *, GstPad *pad, gpointer data) {
    auto &found = *static_cast<decltype (video) *> (data);
    const bool is_video = g_str_has_prefix (GST_OBJECT_NAME (pad), "video_");
    found.any |= is_video;
    found.unread |= is_video && !gst_pad_is_linked (pad);
    return gboolean (TRUE);
  };
  add_partner (as<Self> (self));
  gst_element_foreach_src_pad (file, look, &video);
  if (!video.any)
    POST_ERROR (self, STREAM, WRONG_TYPE,
        "The file has no video. Use a recording of coded frames.");
  else if (video.unread && state_in<Self> (self).coded.has_frames ())
    POST_WARNING (self, STREAM, DEMUX, kOtherVideo);
}

/* ---------------------------------------------------------------- bytes -- */

bool
salvages (gpointer self)
{
  const ObjectLock lock (self);
  return state_in<Self> (self).salvage;
}

/* A demuxer stops at the end of the first of two recordings. */
void
warn_of_rest (Self *self, GstPad *pad)
{
  const guint64 end = self->state.stream.head->end;
  gint64 size = 0;
  if (salvages (self) || end == 0 ||
      !gst_pad_peer_query_duration (pad, GST_FORMAT_BYTES, &size) ||
      std::cmp_less_equal (size, end)) // -1: not known
    return;
  POST_WARNING (self, STREAM, DEMUX,
      "Behind the end of the recording, the file has " +
          std::to_string (guint64 (size) - end) +
          " bytes more, such as another recording, which are not read. Use "
          "each recording from a file of its own.");
}

/* A demuxer passes over some bytes of a head without reading them. Returns what
 * is wrong; null: nothing. */
const char *
read_head (Self *self, GstPad *pad, guint64 at, GstBuffer *bytes)
{
  RecordDemuxState &state = self->state;
  constexpr gsize kLongestHead = 1 << 20;
  Stream &stream = state.stream;
  const gsize size = gst_buffer_get_size (bytes);
  if (stream.head || at >= kLongestHead)
    return nullptr;
  const gsize part = std::min (size, gsize (kLongestHead - at));
  stream.begin.resize (std::max (stream.begin.size (), at + part));
  gst_buffer_extract (bytes, 0, stream.begin.data () + at, part);
  stream.head = matroska_head (stream.begin);
  if (!stream.head)
    return nullptr;
  stream.begin.clear ();
  if (stream.head->tick == 0)
    return MatroskaHead::kNoTick;
  state.coded.set_tick (stream.head->tick);
  warn_of_rest (self, pad);
  return nullptr;
}

/* A demuxer collects an element of any length that a stream claims. */
GstPadProbeReturn
on_bytes (GstPad *pad, GstPadProbeInfo *info, gpointer self) noexcept
{
  constexpr gsize kMostWithoutFrame = gsize (256) << 20;
  auto &state = state_in<Self> (self);
  Stream &stream = state.stream;
  GstBuffer *bytes = GST_PAD_PROBE_INFO_BUFFER (info);
  const gsize size = gst_buffer_get_size (bytes);
  const bool pulled = GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_PULL;
  const char *why = read_head (
      as<Self> (self), pad, pulled ? info->offset : stream.pushed, bytes);
  stream.pushed += size;
  if (state.has_new_frame.exchange (false))
    stream.bytes_without_frame = 0;
  stream.bytes_without_frame += size;
  if (!why && stream.bytes_without_frame > kMostWithoutFrame)
    why = "256 MB arrived without a frame: this is no stream of coded frames, "
          "or it is damaged.";
  if (!why && pulled)
    info->data = stream.large.pulled (pad, info->offset, bytes);
  if (!why)
    return GST_PAD_PROBE_OK;
  POST_ERROR (self, STREAM, DEMUX, why);
  gst_clear_buffer (reinterpret_cast<GstBuffer **> (&info->data));
  GST_PAD_PROBE_INFO_FLOW_RETURN (info) = GST_FLOW_ERROR;
  return GST_PAD_PROBE_HANDLED;
}

GstPadProbeReturn
on_frame (GstPad *, GstPadProbeInfo *, gpointer self) noexcept
{
  state_in<Self> (self).has_new_frame = true;
  return GST_PAD_PROBE_OK;
}

/* -------------------------------------------------------------- salvage -- */

/* From front to back, a demuxer needs no index. */
GstPadProbeReturn
on_query (GstPad *, GstPadProbeInfo *info, gpointer self) noexcept
{
  GstQuery *query = GST_PAD_PROBE_INFO_QUERY (info);
  if (GST_QUERY_TYPE (query) != GST_QUERY_SCHEDULING || !salvages (self))
    return GST_PAD_PROBE_OK;
  gst_query_set_scheduling (query, GST_SCHEDULING_FLAG_SEQUENTIAL, 1, -1, 0);
  gst_query_add_scheduling_mode (query, GST_PAD_MODE_PUSH);
  return GST_PAD_PROBE_HANDLED;
}

/* Null: none of its bytes may go on yet. */
GstBuffer *
through_gate (ClusterGate &gate, GstBuffer *buffer)
{
  const BufferPtr owned (buffer);
  GstMapInfo map;
  if (!gst_buffer_map (buffer, &map, GST_MAP_READ))
    return nullptr;
  const std::string passed =
      gate.take ({reinterpret_cast<const char *> (map.data), map.size});
  gst_buffer_unmap (buffer, &map);
  return passed.empty ()
             ? nullptr
             : gst_buffer_new_memdup (passed.data (), passed.size ());
}

/* A demuxer that has failed does not pass the end on, and its source would post
 * an error. */
void
end_frames (RecordDemuxState &state)
{
  const auto end = [] (GstElement *, GstPad *src, gpointer) {
    gst_pad_push_event (src, gst_event_new_eos ());
    return gboolean (TRUE);
  };
  gst_element_foreach_src_pad (state.file, end, nullptr);
}

gboolean
take_event (GstPad *pad, GstObject *parent, GstEvent *event) noexcept
{
  const ObjectPtr<GstObject> self (gst_object_get_parent (parent));
  auto &state = state_in<Self> (self.get ());
  const bool is_end = GST_EVENT_TYPE (event) == GST_EVENT_EOS;
  if (GST_EVENT_TYPE (event) == GST_EVENT_SEGMENT)
    state.stream.large.follow (*segment_of (event));
  const gboolean taken = state.take_event (pad, parent, event);
  if (is_end && state.stream.has_failed)
    end_frames (state);
  return taken;
}

GstFlowReturn
chain (GstPad *pad, GstObject *parent, GstBuffer *buffer) noexcept
{
  const ObjectPtr<GstObject> self (gst_object_get_parent (parent));
  auto &state = state_in<Self> (self.get ());
  state.stream.is_discont |= GST_BUFFER_IS_DISCONT (buffer);
  if (salvages (self.get ()))
    buffer = through_gate (state.stream.gate, buffer);
  if (buffer)
    buffer = state.stream.large.pushed (buffer);
  /* Without it, a demuxer that runs again goes on with what it holds. */
  if (buffer && std::exchange (state.stream.is_discont, false)) {
    state.has_segment = false;
    buffer = gst_buffer_make_writable (buffer);
    GST_BUFFER_FLAG_SET (buffer, GST_BUFFER_FLAG_DISCONT);
  }
  const GstFlowReturn flow =
      buffer ? state.chain (pad, parent, buffer) : GST_FLOW_OK;
  if (!state.stream.has_failed)
    return flow;
  end_frames (state);
  return GST_FLOW_EOS;
}

/* Of the bin, in place of an error of its demuxer. */
GstMessage *
container_message (Self *self, GstMessage *from, bool is_warning)
{
  GError *error = nullptr;
  gchar *detail = nullptr;
  gst_message_parse_error (from, &error, &detail);
  const CharPtr owned (detail);
  const std::unique_ptr<GError, FreeWith<g_error_free>> said (error);
  const std::unique_ptr<GError, FreeWith<g_error_free>> own (
      g_error_new_literal (
          GST_STREAM_ERROR, GST_STREAM_ERROR_DEMUX, error->message));
  return (is_warning ? gst_message_new_warning : gst_message_new_error) (
      GST_OBJECT (self), own.get (), detail);
}

void
handle_message (GstBin *bin, GstMessage *message) noexcept
{
  auto *self = as<GstCodedExposureRecordDemux> (bin);
  RecordDemuxState &state = self->state;
  if (GST_MESSAGE_TYPE (message) == GST_MESSAGE_ERROR &&
      GST_MESSAGE_SRC (message) == GST_OBJECT (state.file)) {
    state.stream.has_failed = salvages (self) && state.coded.has_frames ();
    GstMessage *own =
        container_message (self, message, state.stream.has_failed);
    gst_message_unref (message);
    message = own;
  }
  if (GST_MESSAGE_TYPE (message) == GST_MESSAGE_ELEMENT &&
      GST_MESSAGE_SRC (message) == GST_OBJECT (state.partner.restore ())) {
    message = gst_message_make_writable (message);
    gst_structure_set (gst_message_writable_structure (message), "camera",
        G_TYPE_STRING, "second", nullptr);
  }
  parent_class<GstBinClass> (bin)->handle_message (bin, message);
}

/* -------------------------------------------------------------- element -- */

bool
begin_run (GstElement *self)
{
  auto &state = state_in<Self> (self);
  state.stream = {};
  state.has_new_frame = state.has_segment = false;
  state.coded.add_restore ();
  gst_ghost_pad_set_target (GST_GHOST_PAD (pad_of (self, "src").get ()),
      pad_of (state.coded.restore (), "src").get ());
  /* Before the demuxer, to which it is not linked yet. */
  if (state.file)
    return gst_element_set_state (state.coded.restore (), GST_STATE_PAUSED) !=
           GST_STATE_CHANGE_FAILURE;
  POST_ERROR (self, CORE, MISSING_PLUGIN, missing ("matroskademux"));
  return false;
}

void
end_run (GstElement *self)
{
  auto &state = state_in<Self> (self);
  state.coded.end ();
  state.partner.remove ();
}

StructurePtr
stats_of (const RecordDemuxState &state)
{
  GstStructure *stats = nullptr;
  g_object_get (state.coded.restore (), "counters", &stats, nullptr);
  gst_structure_set_name (
      stats, "application/x-codedexposure-recorddemux-stats");
  return StructurePtr (stats);
}

PropertyTable<RecordDemuxState>
properties ()
{
  return {
      {"salvage", "Salvage",
          "Read from front to back, without the index, and go on behind what "
          "is damaged",
          kReadWriteReady, &RecordDemuxState::salvage},
      {"decode", "Decode",
          "Decode the frames; without it, they are as they are stored, with "
          "all "
          "that is known of them, and their pixels are not checked",
          kReadWriteReady, &RecordDemuxState::decode},
      {"threads", "Threads",
          "Threads of the decoder; 0: one for each processor", kReadWriteReady,
          &RecordDemuxState::threads, 0u, 64u},
      {"stats", "Statistics",
          "frames, frames-damaged (their pixels are not those that were "
          "recorded), frames-unknown (without a line in the track), "
          "frames-missing (in the track only), lines-damaged",
          kReadOnly, stats_of}};
}

void
add_demuxer (Self *self)
{
  RecordDemuxState &state = self->state;
  state.file = gst_element_factory_make ("matroskademux", nullptr);
  if (!state.file)
    return;
  gst_bin_add (GST_BIN (self), state.file);
  g_signal_connect (state.file, "pad-added", G_CALLBACK (on_pad_added), self);
  g_signal_connect (
      state.file, "no-more-pads", G_CALLBACK (on_no_more_pads), self);
  const auto sink = pad_of (state.file, "sink");
  gst_pad_add_probe (
      sink.get (), GST_PAD_PROBE_TYPE_QUERY_UPSTREAM, on_query, self, nullptr);
  gst_pad_add_probe (
      sink.get (), GST_PAD_PROBE_TYPE_BUFFER, on_bytes, self, nullptr);
  state.take_event = GST_PAD_EVENTFUNC (sink.get ());
  gst_pad_set_event_function (sink.get (), take_event);
  state.chain = GST_PAD_CHAINFUNC (sink.get ());
  gst_pad_set_chain_function (sink.get (), chain);
}

void
set_up_instance (Self *self)
{
  RecordDemuxState &state = self->state;
  state.coded.begin (1);
  GstElement *restore = state.coded.restore ();
  add_demuxer (self);
  add_ghost_pad (GST_ELEMENT (self), "sink", state.file);
  add_ghost_pad (GST_ELEMENT (self), "src", nullptr);
  gst_pad_add_probe (pad_of (restore, "src").get (), GST_PAD_PROBE_TYPE_BUFFER,
      on_frame, self, nullptr);
}

constexpr StateHooks kRun{.begin = begin_run, .end = end_run};

void
set_up (gpointer klass)
{
  install_state<GstCodedExposureRecordDemux, properties> (klass);
  install_run<kRun> (klass);
  describe_element (klass, "Coded exposure recording demuxer", "Codec/Demuxer",
      "A recording to coded frames, with all that is known of each frame", {});
  add_pad_template (klass, "src", {.caps = kPartCaps});
  add_pad_template (klass, "sink", {.caps = "video/x-matroska"});
  GST_BIN_CLASS (klass)->handle_message = handle_message;
}

} // namespace

GST_ELEMENT_REGISTER_DEFINE (codedexposure_recorddemux,
    "codedexposure-recorddemux", GST_RANK_NONE,
    (type_of<Self, set_up, set_up_instance> (
        "GstCodedExposureRecordDemux", GST_TYPE_BIN)))
