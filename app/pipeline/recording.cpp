/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "recording.h"

#include <algorithm>

#include "base/memory.h"
#include "record/matroska.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

/* How many frames may wait for encoder and disk: 3 s. */
int
frames_that_wait (FrameRate rate)
{
  constexpr int kFewest = 75;
  return std::max (kFewest, 3 * rate.num / std::max (rate.den, 1));
}

} // namespace

void
write_recording (Job &job, Chain &chain, const std::string &file,
    const RecordingStyle &style)
{
  chain.to ("queue",
      {{"leaky", style.live ? "downstream" : "no"},
          {"max-size-buffers", frames_that_wait (style.rate)},
          {"max-size-bytes", room_in_memory ()}, {"max-size-time", 0}});
  GstElement *queue = chain.last ();
  if (!job.recorded)
    job.recorded = queue;
  chain.to ("codedexposure-recordmux",
      {{"codec", style.codec}, {"threads", style.threads}});
  GstElement *mux = chain.last ();
  if (style.live)
    job.buffers.push_back (queue);
  if (!job.reader)
    job.recorders.push_back (mux);
  const ObjectPtr<GstPad> frames = pad_of (mux, "sink");
  if (style.codec == "raw")
    chain.to ("codedexposure-filesink", {{"reserve", style.bytes}});
  else
    chain.to ("filesink");
  job.outputs.file (chain.last (), "location", file,
      {.frames = frames.get (), .recording = true});
  job.outputs.file (mux, "log-location", sidecar_of (file),
      {.frames = frames.get (), .sidecar = true});
  if (!job.counted)
    job.counted = mux;
}

Chain
read_recording (Job &job, const std::string &file)
{
  job.source = file;
  const auto info = recording_info (file, false);
  job.is_finished = info && !info->is_cut_short && !info->is_open;
  Chain chain = job.graph.begin ("filesrc", {{"location", file}});
  chain.to ("codedexposure-recorddemux", {{"salvage", job.salvage}});
  job.reader = chain.last ();
  return chain;
}

std::string
no_part_text (const std::string &file)
{
  return file +
         " is damaged between its frames, so that a part of it is not found; "
         "write its index anew (\"ffmpeg -i IN.mkv -map 0 -c copy OUT.mkv\"), "
         "or decode all of it";
}

Chain
read_sender (Job &job, const std::string &host, int port)
{
  job.source = host + ":" + std::to_string (port);
  Chain chain =
      job.graph.begin ("tcpclientsrc", {{"host", host}, {"port", port}});
  job.salvage = true;
  chain.to ("codedexposure-recorddemux", {{"salvage", true}});
  job.reader = chain.last ();
  return chain;
}

} // namespace codedexposure::app
