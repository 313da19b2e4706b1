/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-rawdec
 * @title: codedexposure-rawdec
 * @short_description: Raw frames of 9 to 16 bits from Matroska
 *
 * Gives the raw frames with 16-bit pixels that #codedexposure-matroskamux wrote
 * their caps again, which `matroskademux` does not know before GStreamer 1.26;
 * frames that have them pass and are only aligned. For the others, the size and
 * the rate are those in the tag with the schedule or, if that is missing
 * because the file was cut off, those in the head of the file. `decodebin`
 * finds this element.
 *
 * ## Example pipeline
 * |[
 * gst-launch-1.0 filesrc location=raw.mkv ! matroskademux name=file \
 *     ! codedexposure-rawdec ! codedexposure-restore name=restore \
 *     ! codedexposure-demux ! queue ! videoconvert ! autovideosink \
 *     file.subtitle_0 ! restore.track
 * ]|
 *
 * Since: 0.1
 */
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "common/element.h"
#include "common/elements.h"
#include "common/raii.h"
#include "common/tag.h"
#include "record/matroska.h"

using namespace codedexposure;
using namespace codedexposure::gst;

G_DECLARE_FINAL_TYPE (GstCodedExposureRawDec, gst_coded_exposure_raw_dec, GST,
    CODED_EXPOSURE_RAW_DEC, GstElement)

namespace
{

/** Streaming thread, and changes of the state, which exclude it. */
struct DecoderState {
  GstPad *src = nullptr; ///< of the element
  std::optional<StreamSetup> setup;
  GstVideoInfo info = {};
  bool has_caps = false;         ///< and they were pushed
  std::vector<EventPtr> pending; ///< what must follow the caps
};

} // namespace

struct _GstCodedExposureRawDec {
  GstElement parent;
  DecoderState *state;
};

G_DEFINE_TYPE (
    GstCodedExposureRawDec, gst_coded_exposure_raw_dec, GST_TYPE_ELEMENT)
GST_ELEMENT_REGISTER_DEFINE (codedexposure_rawdec, "codedexposure-rawdec",
    GST_RANK_PRIMARY, gst_coded_exposure_raw_dec_get_type ())

