/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Copies the frames of a camera, one grey value a pixel. */
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
 * A source without a pool, such as aravissrc, may overwrite memory that it has
 * pushed. Frames of a pool stay unchanged until they are released. Packed
 * pixels are unpacked; Aravis gives all formats of more than 8 bits the caps
 * GRAY16_LE, packed ones, too.
 */
class OwnedFrames
{
public:
  /** @p info  of the frames that come out.
   * @p pixel_format  GenICam name; empty: as @p info says.
   * @return an error if the two contradict each other. */
  static Result<OwnedFrames> make (
      const GstVideoInfo &info, const std::string &pixel_format);

  /** Significant bits of a pixel, as FrameMeta has them. */
  int bits () const;
  /** Whether the pixel format says how many bits are significant. */
  bool knows_bits () const { return format_.has_value (); }
  /** Whether @p frame is complete. */
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

/** The format of @p name, or an error that lists the valid names. */
Result<MonoFormat> camera_format (const std::string &name);

} // namespace codedexposure::gst
