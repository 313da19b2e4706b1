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
#include <string_view>
#include <utility>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "common/element.h"
#include "common/elements.h"
#include "common/raii.h"
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
  /** Of raw frames with 16-bit pixels, and their bytes; null: of others. */
  CapsPtr deep_caps;
  gsize frame_bytes = 0;
  GstClockTime decoded = GST_CLOCK_TIME_NONE; ///< time of the last frame
  ClusterGate gate;                           ///< of what is salvaged
};

struct RecordDemuxState {
  /* Object lock: */
  bool salvage = false;
  bool decode = true;
  guint threads = 0;

  /* Of the bin: */
  GstElement *file = nullptr; ///< null: matroskademux is missing
  GstElement *restore = nullptr;
  GstPadChainFunction chain = nullptr; ///< of the demuxer

  std::atomic<bool> has_new_frame = false;

  /* Streaming thread of the demuxer, and changes of the state: */
  Stream stream;
  GstElement *queue = nullptr, *decoder = nullptr;
};

struct GstCodedExposureRecordDemux : Instance<GstBin, RecordDemuxState> {
};
using Self = GstCodedExposureRecordDemux;

/* ----------------------------------------------------------- raw frames -- */

/* The demuxer knows these only since GStreamer 1.26. */
CapsPtr
deep_caps_of (const MatroskaHead &head)
{
  GstVideoInfo info;
  gst_video_info_set_format (&info, GST_VIDEO_FORMAT_GRAY16_LE,
      guint (head.size.width), guint (head.size.height));
  if (head.duration > 0)
    gst_video_guess_framerate (
        GstClockTime (head.duration), &info.fps_n, &info.fps_d);
  return CapsPtr (gst_video_info_to_caps (&info));
}

bool
is_aligned (GstBuffer *frame)
{
  constexpr guintptr kAlignment = 16;
  GstMapInfo map;
  if (gst_buffer_n_memory (frame) != 1 ||
      !gst_buffer_map (frame, &map, GST_MAP_READ))
    return false;
  const bool aligned = guintptr (map.data) % kAlignment == 0;
  gst_buffer_unmap (frame, &map);
  return aligned;
}

/* In the file, a frame may begin at an odd byte. */
GstBuffer *
aligned (GstBuffer *frame)
{
  if (is_aligned (frame))
    return frame;
  GstBuffer *copy =
      gst_buffer_new_allocate (nullptr, gst_buffer_get_size (frame), nullptr);
  GstMapInfo map;
  gst_buffer_map (copy, &map, GST_MAP_WRITE);
  gst_buffer_extract (frame, 0, map.data, map.size);
  gst_buffer_unmap (copy, &map);
  gst_buffer_copy_into (copy, frame, GST_BUFFER_COPY_METADATA, 0, -1);
  gst_buffer_unref (frame);
  return copy;
}

/* Frames that are cut off are dropped; the track says that they are missing. */
GstPadProbeReturn
on_deep_frame (GstPad *, GstPadProbeInfo *info, gpointer self) noexcept
{
  const Stream &stream = state_in<Self> (self).stream;
  if (GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM) {
    GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
    if (GST_EVENT_TYPE (event) == GST_EVENT_CAPS) {
      gst_event_unref (event);
      info->data = gst_event_new_caps (stream.deep_caps.get ());
    }
    return GST_PAD_PROBE_OK;
  }
  GstBuffer *frame = GST_PAD_PROBE_INFO_BUFFER (info);
  const gsize size = gst_buffer_get_size (frame);
  if (size < stream.frame_bytes)
    return GST_PAD_PROBE_DROP;
  if (size == stream.frame_bytes) {
    info->data = aligned (frame);
    return GST_PAD_PROBE_OK;
  }
  POST_ERROR (self, STREAM, DECODE,
      "A raw frame has " + std::to_string (size) +
          " bytes, but by the head of "
          "the file it should have " +
          std::to_string (stream.frame_bytes) +
          ": the head is damaged. Use another copy of the recording.");
  gst_clear_buffer (reinterpret_cast<GstBuffer **> (&info->data));
  GST_PAD_PROBE_INFO_FLOW_RETURN (info) = GST_FLOW_ERROR;
  return GST_PAD_PROBE_HANDLED;
}

