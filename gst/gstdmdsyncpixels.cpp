/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync's pixels: how they are packed, whether all are there, and whose
 * memory they are in. */
#include "gstdmdsyncstate.h"

#define GST_CAT_DEFAULT dmdsync_debug

namespace cexp::gst::sync
{

namespace
{

bool
is_packed (MonoFormat format)
{
  return stored_bits (format) % 8 != 0;
}

/* Distance of rows: aravissrc fills them up to four bytes, as GStreamer has
 * them, or leaves them as they are. */
gsize
packed_stride (const Timebase &time, MonoFormat format, gsize size)
{
  const gsize row = row_bytes (format, time.info.width);
  const gsize filled = (row + 3) / 4 * 4;
  return size >= filled * gsize (time.info.height) ? filled : row;
}

/* Bytes up to the last pixel, in the layout that the frame says it has. */
gsize
whole_size (const Stream &stream, GstBuffer *frame)
{
  const GstVideoInfo &info = stream.time->info;
  if (stream.format && is_packed (*stream.format))
    return row_bytes (*stream.format, info.width) * gsize (info.height);
  const GstVideoMeta *layout = gst_buffer_get_video_meta (frame);
  if (!layout)
    return GST_VIDEO_INFO_SIZE (&info);
  const gsize row =
      gsize (info.width) * gsize (GST_VIDEO_INFO_COMP_PSTRIDE (&info, 0));
  return layout->offset[0] + row +
         gsize (std::max (layout->stride[0], 0)) * gsize (info.height - 1);
}

/* The ring of a source upstream: half of it, since the camera writes ahead of
 * what has arrived. None where frames own their memory. */
GstClockTime
ring_time (GstDmdSync *self)
{
  for (const auto &element : elements_before (self)) {
    if (!is_aravissrc (element.get ()))
      continue;
    gint buffers = 0;
    g_object_get (element.get (), "num-arv-buffers", &buffers, nullptr);
    const FrameRate rate = state (self).stream.time->rate;
    return GstClockTime (rate.time_of (std::max (0, buffers / 2 - 1)));
  }
  return GST_CLOCK_TIME_NONE;
}

/* On the keeper's thread. */
void
say_held (GstDmdSync *self, const Overdue &overdue)
{
  SyncState &st = state (self);
  gst_element_post_message (GST_ELEMENT (self),
      gst_message_new_element (GST_OBJECT (self),
          gst_structure_new ("dmdsync/frame-held", "frame", G_TYPE_UINT64,
              overdue.number, "spoilt", G_TYPE_BOOLEAN,
              gboolean (overdue.spoilt), nullptr)));
  if (!st.warned_held.exchange (true))
    GST_ELEMENT_WARNING (self, RESOURCE, NO_SPACE_LEFT,
        ("Frames are kept downstream, as in a deep queue, until the camera "
         "source writes into their memory again; such frames are copied. Give "
         "the source more buffers (num-arv-buffers), or the queue fewer."),
        ("this is said once; the property frames-held counts them all"));
  {
    const ObjectLock lock (self);
    st.counters.frames_held++;
    st.counters.frames_spoilt += overdue.spoilt;
  }
  notify (self, "frames-held");
}

} // namespace

bool
plan_pixels (GstDmdSync *self, std::string &why)
{
  SyncState &st = state (self);
  Stream &stream = st.stream;
  std::string name;
  {
    const ObjectLock lock (self);
    name = st.settings.pixel_format;
  }
  stream.ring = ring_time (self);
  stream.format.reset ();
  if (name.empty ())
    return true;

  stream.format = parse_mono_format (name);
  if (!stream.format) {
    why = "there is no pixel-format " + name +
          "; it is Mono8, Mono10, Mono12, Mono16, Mono10Packed, Mono12Packed, "
          "Mono10p or Mono12p";
    return false;
  }
  const bool wide =
      GST_VIDEO_INFO_FORMAT (&stream.time->info) == GST_VIDEO_FORMAT_GRAY16_LE;
  if (wide == (*stream.format != MonoFormat::mono8))
    return true;
  why = std::string ("pixel-format ") + mono_format_text (*stream.format) +
        " needs caps with format=" + (wide ? "GRAY8" : "GRAY16_LE");
  return false;
}

bool
is_whole (GstDmdSync *self, GstBuffer *frame)
{
  return gst_buffer_get_size (frame) >= whole_size (state (self).stream, frame);
}

BufferPtr
unpack (GstDmdSync *self, BufferPtr frame)
{
  const Stream &stream = state (self).stream;
  if (!stream.format || !is_packed (*stream.format))
    return frame;
  const Timebase &time = *stream.time;
  BufferPtr whole (gst_buffer_new_and_alloc (GST_VIDEO_INFO_SIZE (&time.info)));
  gst_buffer_copy_into (whole.get (), frame.get (),
      GstBufferCopyFlags (GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS |
                          GST_BUFFER_COPY_META),
      0, -1);
  GstMapInfo packed;
  MappedFrame mapped (time.info, whole.get (), GST_MAP_WRITE);
  if (!mapped || !gst_buffer_map (frame.get (), &packed, GST_MAP_READ))
    return nullptr;
  const gsize stride = packed_stride (time, *stream.format, packed.size);
  /* is_whole () has seen to the size. */
  const Result<void> done = unpack_mono (*stream.format,
      {packed.data, int (row_bytes (*stream.format, time.info.width)),
          time.info.height, std::ptrdiff_t (stride)},
      view_of<std::uint16_t> (mapped));
  gst_buffer_unmap (frame.get (), &packed);
  if (!done)
    return nullptr;
  mapped.reset ();
  return whole;
}

void
keep_whole (GstDmdSync *self, GstBuffer *frame, guint64 number)
{
  SyncState &st = state (self);
  GstClockTime time;
  {
    const ObjectLock lock (self);
    time = st.settings.max_hold;
  }
  if (!GST_CLOCK_TIME_IS_VALID (time))
    time = st.stream.ring;
  const bool ours = st.stream.format && is_packed (*st.stream.format);
  if (ours || !GST_CLOCK_TIME_IS_VALID (time))
    return;
  if (!st.keeper)
    st.keeper = std::make_unique<LeaseKeeper> (
        [self] (const Overdue &overdue) { say_held (self, overdue); });
  /* Frames that came late stood in the ring all the while, and left that much
   * less of it to the camera. */
  time -=
      std::min (time, GstClockTime (st.stream.device_clock.lateness ()) / 2);
  st.keeper->lend (frame, number, std::chrono::nanoseconds (time));
}

} // namespace cexp::gst::sync
