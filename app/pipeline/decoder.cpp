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
  Settings settings{{"require-schedule", true}};
  set_if (settings, "mapping", options.mapping);
  set_if (settings, "schedule", options.schedule);
  set_if (settings, "bench", options.bench);
  set_if (settings, "bits", options.bits);
  return settings;
}

} // namespace

DecoderPads
add_demux (Job &job, Chain &frames, const DecodeOptions &options,
    std::optional<int> region)
{
  Settings settings = shared_settings (options);
  set_if (settings, "method", options.method);
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
  settings.emplace_back ("quality", *options.fuse);
  settings.emplace_back ("lookahead", 1);
  if (options.refine)
    settings.emplace_back ("refine", true);
  set_if (settings, "full-well", options.full_well);
  set_if (settings, "read-noise", options.read_noise);
  set_if (settings, "range", options.range);
  set_if (settings, "overlap", options.overlap);
  set_if (settings, "threads", threads);
  frames.to ("queue", {{"max-size-buffers", 1}})
      .to ("codedexposure-fuse", settings);
  GstElement *fuse = frames.last ();
  job.counted = fuse;
  return {job.graph.from (fuse, "src"), fuse};
}

} // namespace codedexposure::app
