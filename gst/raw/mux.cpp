/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-matroskamux
 * @title: codedexposure-matroskamux
 * @short_description: Matroska with coded frames and their track
 *
 * `matroskamux` with ticks of 1 µs, in which each frame stands beside its line
 * of the track, from live sources, too: since GStreamer 1.24, `matroskamux`
 * itself does not wait for live frames, so the lines of frames that come late,
 * because their encoder is slow, precede them by seconds, and the frames get
 * wrong times or no track at all.
 *
 * It also takes raw frames with 16-bit pixels (GRAY16_LE). In the file, these
 * are `V_UNCOMPRESSED` with the FourCC of FFmpeg for 16-bit grey, so FFmpeg and
 * programs that use it read them. Before GStreamer 1.26, `matroskademux` does
 * not know the format; #codedexposure-rawdec, which `decodebin` finds, gives
 * the frames their caps again. It needs the size of the frames, so their tag
 * must have it, as every schedule of a stream does.
 *
 * ## Example pipeline
 * |[
 * gst-launch-1.0 -e videotestsrc num-buffers=100 \
 *     ! video/x-raw,format=GRAY16_LE,framerate=100/1 ! codedexposure-sim \
 *     ! codedexposure-log name=log ! queue ! mux.video_0 \
 *     log.track ! queue ! mux.subtitle_0 \
 *     codedexposure-matroskamux name=mux ! filesink location=raw.mkv
 * ]|
 *
 * Since: 0.1
 */
#include <atomic>
#include <optional>
#include <string>
#include <string_view>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "common/element.h"
#include "common/elements.h"
#include "common/raii.h"
#include "common/tag.h"

using namespace codedexposure;
using namespace codedexposure::gst;

G_DECLARE_FINAL_TYPE (GstCodedExposureMatroskaMux,
    gst_coded_exposure_matroska_mux, GST, CODED_EXPOSURE_MATROSKA_MUX, GstBin)

namespace
{

struct MuxState {
  GstElement *mux = nullptr;         ///< of the bin
  bool is_streamable = false;        ///< setting; applied at the next run
  std::atomic<bool> is_deep = false; ///< 16-bit frames come
  /* Streaming thread of the frames: */
  std::optional<Extent> size;   ///< of the frames
  std::optional<Extent> tagged; ///< as the decoder will know it
  /* Streaming thread of the output: */
  bool is_marked = false; ///< the header has the FourCC
};

} // namespace

struct _GstCodedExposureMatroskaMux {
  GstBin parent;
  MuxState *state;
};

G_DEFINE_TYPE (
    GstCodedExposureMatroskaMux, gst_coded_exposure_matroska_mux, GST_TYPE_BIN)
GST_ELEMENT_REGISTER_DEFINE (codedexposure_matroskamux,
    "codedexposure-matroskamux", GST_RANK_NONE,
    gst_coded_exposure_matroska_mux_get_type ())