namespace
{

void
push_pending (DecoderState &state)
{
  for (EventPtr &event : std::exchange (state.pending, {}))
    gst_pad_push_event (state.src, event.release ());
}

/* None: it is no file, or has no such head. */
std::optional<RawFormat>
format_in_file (GstElement *self)
{
  const ObjectPtr<GstPad> sink (gst_element_get_static_pad (self, "sink"));
  const QueryPtr query (gst_query_new_uri ());
  if (!gst_pad_peer_query (sink.get (), query.get ()))
    return std::nullopt;
  gchar *uri = nullptr;
  gst_query_parse_uri (query.get (), &uri);
  const CharPtr owned (uri);
  const CharPtr path (
      uri ? g_filename_from_uri (uri, nullptr, nullptr) : nullptr);
  const auto format = path ? raw_format (path.get ())
                           : Result<RawFormat> (Error{"there is no file"});
  return format ? std::optional (*format) : std::nullopt;
}

/* False: not known. */
bool
find_format (GstElement *self)
{
  DecoderState &state = state_in<GstCodedExposureRawDec> (self);
  Extent size;
  if (state.setup && state.setup->size)
    size = *state.setup->size;
  else if (const auto format = format_in_file (self))
    size = format->size;
  else
    return false;
  gst_video_info_set_format (&state.info, GST_VIDEO_FORMAT_GRAY16_LE,
      guint (size.width), guint (size.height));
  if (state.setup && state.setup->rate) {
    state.info.fps_n = int (state.setup->rate->num);
    state.info.fps_d = int (state.setup->rate->den);
  } else if (const auto format = format_in_file (self);
             format && format->duration > 0)
    gst_video_guess_framerate (
        GstClockTime (format->duration), &state.info.fps_n, &state.info.fps_d);
  return true;
}

/* The caps, and what precedes them in a stream. */
void
push_caps (DecoderState &state, GstEvent *caps)
{
  if (!state.pending.empty () &&
      GST_EVENT_TYPE (state.pending.front ().get ()) ==
          GST_EVENT_STREAM_START) {
    gst_pad_push_event (state.src, state.pending.front ().release ());
    state.pending.erase (state.pending.begin ());
  }
  gst_pad_push_event (state.src, caps);
  state.has_caps = true;
}

/* False, with an error: the size is not known. */
bool
find_caps (GstElement *self, gsize frame)
{
  DecoderState &state = state_in<GstCodedExposureRawDec> (self);
  if (!find_format (self)) {
    POST_ERROR (self, STREAM, DECODE,
        "The size of the raw frames is not known, because the stream has no "
        "readable schedule. FFmpeg reads them: ffmpeg -i IN.mkv -map 0:v -c:v "
        "ffv1 OUT.mkv");
    return false;
  }
  if (frame != GST_VIDEO_INFO_SIZE (&state.info)) {
    POST_ERROR (self, STREAM, DECODE,
        "A raw frame has " + std::to_string (frame) +
            " bytes, but 16-bit frames of " +
            std::to_string (state.info.width) + "x" +
            std::to_string (state.info.height) + " have " +
            std::to_string (GST_VIDEO_INFO_SIZE (&state.info)) +
            ". Record the stream again.");
    return false;
  }
  const CapsPtr caps (gst_video_info_to_caps (&state.info));
  push_caps (state, gst_event_new_caps (caps.get ()));
  return true;
}

/* In the file, a frame may begin at an odd byte. */
BufferPtr
aligned_copy (GstBuffer *frame)
{
  const gsize size = gst_buffer_get_size (frame);
  BufferPtr copy (gst_buffer_new_allocate (nullptr, size, nullptr));
  GstMapInfo map;
  if (!copy || !gst_buffer_map (copy.get (), &map, GST_MAP_WRITE))
    return nullptr;
  gst_buffer_extract (frame, 0, map.data, size);
  gst_buffer_unmap (copy.get (), &map);
  gst_buffer_copy_into (copy.get (), frame,
      GstBufferCopyFlags (GST_BUFFER_COPY_METADATA), 0, gsize (-1));
  return copy;
}

GstFlowReturn
chain (GstPad *, GstObject *parent, GstBuffer *frame) noexcept
{
  const BufferPtr owned (frame);
  GstElement *self = GST_ELEMENT (parent);
  DecoderState &state = state_in<GstCodedExposureRawDec> (self);
  const gsize size = gst_buffer_get_size (frame);
  if (!state.has_caps && !find_caps (self, size))
    return GST_FLOW_ERROR;
  push_pending (state);
  if (size < GST_VIDEO_INFO_SIZE (&state.info))
    return GST_FLOW_OK; // cut off; the track says that it is missing
  BufferPtr copy = aligned_copy (frame);
  if (!copy) {
    POST_ERROR (self, RESOURCE, NO_SPACE_LEFT, "There is no memory left.");
    return GST_FLOW_ERROR;
  }
  return gst_pad_push (state.src, copy.release ());
}

void
note_setup (DecoderState &state, GstEvent *event)
{
  GstTagList *tags = nullptr;
  gst_event_parse_tag (event, &tags);
  if (const auto setup = setup_from_tags (tags); setup && *setup)
    state.setup = setup->value ();
}

/* Those of a demuxer that knows the format; others say too little. */
void
take_caps (DecoderState &state, GstEvent *event)
{
  EventPtr owned (event);
  GstCaps *caps = nullptr;
  gst_event_parse_caps (event, &caps);
  if (gst_structure_has_name (
          gst_caps_get_structure (caps, 0), "video/x-raw") &&
      gst_video_info_from_caps (&state.info, caps))
    push_caps (state, owned.release ());
}

gboolean
on_event (GstPad *pad, GstObject *parent, GstEvent *event) noexcept
{
  DecoderState &state = state_in<GstCodedExposureRawDec> (parent);
  const GstEventType type = GST_EVENT_TYPE (event);
  switch (type) {
  case GST_EVENT_CAPS:
    take_caps (state, event);
    return TRUE;
  case GST_EVENT_TAG:
    note_setup (state, event);
    break;
  case GST_EVENT_FLUSH_STOP:
  case GST_EVENT_EOS:
    push_pending (state);
    break;
  default:
    break;
  }
  if (state.has_caps ||
      !(gst_event_type_get_flags (type) & GST_EVENT_TYPE_SERIALIZED) ||
      type == GST_EVENT_EOS || type == GST_EVENT_FLUSH_STOP)
    return gst_pad_event_default (pad, parent, event);
  state.pending.emplace_back (event);
  return TRUE;
}

bool
begin_run (GstElement *element)
{
  DecoderState &state = state_in<GstCodedExposureRawDec> (element);
  state.setup.reset ();
  state.has_caps = false;
  state.pending.clear ();
  return true;
}

void
end_run (GstElement *element)
{
  begin_run (element);
}

const PropertyTable<DecoderState> &
properties ()
{
  static const PropertyTable<DecoderState> table{};
  return table;
}

} // namespace

static void
gst_coded_exposure_raw_dec_init (GstCodedExposureRawDec *self)
{
  self->state = new DecoderState ();
  auto *klass = GST_ELEMENT_GET_CLASS (self);
  GstPad *sink = gst_pad_new_from_template (
      gst_element_class_get_pad_template (klass, "sink"), "sink");
  gst_pad_set_chain_function (sink, chain);
  gst_pad_set_event_function (sink, on_event);
  gst_element_add_pad (GST_ELEMENT (self), sink);
  self->state->src = gst_pad_new_from_template (
      gst_element_class_get_pad_template (klass, "src"), "src");
  gst_pad_use_fixed_caps (self->state->src);
  gst_element_add_pad (GST_ELEMENT (self), self->state->src);
}

static void
gst_coded_exposure_raw_dec_class_init (GstCodedExposureRawDecClass *klass)
{
  install_state<GstCodedExposureRawDec, properties> (klass);
  install_run<begin_run, end_run> (klass);
  describe_element (klass, "Coded exposure raw decoder", "Codec/Decoder/Video",
      "Raw frames with 16-bit pixels from Matroska", {});
  add_pad_template (klass, "sink",
      {.caps = "video/x-unknown,codec-id=(string)V_UNCOMPRESSED;"
               "video/x-raw,format=GRAY16_LE"});
  add_pad_template (klass, "src", {.caps = "video/x-raw,format=GRAY16_LE"});
}
