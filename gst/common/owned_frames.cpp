/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "owned_frames.h"

#include "meta.h"

namespace codedexposure::gst
{

namespace
{

/* Bytes from one packed row to the next: aravissrc pads rows to four bytes, as
 * GStreamer does, or does not pad them. */
gsize
packed_stride (const GstVideoInfo &info, MonoFormat format, gsize size)
{
  const gsize row = row_bytes (format, info.width);
  const gsize filled = (row + 3) / 4 * 4;
  return size >= filled * gsize (info.height) ? filled : row;
}

GstBufferPool *
make_pool (const GstVideoInfo &info)
{
  const CapsPtr caps (gst_video_info_to_caps (&info));
  GstBufferPool *pool = gst_video_buffer_pool_new ();
  GstStructure *config = gst_buffer_pool_get_config (pool);
  gst_buffer_pool_config_set_params (
      config, caps.get (), guint (GST_VIDEO_INFO_SIZE (&info)), 0, 0);
  gst_buffer_pool_set_config (pool, config);
  gst_buffer_pool_set_active (pool, TRUE);
  return pool;
}

} // namespace

Result<MonoFormat>
camera_format (const std::string &name)
{
  if (const auto format = parse_mono_format (name))
    return *format;
  return Error{"there is no pixel-format " + name +
               "; it is Mono8, Mono10, Mono12, Mono16, Mono10Packed, "
               "Mono12Packed, Mono10p or Mono12p"};
}

Result<OwnedFrames>
OwnedFrames::make (const GstVideoInfo &info, const std::string &pixel_format)
{
  OwnedFrames frames;
  frames.info_ = info;
  if (!pixel_format.empty ()) {
    const Result<MonoFormat> format = camera_format (pixel_format);
    if (!format)
      return format.error ();
    frames.format_ = *format;
    const bool wide =
        GST_VIDEO_INFO_FORMAT (&info) == GST_VIDEO_FORMAT_GRAY16_LE;
    if (wide == (*format == MonoFormat::mono8))
      return Error{std::string ("pixel-format ") + mono_format_text (*format) +
                   " needs caps with format=" + (wide ? "GRAY8" : "GRAY16_LE")};
  }
  frames.pool_.reset (make_pool (info));
  return frames;
}

bool
OwnedFrames::is_packed () const
{
  return format_ && stored_bits (*format_) % 8 != 0;
}

int
OwnedFrames::bits () const
{
  return format_ ? significant_bits_of (significant_bits (*format_), info_) : 0;
}

bool
OwnedFrames::is_whole (GstBuffer *frame) const
{
  if (is_packed ())
    return gst_buffer_get_size (frame) >=
           row_bytes (*format_, info_.width) * gsize (info_.height);
  return bool (layout_of (info_, frame));
}

bool
OwnedFrames::copy (GstBuffer *from, GstBuffer *to) const
{
  MappedFrame source (info_, from, GST_MAP_READ);
  MappedFrame target (info_, to, GST_MAP_WRITE);
  return source && target &&
         gst_video_frame_copy (target.frame (), source.frame ());
}

bool
OwnedFrames::unpack (GstBuffer *from, GstBuffer *to) const
{
  GstMapInfo packed;
  MappedFrame target (info_, to, GST_MAP_WRITE);
  if (!target || !gst_buffer_map (from, &packed, GST_MAP_READ))
    return false;
  const gsize stride = packed_stride (info_, *format_, packed.size);
  const Result<void> done = unpack_mono (*format_,
      {packed.data, int (row_bytes (*format_, info_.width)), info_.height,
          std::ptrdiff_t (stride)},
      view_of<std::uint16_t> (target));
  gst_buffer_unmap (from, &packed);
  return bool (done);
}

BufferPtr
OwnedFrames::own (GstBuffer *frame) const
{
  if (frame->pool && !is_packed ())
    return BufferPtr (gst_buffer_ref (frame));
  GstBuffer *acquired = nullptr;
  if (gst_buffer_pool_acquire_buffer (pool_.get (), &acquired, nullptr) !=
      GST_FLOW_OK)
    return nullptr;
  BufferPtr owned (acquired);
  if (!(is_packed () ? unpack (frame, acquired) : copy (frame, acquired)))
    return nullptr;
  copy_description (frame, info_, acquired);
  return owned;
}

} // namespace codedexposure::gst