namespace
{

constexpr char kVideoCaps[] =
    "video/x-raw,format={GRAY8,GRAY16_LE};video/x-ffv";
/* The muxer takes any format of four letters as a FourCC. FFmpeg knows this one
 * by another, which is no text. */
constexpr char kDeep[] = "Y16 ";
constexpr std::string_view kInHeader = "\x2e\xb5\x24\x84Y16 ";
constexpr std::string_view kOfFfmpeg ("\x2e\xb5\x24\x84Y1\0\x10", 8);

bool
has_format (const GstCaps *caps, const char *format)
{
  const GstStructure *structure = gst_caps_get_structure (caps, 0);
  const gchar *own = gst_structure_get_string (structure, "format");
  return gst_structure_has_name (structure, "video/x-raw") && own &&
         std::string_view (own) == format;
}

/* What the inner muxer would refuse. */
GstPadProbeReturn
answer (GstQuery *query)
{
  GstCaps *caps = nullptr;
  if (GST_QUERY_TYPE (query) == GST_QUERY_ACCEPT_CAPS) {
    gst_query_parse_accept_caps (query, &caps);
    if (!has_format (caps, "GRAY16_LE") && !has_format (caps, kDeep))
      return GST_PAD_PROBE_OK;
    gst_query_set_accept_caps_result (query, TRUE);
    return GST_PAD_PROBE_HANDLED;
  }
  if (GST_QUERY_TYPE (query) != GST_QUERY_CAPS)
    return GST_PAD_PROBE_OK;
  const CapsPtr all (gst_caps_from_string (kVideoCaps));
  gst_query_parse_caps (query, &caps);
  const CapsPtr wanted (caps ? gst_caps_intersect_full (
                                   caps, all.get (), GST_CAPS_INTERSECT_FIRST)
                             : gst_caps_ref (all.get ()));
  gst_query_set_caps_result (query, wanted.get ());
  return GST_PAD_PROBE_HANDLED;
}

void
rename_format (MuxState &state, GstPadProbeInfo *info)
{
  auto *event = GST_PAD_PROBE_INFO_EVENT (info);
  GstCaps *caps = nullptr;
  gst_event_parse_caps (event, &caps);
  state.is_deep = has_format (caps, "GRAY16_LE");
  if (!state.is_deep)
    return;
  GstVideoInfo format;
  if (gst_video_info_from_caps (&format, caps))
    state.size = Extent{format.width, format.height};
  const CapsPtr renamed (gst_caps_copy (caps));
  gst_caps_set_simple (renamed.get (), "format", G_TYPE_STRING, kDeep, nullptr);
  gst_event_unref (event);
  info->data = gst_event_new_caps (renamed.get ());
}

void
note_size (MuxState &state, GstEvent *event)
{
  GstTagList *tags = nullptr;
  gst_event_parse_tag (event, &tags);
  if (const auto setup = setup_from_tags (tags); setup && *setup)
    state.tagged = setup->value ().size;
}

GstPadProbeReturn
on_video (GstPad *, GstPadProbeInfo *info, gpointer self) noexcept
{
  auto &state = state_in<GstCodedExposureMatroskaMux> (self);
  if (GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_QUERY_DOWNSTREAM)
    return GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_PUSH
               ? answer (GST_PAD_PROBE_INFO_QUERY (info))
               : GST_PAD_PROBE_OK;
  if (GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM) {
    auto *event = GST_PAD_PROBE_INFO_EVENT (info);
    if (GST_EVENT_TYPE (event) == GST_EVENT_CAPS)
      rename_format (state, info);
    if (GST_EVENT_TYPE (event) == GST_EVENT_TAG)
      note_size (state, event);
    return GST_PAD_PROBE_OK;
  }
  if (!state.is_deep || (state.size && state.size == state.tagged))
    return GST_PAD_PROBE_OK;
  POST_ERROR (self, STREAM, FORMAT,
      "Raw frames with 16-bit pixels could not be read again, because their "
      "stream has no schedule with their size. Set a schedule, or record FFV1");
  gst_buffer_unref (GST_PAD_PROBE_INFO_BUFFER (info));
  info->data = nullptr;
  GST_PAD_PROBE_INFO_FLOW_RETURN (info) = GST_FLOW_ERROR;
  return GST_PAD_PROBE_HANDLED;
}

/* The header comes before the first frame. */
GstPadProbeReturn
on_output (GstPad *, GstPadProbeInfo *info, gpointer self) noexcept
{
  constexpr gsize kLongestHeader = 1 << 20;
  auto &state = state_in<GstCodedExposureMatroskaMux> (self);
  GstBuffer *buffer = GST_PAD_PROBE_INFO_BUFFER (info);
  if (!state.is_deep || state.is_marked ||
      gst_buffer_get_size (buffer) > kLongestHeader)
    return GST_PAD_PROBE_OK;
  GstMapInfo map;
  if (!gst_buffer_map (buffer, &map, GST_MAP_READ))
    return GST_PAD_PROBE_OK;
  const auto at =
      std::string_view (reinterpret_cast<const char *> (map.data), map.size)
          .find (kInHeader);
  gst_buffer_unmap (buffer, &map);
  if (at == std::string_view::npos)
    return GST_PAD_PROBE_OK;
  buffer = gst_buffer_make_writable (buffer);
  info->data = buffer;
  gst_buffer_fill (buffer, at, kOfFfmpeg.data (), kOfFfmpeg.size ());
  state.is_marked = true;
  return GST_PAD_PROBE_OK;
}

/* A muxer of live streams writes a line of the track before its frame has
 * come. */
GstPadProbeReturn
on_latency (GstPad *, GstPadProbeInfo *info, gpointer) noexcept
{
  GstQuery *query = GST_PAD_PROBE_INFO_QUERY (info);
  if (GST_QUERY_TYPE (query) != GST_QUERY_LATENCY)
    return GST_PAD_PROBE_OK;
  gst_query_set_latency (query, FALSE, 0, GST_CLOCK_TIME_NONE);
  return GST_PAD_PROBE_HANDLED;
}

GstPad *
request_new_pad (GstElement *element, GstPadTemplate *templ, const gchar *name,
    const GstCaps *) noexcept
{
  GstElement *mux = state_in<GstCodedExposureMatroskaMux> (element).mux;
  const ObjectPtr<GstPad> inner (gst_element_request_pad_simple (
      mux, name ? name : GST_PAD_TEMPLATE_NAME_TEMPLATE (templ)));
  if (!inner)
    return nullptr;
  gst_pad_add_probe (inner.get (), GST_PAD_PROBE_TYPE_QUERY_UPSTREAM,
      on_latency, nullptr, nullptr);
  if (g_str_has_prefix (GST_PAD_TEMPLATE_NAME_TEMPLATE (templ), "video"))
    gst_pad_add_probe (inner.get (),
        GstPadProbeType (GST_PAD_PROBE_TYPE_BUFFER |
                         GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM |
                         GST_PAD_PROBE_TYPE_QUERY_DOWNSTREAM),
        on_video, element, nullptr);
  GstPad *pad = gst_ghost_pad_new_from_template (
      GST_OBJECT_NAME (inner.get ()), inner.get (), templ);
  gst_pad_set_active (pad, TRUE);
  gst_element_add_pad (element, pad);
  return pad;
}

void
release_pad (GstElement *element, GstPad *pad) noexcept
{
  const ObjectPtr<GstPad> inner (
      gst_ghost_pad_get_target (GST_GHOST_PAD (pad)));
  gst_element_remove_pad (element, pad);
  if (inner)
    gst_element_release_request_pad (
        state_in<GstCodedExposureMatroskaMux> (element).mux, inner.get ());
}

bool
begin_run (GstElement *element)
{
  auto &state = state_in<GstCodedExposureMatroskaMux> (element);
  state.is_deep = state.is_marked = false;
  state.size.reset ();
  state.tagged.reset ();
  if (state.mux) {
    g_object_set (
        state.mux, "streamable", gboolean (state.is_streamable), nullptr);
    return true;
  }
  POST_ERROR (element, CORE, MISSING_PLUGIN,
      "matroskamux is missing; install gstreamer1.0-plugins-good");
  return false;
}

void
end_run (GstElement *)
{
}

const PropertyTable<MuxState> &
properties ()
{
  static const PropertyTable<MuxState> table{{"streamable", "Streamable",
      "Write for a network, without an index and without going back",
      kReadWriteReady, &MuxState::is_streamable}};
  return table;
}

} // namespace

