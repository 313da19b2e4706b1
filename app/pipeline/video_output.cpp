/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "video_output.h"

#include <regex>
#include <utility>

#include "pipeline/frame_counter.h"
#include "pipeline/pads.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

constexpr const char *kVideoForms =
    ".mkv (FFV1, lossless), .mp4 (H.264), .ome.tif, .h5, .ome.zarr, / (a "
    "folder of PNG) or %06d.png";
constexpr const char *kZarr = ".ome.zarr"; // a folder

void
write_file (Job &job, Chain &chain, const std::string &name, GstPad *frames)
{
  chain.to ("filesink");
  job.outputs.file (chain.last (), "location", name, {.frames = frames});
}

void
write_mkv (
    Job &job, Chain &chain, const std::string &name, const VideoStyle &style)
{
  chain.to ("codedexposure-recordmux",
      {{"codec", style.encoded ? "copy" : "ffv1"}, {"threads", style.threads}});
  const auto frames = pad_of (chain.last (), "sink");
  write_file (job, chain, name, frames.get ());
}

/* The muxer would take other pictures than before, which no player can read. */
void
refuse_change (GstElement *encoder)
{
  constexpr int kWhat =
      GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM | GST_PAD_PROBE_TYPE_BUFFER;
  add_probe (pad_of (encoder, "sink").get (), kWhat,
      [encoder, refused = false] (GstPad *pad, GstPadProbeInfo *info) mutable {
        if (GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_BUFFER)
          return refused ? GST_PAD_PROBE_DROP : GST_PAD_PROBE_OK;
        GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
        const CapsPtr before (gst_pad_get_current_caps (pad));
        if (GST_EVENT_TYPE (event) != GST_EVENT_CAPS || !before ||
            gst_caps_is_equal (before.get (), caps_of (event)))
          return GST_PAD_PROBE_OK;
        if (!std::exchange (refused, true))
          GST_ELEMENT_ERROR (encoder, STREAM, FORMAT,
              ("the size or the rate of the pictures changes"), (nullptr));
        return GST_PAD_PROBE_DROP;
      });
}

/* All players and browsers support 4:2:0 with even sides and values from 16 to
 * 235. From grey, videoconvert would not scale the values, so they go through
 * colour, with 16 bits for exact values. All other modes of x264 spend less on
 * pictures that follow each other fast, but these are looked at one by one. The
 * fragments of a file that was not finished can be played. Its bytes depend on
 * the number of threads, so that is fixed. A video to look at begins at 0; its
 * provenance names its first frame. */
void
write_mp4 (
    Job &job, Chain &chain, const std::string &name, const VideoStyle &style)
{
  chain.to ("identity", {{"silent", true}});
  begin_at_zero (chain.last ());
  add_view (chain, style.bits, style.white);
  chain.to ("videoconvert")
      .caps ("video/x-raw,format=ARGB64")
      .to ("videoconvert")
      .to ("videoscale")
      .caps ("video/x-raw,format=I420,width=[2,65536,2],height=[2,65536,2]")
      .to ("x264enc",
          {{"pass", "quant"}, {"quantizer", 18}, {"vbv-buf-capacity", 0},
              {"speed-preset", "veryfast"}, {"threads", 4}});
  refuse_change (chain.last ());
  const auto frames = pad_of (chain.last (), "sink");
  chain.to ("mp4mux", {{"fragment-duration", 1000},
                          {"fragment-mode", "first-moov-then-finalise"}});
  write_file (job, chain, name, frames.get ());
}

void
write_stack (
    Job &job, Chain &chain, const std::string &name, const VideoStyle &style)
{
  const ObjectPtr<GstElementFactory> found (
      gst_element_factory_find ("codedexposure-stack"));
  if (!found)
    fail (name + ": this build has neither libtiff nor HDF5 nor zstd; install "
                 "libtiff-dev, libhdf5-dev and libzstd-dev, and build again");
  chain.to ("codedexposure-stack", {{"deflate", style.deflate}});
  const auto frames = pad_of (chain.last (), "sink");
  std::string path = name;
  if (path.ends_with ("/"))
    path.pop_back ();
  job.outputs.file (chain.last (), "location", path,
      {.frames = frames.get (),
          .folder_with = path.ends_with (kZarr) ? "zarr.json" : nullptr});
}

/* A folder may have any name; only the last part is a format. Without the caps,
 * videoconvert makes 8-bit colours of 16-bit grey. */
void
write_pictures (
    Job &job, Chain &chain, const std::string &name, const VideoStyle &style)
{
  std::string pattern = name;
  if (name.ends_with ("/"))
    pattern = std::regex_replace (name, std::regex ("%"), "%%") + "%06d.png";
  if (style.view)
    add_view (chain, style.bits, style.white);
  chain.to ("videoconvert")
      .caps ("video/x-raw,format={GRAY8,GRAY16_BE}")
      .to ("pngenc", {{"snapshot", false}})
      .to ("multifilesink");
  const auto coded = style.coded ? pad_of (style.coded, "sink") : nullptr;
  job.outputs.pictures (chain.last (), coded.get (), pattern);
}

} // namespace

std::optional<VideoForm>
form_of (const std::string &name)
{
  static const std::regex numbers (".*%(0[1-9])?d.*\\.png");
  if (name.ends_with (".mkv"))
    return VideoForm::mkv;
  if (name.ends_with (".mp4"))
    return VideoForm::mp4;
  for (const char *end : {".ome.tif", ".ome.tiff", ".h5", kZarr, ".ome.zarr/"})
    if (name.ends_with (end))
      return VideoForm::stack;
  if (name.ends_with ("/") || std::regex_match (name, numbers))
    return VideoForm::pictures;
  return std::nullopt;
}

void
write_video (
    Job &job, Chain &chain, const std::string &name, const VideoStyle &style)
{
  const auto form = form_of (name);
  if (!form)
    usage_error ("--output " + name + ": end in " + kVideoForms);
  switch (*form) {
  case VideoForm::mkv:
    write_mkv (job, chain, name, style);
    break;
  case VideoForm::mp4:
    write_mp4 (job, chain, name, style);
    break;
  case VideoForm::stack:
    write_stack (job, chain, name, style);
    break;
  case VideoForm::pictures:
    write_pictures (job, chain, name, style);
    break;
  }
  if (!style.is_coded)
    job.outputs.last_has_pictures ();
}

void
add_view (Chain &chain, std::optional<int> bits, std::optional<int> white)
{
  chain.to ("codedexposure-view", {{"bits", bits}, {"white", white}});
}

} // namespace codedexposure::app
