/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The end of a pipeline that writes pictures: the ending of the name selects
 * the format. */
#pragma once

#include <optional>
#include <string>

#include "pipeline/job.h"

namespace codedexposure::app
{

/** How pictures are written. */
struct VideoStyle {
  bool deflate = false;       ///< compress .ome.tif, .h5 and .ome.zarr
  bool view = false;          ///< scale PNG to 8 bits
  std::optional<int> white;   ///< DN that becomes white in 8 bits
  std::optional<int> bits;    ///< significant bits; none: those of the frames
  std::optional<int> threads; ///< of the encoder; none: one a processor
  bool encoded = false;       ///< they come as .mkv has them
  bool is_coded = false;      ///< they are the coded frames themselves
  /** Coded frames whose pictures these are pass its sink pad. */
  GstElement *coded = nullptr;
};

/** Whether @p name ends in ".mkv", and so on. */
enum class VideoForm { mkv, mp4, stack, pictures };
/** None: no format has this ending. */
std::optional<VideoForm> form_of (const std::string &name);

/** Writes the pictures of @p chain to @p name. Throws Failure if its ending is
 * that of no format. */
void write_video (
    Job &job, Chain &chain, const std::string &name, const VideoStyle &style);

/** Scales frames of any bit depth to 8 bits, for display. */
void add_view (
    Chain &chain, std::optional<int> bits, std::optional<int> white = {});

} // namespace codedexposure::app