static void
gst_coded_exposure_matroska_mux_init (GstCodedExposureMatroskaMux *self)
{
  self->state = new MuxState ();
  GstElement *mux = gst_element_factory_make ("matroskamux", nullptr);
  if (!mux)
    return;
  self->state->mux = mux;
  /* Every frame can be decoded alone; with ticks of 1 µs it has its own
   * cluster. */
  g_object_set (mux, "timecodescale", gint64 (1000), nullptr);
  gst_bin_add (GST_BIN (self), mux);
  const ObjectPtr<GstPad> inner (gst_element_get_static_pad (mux, "src"));
  gst_pad_add_probe (
      inner.get (), GST_PAD_PROBE_TYPE_BUFFER, on_output, self, nullptr);
  gst_element_add_pad (
      GST_ELEMENT (self), gst_ghost_pad_new ("src", inner.get ()));
}

static void
gst_coded_exposure_matroska_mux_class_init (
    GstCodedExposureMatroskaMuxClass *klass)
{
  install_state<GstCodedExposureMatroskaMux, properties> (klass);
  install_run<begin_run, end_run> (klass);
  describe_element (klass, "Coded exposure Matroska muxer", "Codec/Muxer",
      "Matroska with coded frames, also raw ones with 16-bit pixels, beside "
      "the lines of their track",
      {});
  add_pad_template (klass, "src", {.caps = "video/x-matroska"});
  add_pad_template (klass, "video_%u",
      {.presence = GST_PAD_REQUEST,
          .caps = kVideoCaps,
          .direction = GST_PAD_SINK});
  add_pad_template (klass, "subtitle_%u",
      {.presence = GST_PAD_REQUEST,
          .caps = "text/x-raw,format=utf8",
          .direction = GST_PAD_SINK});
  GST_ELEMENT_CLASS (klass)->request_new_pad = request_new_pad;
  GST_ELEMENT_CLASS (klass)->release_pad = release_pad;
}
