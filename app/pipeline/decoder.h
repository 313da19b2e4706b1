/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The middle of a pipeline: coded frames become pictures. */
#pragma once

#include "options/picture.h"
#include "pipeline/job.h"

namespace codedexposure::app
{

/** Where the pictures of a decoder come out. */
struct DecoderPads {
  Chain pictures;
  GstElement *decoder;

  /** The coded frames. */
  Chain coded () const { return pictures.graph ().from (decoder, "coded"); }
  /** The uncertainty of a fusion. */
  Chain uncertainty () const
  {
    return pictures.graph ().from (decoder, "uncertainty");
  }
};

/** Adds a demultiplexer behind @p frames. @p region: its subframes instead of
 * those of the background. */
DecoderPads add_demux (Job &job, Chain &frames, const DecodeOptions &options,
    std::optional<int> region = {});
/** Adds a fusion behind @p frames. */
DecoderPads add_fusion (Job &job, Chain &frames, const DecodeOptions &options,
    std::optional<int> threads);

} // namespace codedexposure::app