/* False: their format is none of coded frames. */
bool
take_raw (GstElement *self, GstPad *pad, const GstCaps *caps)
{
  Stream &stream = state_in<Self> (self).stream;
  const GstStructure *structure = gst_caps_get_structure (caps, 0);
  const gchar *format = gst_structure_get_string (structure, "format");
  if (gst_structure_has_name (structure, "video/x-raw") &&
      g_strcmp0 (format, "GRAY16_LE") != 0)
    return g_strcmp0 (format, "GRAY8") == 0;
  if (!stream.head || stream.head->pixel_bytes != 2 ||
      stream.head->size.width < 1 || stream.head->size.height < 1)
    return false;
  stream.deep_caps = deep_caps_of (*stream.head);
  GstVideoInfo info;
  gst_video_info_from_caps (&info, stream.deep_caps.get ());
  stream.frame_bytes = GST_VIDEO_INFO_SIZE (&info);
  gst_pad_add_probe (pad,
      GstPadProbeType (
          GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM),
      on_deep_frame, self, nullptr);
  return true;
}

/* ------------------------------------------------------- encoded frames -- */

GstStaticCaps file_caps = GST_STATIC_CAPS ("timestamp/x-file");

/* A decoder gives the time of the frame before to one that is earlier, and that
 * of the segment's start to one that begins before it and lasts longer. */
GstPadProbeReturn
on_encoded (GstPad *, GstPadProbeInfo *info, gpointer) noexcept
{
  GstBuffer *frame =
      gst_buffer_make_writable (GST_PAD_PROBE_INFO_BUFFER (info));
  info->data = frame;
  const CapsPtr caps (gst_static_caps_get (&file_caps));
  if (GST_BUFFER_PTS_IS_VALID (frame))
    gst_buffer_add_reference_timestamp_meta (
        frame, caps.get (), GST_BUFFER_PTS (frame), GST_CLOCK_TIME_NONE);
  return GST_PAD_PROBE_OK;
}

GstPadProbeReturn
on_decoded (GstPad *, GstPadProbeInfo *info, gpointer self) noexcept
{
  GstBuffer *frame =
      gst_buffer_make_writable (GST_PAD_PROBE_INFO_BUFFER (info));
  info->data = frame;
  const CapsPtr caps (gst_static_caps_get (&file_caps));
  auto *own = gst_buffer_get_reference_timestamp_meta (frame, caps.get ());
  if (!own)
    return GST_PAD_PROBE_OK;
  const GstClockTime before = std::exchange (
      state_in<Self> (self).stream.decoded, GST_BUFFER_PTS (frame));
  if (GST_BUFFER_PTS (frame) == before ||
      GST_BUFFER_PTS (frame) > own->timestamp)
    GST_BUFFER_PTS (frame) = own->timestamp;
  gst_buffer_remove_meta (frame, &own->parent);
  return GST_PAD_PROBE_OK;
}

/* --------------------------------------------------------------- tracks -- */

/* Before restore; none, if frames are raw or stay encoded. False, with an
 * error: it is no codec of a recording, or is not installed. */
