/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "camera_tracks.h"

#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>

#include <gst/video/video.h>

#include "common/element.h"
#include "partner_input.h"
#include "parts.h"

namespace codedexposure::gst
{

/* ----------------------------------------------------------- raw frames -- */

namespace
{

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
  constexpr auto kInOnePiece = GstBufferCopyFlags (
      GST_BUFFER_COPY_ALL | GST_BUFFER_COPY_MERGE | GST_BUFFER_COPY_DEEP);
  GstBuffer *copy = gst_buffer_copy_region (frame, kInOnePiece, 0, gsize (-1));
  gst_buffer_unref (frame);
  return copy;
}

} // namespace

/* The demuxer takes the nearest of the common rates. */
GstPadProbeReturn
CameraTracks::on_caps (GstPad *, GstPadProbeInfo *info, gpointer self) noexcept
{
  GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
  if (GST_EVENT_TYPE (event) != GST_EVENT_CAPS)
    return GST_PAD_PROBE_OK;
  const Nanoseconds duration = static_cast<CameraTracks *> (self)->duration_;
  FrameRate rate;
  gst_video_guess_framerate (GstClockTime (duration), &rate.num, &rate.den);
  if (std::abs (rate.period () - duration) > 1)
    rate = FrameRate::of_period (duration).value_or (rate);
  const CapsPtr caps (gst_caps_copy (caps_of (event)));
  gst_caps_set_simple (
      caps.get (), "framerate", GST_TYPE_FRACTION, rate.num, rate.den, nullptr);
  info->data = gst_event_new_caps (caps.get ());
  gst_event_unref (event);
  return GST_PAD_PROBE_OK;
}

/* Frames that are cut off are dropped; the track says that they are missing. */
GstPadProbeReturn
CameraTracks::on_deep_frame (
    GstPad *, GstPadProbeInfo *info, gpointer self) noexcept
{
  const auto &tracks = *static_cast<const CameraTracks *> (self);
  if (GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM) {
    GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
    if (GST_EVENT_TYPE (event) == GST_EVENT_CAPS) {
      gst_event_unref (event);
      info->data = gst_event_new_caps (tracks.deep_.caps.get ());
    }
    return GST_PAD_PROBE_OK;
  }
  GstBuffer *frame = GST_PAD_PROBE_INFO_BUFFER (info);
  const gsize size = gst_buffer_get_size (frame);
  if (size < tracks.deep_.frame_bytes)
    return GST_PAD_PROBE_DROP;
  if (size == tracks.deep_.frame_bytes) {
    info->data = aligned (frame);
    return GST_PAD_PROBE_OK;
  }
  POST_ERROR (tracks.element_, STREAM, DECODE,
      "A raw frame has " + std::to_string (size) +
          " bytes, but by the head of "
          "the file it should have " +
          std::to_string (tracks.deep_.frame_bytes) +
          ": the head is damaged. Use another copy of the recording.");
  gst_clear_buffer (reinterpret_cast<GstBuffer **> (&info->data));
  GST_PAD_PROBE_INFO_FLOW_RETURN (info) = GST_FLOW_ERROR;
  return GST_PAD_PROBE_HANDLED;
}

/* As on_deep_frame. One of all its pixels, without the bytes between rows, goes
 * on to an error that says so. */
GstPadProbeReturn
on_raw_frame (GstPad *, GstPadProbeInfo *info, gpointer pixels) noexcept
{
  const gsize size = gst_buffer_get_size (GST_PAD_PROBE_INFO_BUFFER (info));
  return size < GPOINTER_TO_SIZE (pixels) ? GST_PAD_PROBE_DROP
                                          : GST_PAD_PROBE_OK;
}

/* False: their format is none of coded frames. The demuxer knows 16-bit grey
 * only since GStreamer 1.26. */
bool
CameraTracks::take_raw (
    GstPad *pad, const GstCaps *caps, const FrameReading &how)
{
  const GstStructure *structure = gst_caps_get_structure (caps, 0);
  const gchar *format = gst_structure_get_string (structure, "format");
  if (gst_structure_has_name (structure, "video/x-raw") &&
      g_strcmp0 (format, "GRAY16_LE") != 0) {
    gst_pad_add_probe (pad, GST_PAD_PROBE_TYPE_BUFFER, on_raw_frame,
        GSIZE_TO_POINTER (gsize (how.size.width) * gsize (how.size.height)),
        nullptr);
    return g_strcmp0 (format, "GRAY8") == 0;
  }
  if (how.pixel_bytes != 2 || how.size.width < 1 || how.size.height < 1)
    return false;
  GstVideoInfo info;
  gst_video_info_set_format (&info, GST_VIDEO_FORMAT_GRAY16_LE,
      guint (how.size.width), guint (how.size.height));
  deep_ = {
      CapsPtr (gst_video_info_to_caps (&info)), GST_VIDEO_INFO_SIZE (&info)};
  gst_pad_add_probe (pad,
      GstPadProbeType (
          GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM),
      on_deep_frame, this, nullptr);
  return true;
}

