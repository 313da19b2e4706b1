/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames of a camera in memory of our own, one grey value a pixel. */
#pragma once

#include <optional>
#include <string>

#include <gst/video/video.h>

#include "base/packed_mono.h"
#include "base/result.h"
#include "raii.h"

namespace codedexposure::gst
{

/**
 * Copies frames into a buffer pool unless they come from one.
 *
 * A source without a pool may write into memory that it has handed out, as
 * aravissrc does. Frames of a pool stay untouched until they are released.
 * Packed pixels are unpacked on the way; Aravis calls all formats of more than
 * 8 bits GRAY16_LE, packed ones as well.
 */
class OwnedFrames
{
public:
  /** @p info  of the frames that come out.
   * @p pixel_format  GenICam name; empty: as @p info says.
   * @return an error where the two do not agree. */
  static Result<OwnedFrames> make (
      const GstVideoInfo &info, const std::string &pixel_format);

  /** Significant bits of a pixel, as FrameMeta has them. */
  int bits () const;
  /** Whether the pixel format says how many bits are significant. */
  bool knows_bits () const { return format_.has_value (); }
  /** Whether @p frame has all of its bytes. */
  bool is_whole (GstBuffer *frame) const;
  /** @p frame, which is whole, or a copy of it; null where it cannot be read.
   */
  BufferPtr own (GstBuffer *frame) const;

private:
  OwnedFrames () = default;
  bool is_packed () const;
  bool copy (GstBuffer *from, GstBuffer *to) const;
  bool unpack (GstBuffer *from, GstBuffer *to) const;

  GstVideoInfo info_ = {};
  std::optional<MonoFormat> format_;
  PoolPtr pool_;
};

/** The format of @p name, or an error that lists those there are. */
Result<MonoFormat> camera_format (const std::string &name);

} // namespace codedexposure::gst
