/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Owners of GStreamer's references, locks and mapped frames. */
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "base/free_with.h"
#include "base/image.h"
#include "base/result.h"

namespace codedexposure::gst
{

struct MiniObjectUnref {
  void operator() (gpointer object) const
  {
    gst_mini_object_unref (GST_MINI_OBJECT_CAST (object));
  }
};
using BufferPtr = std::unique_ptr<GstBuffer, MiniObjectUnref>;
using CapsPtr = std::unique_ptr<GstCaps, MiniObjectUnref>;
using EventPtr = std::unique_ptr<GstEvent, MiniObjectUnref>;
using MessagePtr = std::unique_ptr<GstMessage, MiniObjectUnref>;
using QueryPtr = std::unique_ptr<GstQuery, MiniObjectUnref>;
using SamplePtr = std::unique_ptr<GstSample, MiniObjectUnref>;

using ObjectUnref = FreeWith<gst_object_unref>;
template <typename T>
using ObjectPtr = std::unique_ptr<T, ObjectUnref>;
using StructurePtr =
    std::unique_ptr<GstStructure, FreeWith<gst_structure_free>>;
using CharPtr = std::unique_ptr<gchar, FreeWith<g_free>>;

/** Deactivates a pool before it releases it. */
struct PoolRelease {
  void operator() (GstBufferPool *pool) const
  {
    gst_buffer_pool_set_active (pool, FALSE);
    gst_object_unref (pool);
  }
};
using PoolPtr = std::unique_ptr<GstBufferPool, PoolRelease>;

/** A pad that @p element has. */
inline ObjectPtr<GstPad>
pad_of (GstElement *element, const char *name)
{
  return ObjectPtr<GstPad> (gst_element_get_static_pad (element, name));
}

/* What an event holds, which it keeps. */
GstTagList *tags_of (GstEvent *event);
GstCaps *caps_of (GstEvent *event);
const GstSegment *segment_of (GstEvent *event);

/** Holds the object lock for a scope. Never push, query or block inside. */
class ObjectLock
{
public:
  explicit ObjectLock (gpointer object) : object_ (object)
  {
    GST_OBJECT_LOCK (object_);
  }
  ~ObjectLock () { GST_OBJECT_UNLOCK (object_); }
  ObjectLock (const ObjectLock &) = delete;
  ObjectLock &operator= (const ObjectLock &) = delete;

private:
  gpointer object_;
};

/** What @p use returns, under the object lock of @p object, or under @p mutex.
 * Never push, query or block inside. */
template <typename Use>
auto
locked (gpointer object, Use use)
{
  const ObjectLock lock (object);
  return use ();
}
template <typename Use>
auto
locked (std::mutex &mutex, Use use)
{
  const std::lock_guard lock (mutex);
  return use ();
}

/** Where the pixels of a grey frame lie in its buffer. */
struct PixelLayout {
  gsize offset;
  gint stride;
};
/** By the buffer's video meta, or by GStreamer's own layout. Error unless all
 * pixels lie within the size of the buffer; memory beyond it, as pools have,
 * holds what was there before. */
Result<PixelLayout> layout_of (const GstVideoInfo &info, GstBuffer *buffer);
/** Why @p buffer could not be mapped as a frame of @p info, for the user. */
std::string unreadable_text (const GstVideoInfo &info, GstBuffer *buffer);

/** A mapped grey frame, all of whose pixels are in its memory; test it before
 * frame (). Its buffer must outlive it. */
class MappedFrame
{
public:
  MappedFrame () = default;
  MappedFrame (const GstVideoInfo &info, GstBuffer *buffer, GstMapFlags flags)
  {
    map (info, buffer, flags);
  }
  ~MappedFrame () { reset (); }
  MappedFrame (MappedFrame &&other) noexcept
      : frame_ (other.frame_), mapped_ (std::exchange (other.mapped_, false))
  {
  }
  MappedFrame &operator= (MappedFrame &&) = delete;

  /** Call it only while nothing is mapped. */
  void map (const GstVideoInfo &info, GstBuffer *buffer, GstMapFlags flags);
  explicit operator bool () const { return mapped_; }
  GstVideoFrame *frame () { return &frame_; }
  void reset ()
  {
    if (std::exchange (mapped_, false))
      gst_buffer_unmap (frame_.buffer, &frame_.map[0]);
  }

private:
  GstVideoFrame frame_ = {};
  bool mapped_ = false;
};

/** The pixels of a mapped grey frame, whatever its strides. */
template <typename Pixel>
ImageView<Pixel>
view_of (GstVideoFrame *frame)
{
  return {static_cast<Pixel *> (GST_VIDEO_FRAME_PLANE_DATA (frame, 0)),
      GST_VIDEO_FRAME_WIDTH (frame), GST_VIDEO_FRAME_HEIGHT (frame),
      GST_VIDEO_FRAME_PLANE_STRIDE (frame, 0)};
}
template <typename Pixel>
ImageView<Pixel>
view_of (MappedFrame &mapped)
{
  return view_of<Pixel> (mapped.frame ());
}

/** Calls @p use with the pixels of @p mapped, in the type of its format. Write
 * to them only if the frame was mapped for writing. */
template <typename Use>
auto
write_pixels (MappedFrame &mapped, Use use)
{
  if (GST_VIDEO_FRAME_FORMAT (mapped.frame ()) == GST_VIDEO_FORMAT_GRAY8)
    return use (view_of<std::uint8_t> (mapped));
  return use (view_of<std::uint16_t> (mapped));
}
template <typename Use>
auto
read_pixels (MappedFrame &mapped, Use use)
{
  return write_pixels (
      mapped, [&use]<typename Pixel> (const ImageView<Pixel> &pixels) {
        return use (ImageView<const Pixel> (pixels));
      });
}

} // namespace codedexposure::gst