/* ------------------------------------------------------- encoded frames -- */

namespace
{

GstStaticCaps file_caps = GST_STATIC_CAPS ("timestamp/x-file");

guint32
segment_number (GstPad *pad)
{
  const EventPtr segment (gst_pad_get_sticky_event (pad, GST_EVENT_SEGMENT, 0));
  return segment ? gst_event_get_seqnum (segment.get ()) : GST_SEQNUM_INVALID;
}

/* A decoder gives the time of the frame before to one that is earlier, and that
 * of the segment's start to one that begins before it and lasts longer.
 * Backwards, it holds a frame until the next one comes, also if that is of
 * another segment: its number stands in place of a duration. */
GstPadProbeReturn
on_encoded (GstPad *pad, GstPadProbeInfo *info, gpointer) noexcept
{
  GstBuffer *frame =
      gst_buffer_make_writable (GST_PAD_PROBE_INFO_BUFFER (info));
  info->data = frame;
  const CapsPtr caps (gst_static_caps_get (&file_caps));
  if (GST_BUFFER_PTS_IS_VALID (frame))
    gst_buffer_add_reference_timestamp_meta (
        frame, caps.get (), GST_BUFFER_PTS (frame), segment_number (pad));
  return GST_PAD_PROBE_OK;
}

} // namespace

GstPadProbeReturn
CameraTracks::on_decoded (
    GstPad *pad, GstPadProbeInfo *info, gpointer self) noexcept
{
  GstBuffer *frame =
      gst_buffer_make_writable (GST_PAD_PROBE_INFO_BUFFER (info));
  info->data = frame;
  const CapsPtr caps (gst_static_caps_get (&file_caps));
  auto *own = gst_buffer_get_reference_timestamp_meta (frame, caps.get ());
  if (!own)
    return GST_PAD_PROBE_OK;
  if (own->duration != segment_number (pad))
    return GST_PAD_PROBE_DROP;
  const GstClockTime before = std::exchange (
      static_cast<CameraTracks *> (self)->decoded_, GST_BUFFER_PTS (frame));
  if (GST_BUFFER_PTS (frame) == before ||
      GST_BUFFER_PTS (frame) > own->timestamp)
    GST_BUFFER_PTS (frame) = own->timestamp;
  gst_buffer_remove_meta (frame, &own->parent);
  return GST_PAD_PROBE_OK;
}

/* After it, the demuxer would post another error, of damage. */
GstFlowReturn
CameraTracks::decode (
    GstPad *pad, GstObject *decoder, GstBuffer *frame) noexcept
{
  const auto &tracks = *static_cast<const CameraTracks *> (pad->chaindata);
  const GstFlowReturn flow = tracks.decode_ (pad, decoder, frame);
  if (flow != GST_FLOW_NOT_NEGOTIATED)
    return flow;
  const auto src = pad_of (GST_ELEMENT (decoder), "src");
  const CapsPtr caps (gst_pad_get_current_caps (src.get ()));
  const CapsPtr grey (gst_caps_from_string (CODED_EXPOSURE_VIDEO_CAPS));
  if (caps && gst_caps_can_intersect (caps.get (), grey.get ()))
    return flow;
  POST_ERROR (tracks.element_, CORE, NEGOTIATION,
      "The pixels of the FFV1 frames are neither 8 nor 16 bits of grey, which "
      "those of a recording are: another program has written them anew. Use "
      "the recording itself, or change the format (\"ffmpeg -i IN.mkv -map 0 "
      "-c:s copy -c:v ffv1 -pix_fmt gray OUT.mkv\"; with more than 8 bits, "
      "gray16le). Frames whose pixels are not those that were recorded are "
      "flagged.");
  return GST_FLOW_FLUSHING;
}

/* --------------------------------------------------------------- tracks -- */

/* Before restore; none, if frames are raw or stay encoded. False, with an
 * error: it is no codec of a recording, or is not installed. */
