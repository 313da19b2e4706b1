/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Rewrites the bytes of matroskamux for programs other than GStreamer. No byte
 * moves in a file. */
#pragma once

#include <gst/gst.h>

namespace codedexposure::gst
{

/** The format that matroskamux gets for raw frames with 16-bit pixels, which it
 * does not know: any four letters are a FourCC. FFmpeg knows these frames by
 * another, which is no text, and which the file has. */
inline constexpr char kDeepFormat[] = "Y16 ";

/**
 * What a muxer gives, changed item by item:
 *
 * - The head has the FourCC of FFmpeg for 16-bit grey, and a text track that is
 *   not the default, so players do not show its lines on the pictures unasked;
 *   so has the head in the caps of a stream, which late receivers get.
 * - Texts of tags, which the muxer quotes and escapes, are plain.
 */
class ContainerOutput
{
public:
  /** Before a run. */
  void restart () { *this = {}; }
  /** For a probe of buffers and downstream events at the muxer's source pad. */
  void rewrite (GstPadProbeInfo *info);

private:
  bool has_frames_ = false, has_tags_ = false;
};

} // namespace codedexposure::gst
