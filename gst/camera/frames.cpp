/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-camerasrc, frame by frame: memory, pixels, time. */
#include "camerasrc.h"
#include "common/meta.h"

#define GST_CAT_DEFAULT camerasrc_debug

namespace codedexposure::gst::camera
{

namespace
{

/* aravissrc gives all formats of more than 8 bits the caps of Mono16, and then
 * sets Mono16, which many cameras do not have. It is asked for Mono8 instead;
 * the features that it sets last choose the format. */
constexpr const char *kAsked = "GRAY8", *kSent = "GRAY16_LE";

CapsPtr
with_format (const GstCaps *caps, const char *from, const char *to)
{
  GstCaps *changed = gst_caps_copy (caps);
  for (guint i = 0; i < gst_caps_get_size (changed); i++) {
    GstStructure *structure = gst_caps_get_structure (changed, i);
    if (g_strcmp0 (gst_structure_get_string (structure, "format"), from) == 0)
      gst_structure_set (structure, "format", G_TYPE_STRING, to, nullptr);
  }
  return CapsPtr (changed);
}

bool
is_deep (GstCodedExposureCameraSrc *self)
{
  const auto format = parse_mono_format (settings_of (self).pixel_format);
  return format && *format != MonoFormat::mono8;
}

/* What downstream takes, in the words of aravissrc, which has Mono16 alone if
 * its camera has no Mono8. */
void
answer_caps (GstCodedExposureCameraSrc *self, GstQuery *query)
{
  GstCaps *offered = nullptr;
  gst_query_parse_caps (query, &offered);
  const CapsPtr sent (offered ? with_format (offered, kAsked, kSent) : nullptr);
  const CapsPtr wanted (gst_pad_query_caps (
      pad_of (state (self).filter, "sink").get (), sent.get ()));
  const bool has_mono8 = !offered || !gst_caps_is_equal (offered, sent.get ());
  gst_query_set_caps_result (query,
      with_format (wanted.get (), kSent, has_mono8 ? kAsked : kSent).get ());
}

bool
take_caps (GstCodedExposureCameraSrc *self, GstCaps *caps)
{
  Stream &stream = state (self).stream;
  GstVideoInfo info;
  if (!gst_video_info_from_caps (&info, caps))
    return true; // downstream refuses them
  Result<OwnedFrames> frames =
      OwnedFrames::make (info, settings_of (self).pixel_format);
  if (!frames)
    return refuse_settings (self, frames.error ().message);
  stream.frames = *std::move (frames);
  stream.exposure = exposure_of_camera (self);
  stream.caps.reset (gst_caps_ref (caps));
  return true;
}

/* A restarted source begins a stream of its own; to downstream it is the same
 * one. Returns whether the event goes on. */
bool
passes (GstCodedExposureCameraSrc *self, GstPadProbeInfo *info)
{
  CameraState &st = state (self);
  Stream &stream = st.stream;
  GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
  switch (GST_EVENT_TYPE (event)) {
  case GST_EVENT_EOS:
    return !locked (st.lock, [&st] { return st.away; });
  case GST_EVENT_STREAM_START:
    return !std::exchange (stream.started, true);
  case GST_EVENT_CAPS: {
    if (is_deep (self)) {
      info->data = gst_event_new_caps (
          with_format (caps_of (event), kAsked, kSent).get ());
      gst_event_unref (std::exchange (event, GST_PAD_PROBE_INFO_EVENT (info)));
    }
    GstCaps *caps = caps_of (event);
    return !(stream.caps && gst_caps_is_equal (caps, stream.caps.get ())) &&
           take_caps (self, caps);
  }
  case GST_EVENT_SEGMENT: {
    const GstSegment *segment = segment_of (event);
    if (stream.segment && gst_segment_is_equal (segment, &*stream.segment))
      return false;
    stream.segment = *segment;
    return true;
  }
  case GST_EVENT_QOS:
    return false;
  default:
    return true;
  }
}

/* aravissrc answers some queries only between two frames; their answer, of a
 * live camera, is no. It allocates its frames itself. */
GstPadProbeReturn
take_query (GstCodedExposureCameraSrc *self, GstPadProbeInfo *info)
{
  GstQuery *query = GST_PAD_PROBE_INFO_QUERY (info);
  switch (GST_QUERY_TYPE (query)) {
  case GST_QUERY_ALLOCATION:
  case GST_QUERY_CONVERT:
  case GST_QUERY_DURATION:
  case GST_QUERY_POSITION:
  case GST_QUERY_SEEKING:
  case GST_QUERY_SEGMENT:
    return GST_PAD_PROBE_DROP;
  case GST_QUERY_CAPS:
    if (!is_deep (self) || !(info->type & GST_PAD_PROBE_TYPE_QUERY_DOWNSTREAM))
      return GST_PAD_PROBE_OK;
    answer_caps (self, query);
    return GST_PAD_PROBE_HANDLED;
  default:
    return GST_PAD_PROBE_OK;
  }
}

/* aravissrc counts from the first frame, whenever that came. */
void
set_time (GstCodedExposureCameraSrc *self, GstBuffer *frame)
{
  Stream &stream = state (self).stream;
  const GstClockTime now =
      gst_element_get_current_running_time (GST_ELEMENT (self));
  if (std::exchange (stream.first, false)) {
    const GstClockTime device = GST_BUFFER_PTS (frame);
    const bool known = GST_CLOCK_TIME_IS_VALID (now) && now > device;
    stream.origin = known ? now - device : 0;
    GST_BUFFER_FLAG_SET (frame, GST_BUFFER_FLAG_DISCONT);
    if (GST_CLOCK_TIME_IS_VALID (stream.last))
      GST_BUFFER_FLAG_SET (frame, GST_BUFFER_FLAG_RESYNC);
  }
  if (GST_BUFFER_PTS_IS_VALID (frame))
    GST_BUFFER_PTS (frame) += stream.origin;
  const bool timed = GST_CLOCK_TIME_IS_VALID (now) &&
                     GST_CLOCK_TIME_IS_VALID (stream.last) && now > stream.last;
  note_frame (self, timed ? now - stream.last : 0);
  stream.last = GST_CLOCK_TIME_IS_VALID (now) ? now : 0;
}

/* A frame that is incomplete, or for whose pixels there is no memory, stays as
 * it is, in memory of its own: what it lacks is for downstream to judge. */
BufferPtr
own (const Stream &stream, BufferPtr frame)
{
  const OwnedFrames &frames = *stream.frames;
  BufferPtr owned =
      frames.is_whole (frame.get ()) ? frames.own (frame.get ()) : nullptr;
  if (!owned) {
    BufferPtr copy (gst_buffer_copy_deep (frame.get ()));
    GST_BUFFER_FLAG_SET (copy.get (), GST_BUFFER_FLAG_CORRUPTED);
    return copy;
  }
  FrameMeta meta;
  meta.bits = frames.bits ();
  meta.exposure_duration = stream.exposure;
  if (meta.bits > 0 || GST_CLOCK_TIME_IS_VALID (meta.exposure_duration))
    set_frame_meta (owned.get (), meta);
  return owned;
}

} // namespace

GstPadProbeReturn
take_item (GstPad *, GstPadProbeInfo *info, gpointer data)
{
  auto *self = as<GstCodedExposureCameraSrc> (data);
  if (info->type & GST_PAD_PROBE_TYPE_QUERY_BOTH)
    return take_query (self, info);
  if (!(info->type & GST_PAD_PROBE_TYPE_BUFFER))
    return passes (self, info) ? GST_PAD_PROBE_OK : GST_PAD_PROBE_DROP;
  const Stream &stream = state (self).stream;
  if (!stream.frames)
    return GST_PAD_PROBE_OK;
  BufferPtr frame = own (stream, BufferPtr (GST_PAD_PROBE_INFO_BUFFER (info)));
  info->data = frame.get ();
  set_time (self, frame.release ());
  return GST_PAD_PROBE_OK;
}

GstPadProbeReturn
take_answer (GstPad *, GstPadProbeInfo *info, gpointer data)
{
  GstQuery *query = GST_PAD_PROBE_INFO_QUERY (info);
  if (GST_QUERY_TYPE (query) == GST_QUERY_CAPS &&
      is_deep (as<GstCodedExposureCameraSrc> (data))) {
    GstCaps *caps = nullptr;
    gst_query_parse_caps_result (query, &caps);
    gst_query_set_caps_result (query, with_format (caps, kAsked, kSent).get ());
  }
  return GST_PAD_PROBE_OK;
}

} // namespace codedexposure::gst::camera