bool
CameraTracks::make_decoder (
    GstPad *pad, const GstCaps *caps, const FrameReading &how)
{
  const GstStructure *structure = gst_caps_get_structure (caps, 0);
  const std::string_view kind = gst_structure_get_name (structure);
  const gchar *id = gst_structure_get_string (structure, "codec-id");
  const std::string codec (id ? id : kind);
  const bool is_raw = kind == "video/x-raw" || codec == "V_UNCOMPRESSED";
  if (is_raw && take_raw (pad, caps, how))
    return true;
  if (kind != "video/x-ffv") {
    POST_ERROR (element_, STREAM, WRONG_TYPE,
        "The file has " + (is_raw ? "raw frames that are not grey" : codec) +
            ", but coded frames are recorded as FFV1 or raw grey. Use a "
            "recording of coded frames.");
    return false;
  }
  if (!how.decode)
    return true;
  decoder_ = gst_element_factory_make ("avdec_ffv1", nullptr);
  if (!decoder_) {
    POST_ERROR (element_, CORE, MISSING_PLUGIN, missing ("avdec_ffv1"));
    return false;
  }
  /* Its pool crashes with pixels that GStreamer does not know. */
  g_object_set (decoder_, "max-threads", how.threads, "max-errors", -1,
      "direct-rendering", FALSE, nullptr);
  const auto sink = pad_of (decoder_, "sink");
  decode_ = GST_PAD_CHAINFUNC (sink.get ());
  gst_pad_set_chain_function_full (sink.get (), decode, this, nullptr);
  gst_pad_add_probe (
      sink.get (), GST_PAD_PROBE_TYPE_BUFFER, on_encoded, nullptr, nullptr);
  gst_pad_add_probe (pad_of (decoder_, "src").get (), GST_PAD_PROBE_TYPE_BUFFER,
      on_decoded, this, nullptr);
  gst_bin_add (GST_BIN (element_), decoder_);
  return true;
}

/* The demuxer reads in a thread of its own. */
void
CameraTracks::add_frames (GstPad *pad, const FrameReading &how)
{
  const CapsPtr caps (gst_pad_query_caps (pad, nullptr));
  /* A stop takes them from the pad. */
  if (gst_caps_get_size (caps.get ()) == 0 ||
      !make_decoder (pad, caps.get (), how))
    return;
  duration_ = how.duration;
  if (duration_ > 0)
    gst_pad_add_probe (
        pad, GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM, on_caps, this, nullptr);
  queue_ = make_queue (PartnerInput::kQueued);
  gst_bin_add (GST_BIN (element_), queue_);
  if (decoder_) {
    gst_element_link_pads (decoder_, "src", restore (), "sink");
    gst_element_link_pads (queue_, "src", decoder_, "sink");
    gst_element_sync_state_with_parent (decoder_);
  } else
    gst_element_link_pads (queue_, "src", restore (), "sink");
  gst_element_sync_state_with_parent (queue_);
  gst_pad_link_full (
      pad, pad_of (queue_, "sink").get (), GST_PAD_LINK_CHECK_NOTHING);
}

guint
CameraTracks::frames_queued (GstElement *, gpointer self) noexcept
{
  guint queued = 0;
  g_object_get (static_cast<CameraTracks *> (self)->queue_,
      "current-level-buffers", &queued, nullptr);
  return queued;
}

GstPadProbeReturn
CameraTracks::on_read (
    GstPad *pad, GstPadProbeInfo *info, gpointer self) noexcept
{
  SegmentLeft &segment = static_cast<CameraTracks *> (self)->segment_;
  if (GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_BUFFER) {
    segment.last = GST_BUFFER_PTS (GST_PAD_PROBE_INFO_BUFFER (info));
    return GST_PAD_PROBE_OK;
  }
  GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
  const guint seqnum = gst_event_get_seqnum (event);
  if (GST_EVENT_TYPE (event) != GST_EVENT_SEGMENT || seqnum == segment.seqnum)
    return GST_PAD_PROBE_OK;
  if (segment.seqnum != GST_SEQNUM_INVALID)
    gst_pad_send_event (pad, new_event (segment));
  segment = {.seqnum = seqnum, .backwards = segment_of (event)->rate < 0};
  return GST_PAD_PROBE_OK;
}

void
CameraTracks::tell_left_segments ()
{
  if (queue_)
    gst_pad_add_probe (pad_of (queue_, "sink").get (),
        GstPadProbeType (
            GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM),
        on_read, this, nullptr);
}

void
CameraTracks::add_lines (GstPad *pad)
{
  gst_pad_link (pad, pad_of (restore (), "track").get ());
}

void
CameraTracks::begin (Nanoseconds tick)
{
  restore_.reset (GST_ELEMENT (gst_object_ref_sink (
      make_part (gst_coded_exposure_restore_get_type ()))));
  set_tick (tick);
  g_signal_connect (
      restore (), "frames-queued", G_CALLBACK (frames_queued), this);
}

void
CameraTracks::add_restore ()
{
  if (!gst_object_has_as_parent (
          GST_OBJECT (restore ()), GST_OBJECT (element_)))
    gst_bin_add (GST_BIN (element_), restore ());
  gst_element_sync_state_with_parent (restore ());
}

void
CameraTracks::set_tick (Nanoseconds tick)
{
  g_object_set (restore (), "tick", guint64 (tick), nullptr);
}

void
CameraTracks::end ()
{
  remove_part (element_, queue_);
  remove_part (element_, decoder_);
  deep_ = {};
  decoded_ = GST_CLOCK_TIME_NONE;
  segment_ = {};
}

void
CameraTracks::remove ()
{
  end ();
  GstElement *part = restore ();
  remove_part (element_, part);
  restore_.reset ();
}

} // namespace codedexposure::gst
