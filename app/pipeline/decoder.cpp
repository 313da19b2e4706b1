/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "decoder.h"

#include <string>

namespace codedexposure::app
{

namespace
{

Settings
shared_settings (const DecodeOptions &options)
{
  return {{"require-schedule", true}, {"mapping", options.mapping},
      {"schedule", options.schedule}, {"bench", options.bench},
      {"bits", options.bits}};
}

} // namespace

DecoderPads
add_demux (Job &job, Chain &frames, const DecodeOptions &options,
    std::optional<int> region)
{
  Settings settings = shared_settings (options);
  settings.emplace_back ("method", options.method);
  frames.to ("queue").to ("codedexposure-demux", settings);
  GstElement *demux = frames.last ();
  job.counted = demux;
  const std::string pad = region ? "region_" + std::to_string (*region) : "src";
  return {job.graph.from (demux, g_intern_string (pad.c_str ())), demux};
}

DecoderPads
add_fusion (Job &job, Chain &frames, const DecodeOptions &options,
    std::optional<int> threads)
{
  Settings settings = shared_settings (options);
  settings.insert (settings.end (),
      {{"quality", options.fuse}, {"lookahead", 1}, {"refine", options.refine},
          {"full-well", options.full_well}, {"read-noise", options.read_noise},
          {"range", options.range}, {"overlap", options.overlap},
          {"threads", threads}});
  frames.to ("queue", {{"max-size-buffers", 1}})
      .to ("codedexposure-fuse", settings);
  GstElement *fuse = frames.last ();
  job.counted = fuse;
  return {job.graph.from (fuse, "src"), fuse};
}

} // namespace codedexposure::app