bool
make_decoder (GstElement *self, GstPad *pad, const GstCaps *caps)
{
  auto &state = state_in<Self> (self);
  const GstStructure *structure = gst_caps_get_structure (caps, 0);
  const std::string_view kind = gst_structure_get_name (structure);
  const gchar *id = gst_structure_get_string (structure, "codec-id");
  const std::string codec (id ? id : kind);
  const bool is_raw = kind == "video/x-raw" || codec == "V_UNCOMPRESSED";
  if (is_raw && take_raw (self, pad, caps))
    return true;
  if (kind != "video/x-ffv") {
    POST_ERROR (self, STREAM, WRONG_TYPE,
        "The file has " + (is_raw ? "raw frames that are not grey" : codec) +
            ", but coded frames are recorded as FFV1 or raw grey. Use a "
            "recording of coded frames.");
    return false;
  }
  if (!locked (self, [&] { return state.decode; }))
    return true;
  state.decoder = gst_element_factory_make ("avdec_ffv1", nullptr);
  if (!state.decoder) {
    POST_ERROR (self, CORE, MISSING_PLUGIN, missing ("avdec_ffv1"));
    return false;
  }
  const int threads = locked (self, [&] { return int (state.threads); });
  g_object_set (
      state.decoder, "max-threads", threads, "max-errors", -1, nullptr);
  gst_pad_add_probe (pad_of (state.decoder, "sink").get (),
      GST_PAD_PROBE_TYPE_BUFFER, on_encoded, nullptr, nullptr);
  gst_pad_add_probe (pad_of (state.decoder, "src").get (),
      GST_PAD_PROBE_TYPE_BUFFER, on_decoded, self, nullptr);
  gst_bin_add (GST_BIN (self), state.decoder);
  return true;
}

/* The demuxer reads in a thread of its own. */
void
add_video (GstElement *self, GstPad *pad, const GstCaps *caps)
{
  constexpr guint64 kNoLimit = 0;
  auto &state = state_in<Self> (self);
  if (!make_decoder (self, pad, caps))
    return;
  state.queue = gst_element_factory_make ("queue", nullptr);
  g_object_set (state.queue, "max-size-buffers", 8u, "max-size-bytes", 0u,
      "max-size-time", kNoLimit, nullptr);
  gst_bin_add (GST_BIN (self), state.queue);
  if (state.decoder) {
    gst_element_link_pads (state.decoder, "src", state.restore, "sink");
    gst_element_link_pads (state.queue, "src", state.decoder, "sink");
    gst_element_sync_state_with_parent (state.decoder);
  } else
    gst_element_link_pads (state.queue, "src", state.restore, "sink");
  gst_element_sync_state_with_parent (state.queue);
  gst_pad_link_full (
      pad, pad_of (state.queue, "sink").get (), GST_PAD_LINK_CHECK_NOTHING);
}

void
on_pad_added (GstElement *, GstPad *pad, gpointer self)
{
  auto &state = state_in<Self> (self);
  const CapsPtr caps (gst_pad_query_caps (pad, nullptr));
  const GstStructure *structure = gst_caps_get_structure (caps.get (), 0);
  if (g_str_has_prefix (GST_OBJECT_NAME (pad), "video_") && !state.queue)
    add_video (GST_ELEMENT (self), pad, caps.get ());
  else if (gst_structure_has_name (structure, "text/x-raw"))
    gst_pad_link (pad, pad_of (state.restore, "track").get ());
}

void
on_no_more_pads (GstElement *file, gpointer self)
{
  const auto is_video = [] (GstElement *, GstPad *pad, gpointer) {
    return gboolean (!g_str_has_prefix (GST_OBJECT_NAME (pad), "video_"));
  };
  if (gst_element_foreach_src_pad (file, is_video, nullptr))
    POST_ERROR (self, STREAM, WRONG_TYPE,
        "The file has no video. Use a recording of coded frames.");
}

void
remove_tracks (GstElement *self)
{
  auto &state = state_in<Self> (self);
  for (GstElement **part : {&state.queue, &state.decoder})
    if (*part) {
      gst_element_set_state (*part, GST_STATE_NULL);
      gst_bin_remove (GST_BIN (self), *part);
      *part = nullptr;
    }
}

/* ---------------------------------------------------------------- bytes -- */

bool
salvages (gpointer self)
{
  const ObjectLock lock (self);
  return state_in<Self> (self).salvage;
}

