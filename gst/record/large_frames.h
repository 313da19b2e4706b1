/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames that the demuxer of codedexposure-recorddemux would refuse, because
 * they are large, go past it. */
#pragma once

#include <gst/gst.h>

#include "common/raii.h"
#include "record/large_blocks.h"

namespace codedexposure::gst
{

/** Streaming thread of the demuxer, and changes of the state. */
class LargeFrames
{
public:
  /** What the demuxer gets in place of @p bytes, which its pad @p sink has read
   * at @p at. Transfer: full, of both. */
  GstBuffer *pulled (GstPad *sink, guint64 at, GstBuffer *bytes);
  /** The same of the bytes that follow in a stream; null: none yet. */
  GstBuffer *pushed (GstBuffer *bytes);
  /** A segment of bytes begins, in a stream. */
  void follow (const GstSegment &segment);
  /** The frame for which @p shown stands, which comes from the demuxer with the
   * pad @p sink, or @p shown itself; null: it cannot be read. Transfer: full,
   * of both. */
  GstBuffer *put_back (GstPad *sink, GstBuffer *shown) const;

private:
  LargeBlocks blocks_;
};

} // namespace codedexposure::gst