/* A demuxer passes over some bytes of a head without reading them. */
void
read_head (RecordDemuxState &state, guint64 at, GstBuffer *bytes)
{
  constexpr gsize kLongestHead = 1 << 20;
  Stream &stream = state.stream;
  const gsize size = gst_buffer_get_size (bytes);
  if (stream.head || at >= kLongestHead)
    return;
  const gsize part = std::min (size, gsize (kLongestHead - at));
  stream.begin.resize (std::max (stream.begin.size (), at + part));
  gst_buffer_extract (bytes, 0, stream.begin.data () + at, part);
  stream.head = matroska_head (stream.begin);
  if (stream.head) {
    g_object_set (state.restore, "tick", guint64 (stream.head->tick), nullptr);
    stream.begin.clear ();
  }
}

/* A demuxer collects an element of any length that a stream claims. */
GstPadProbeReturn
on_bytes (GstPad *, GstPadProbeInfo *info, gpointer self) noexcept
{
  constexpr gsize kMostWithoutFrame = gsize (256) << 20;
  auto &state = state_in<Self> (self);
  Stream &stream = state.stream;
  GstBuffer *bytes = GST_PAD_PROBE_INFO_BUFFER (info);
  const gsize size = gst_buffer_get_size (bytes);
  const bool pulled = GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_PULL;
  read_head (state, pulled ? info->offset : stream.pushed, bytes);
  stream.pushed += size;
  if (state.has_new_frame.exchange (false))
    stream.bytes_without_frame = 0;
  stream.bytes_without_frame += size;
  if (stream.bytes_without_frame <= kMostWithoutFrame)
    return GST_PAD_PROBE_OK;
  POST_ERROR (self, STREAM, DEMUX,
      "256 MB arrived without a frame: this is no stream of coded frames, or "
      "it is damaged.");
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
GstFlowReturn
chain (GstPad *pad, GstObject *parent, GstBuffer *buffer) noexcept
{
  const ObjectPtr<GstObject> self (gst_object_get_parent (parent));
  auto &state = state_in<Self> (self.get ());
  if (salvages (self.get ()))
    buffer = through_gate (state.stream.gate, buffer);
  const GstFlowReturn flow =
      buffer ? state.chain (pad, parent, buffer) : GST_FLOW_OK;
  if (!state.stream.has_failed)
    return flow;
  const auto end = [] (GstElement *, GstPad *src, gpointer) {
    gst_pad_push_event (src, gst_event_new_eos ());
    return gboolean (TRUE);
  };
  gst_element_foreach_src_pad (state.file, end, nullptr);
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
    state.stream.has_failed = salvages (self) && state.queue;
    GstMessage *own =
        container_message (self, message, state.stream.has_failed);
    gst_message_unref (message);
    message = own;
  }
  parent_class<GstBinClass> (bin)->handle_message (bin, message);
}

/* -------------------------------------------------------------- element -- */

bool
begin_run (GstElement *self)
{
  auto &state = state_in<Self> (self);
  state.stream = {};
  state.has_new_frame = false;
  /* Before the demuxer, to which it is not linked yet. */
  if (state.file)
    return gst_element_set_state (state.restore, GST_STATE_PAUSED) !=
           GST_STATE_CHANGE_FAILURE;
  POST_ERROR (self, CORE, MISSING_PLUGIN, missing ("matroskademux"));
  return false;
}

void
end_run (GstElement *self)
{
  remove_tracks (self);
}

StructurePtr
stats_of (const RecordDemuxState &state)
{
  GstStructure *stats = nullptr;
  g_object_get (state.restore, "counters", &stats, nullptr);
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
  state.chain = GST_PAD_CHAINFUNC (sink.get ());
  gst_pad_set_chain_function (sink.get (), chain);
}

void
set_up_instance (Self *self)
{
  RecordDemuxState &state = self->state;
  state.restore = make_part (gst_coded_exposure_restore_get_type ());
  gst_bin_add (GST_BIN (self), state.restore);
  add_demuxer (self);
  add_ghost_pad (GST_ELEMENT (self), "sink", state.file);
  add_ghost_pad (GST_ELEMENT (self), "src", state.restore);
  gst_pad_add_probe (pad_of (state.restore, "src").get (),
      GST_PAD_PROBE_TYPE_BUFFER, on_frame, self, nullptr);
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
