/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Scenes from files. */
#include "footage.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <utility>

#include <gst/app/gstappsink.h>
#include <gst/video/video.h>
#include <nlohmann/json.hpp>

#include "common/raii.h"

namespace codedexposure::quality
{

namespace
{

/* A pipeline that its destructor stops. */
struct Stop {
  void operator() (GstElement *pipeline) const
  {
    gst_element_set_state (pipeline, GST_STATE_NULL);
    gst_object_unref (pipeline);
  }
};
using PipelinePtr = std::unique_ptr<GstElement, Stop>;
using SamplePtr = std::unique_ptr<GstSample, gst::MiniObjectUnref>;
using MessagePtr = std::unique_ptr<GstMessage, gst::MiniObjectUnref>;

gst::ObjectPtr<GstElement>
child (const PipelinePtr &pipeline, const char *name)
{
  return gst::ObjectPtr<GstElement> (
      gst_bin_get_by_name (GST_BIN (pipeline.get ()), name));
}

std::optional<Picture>
picture_of (GstSample *sample)
{
  GstVideoInfo info;
  if (!gst_video_info_from_caps (&info, gst_sample_get_caps (sample)))
    return std::nullopt;
  gst::MappedFrame mapped (info, gst_sample_get_buffer (sample), GST_MAP_READ);
  if (!mapped)
    return std::nullopt;
  Picture picture (GST_VIDEO_INFO_WIDTH (&info), GST_VIDEO_INFO_HEIGHT (&info));
  const auto *data = static_cast<const std::uint8_t *> (
      GST_VIDEO_FRAME_PLANE_DATA (mapped.frame (), 0));
  const int stride = GST_VIDEO_FRAME_PLANE_STRIDE (mapped.frame (), 0);
  for (int y = 0; y < picture.height (); y++)
    std::copy_n (data + std::ptrdiff_t (y) * stride, picture.width (),
        picture.view ().row (y));
  return picture;
}

/* The next frame; none at the end of the file. A decoder that fails only posts
 * an error and leaves the sink waiting. */
Result<SamplePtr>
next_sample (const PipelinePtr &pipeline, GstAppSink *sink)
{
  constexpr GstClockTime kLookAtBus = 100 * GST_MSECOND;
  const gst::ObjectPtr<GstBus> bus (gst_element_get_bus (pipeline.get ()));
  for (;;) {
    SamplePtr sample (gst_app_sink_try_pull_sample (sink, kLookAtBus));
    if (sample || gst_app_sink_is_eos (sink))
      return sample;
    const MessagePtr message (
        gst_bus_pop_filtered (bus.get (), GST_MESSAGE_ERROR));
    if (!message)
      continue;
    GError *error = nullptr;
    gst_message_parse_error (message.get (), &error, nullptr);
    const std::string text = error->message;
    g_error_free (error);
    return Error{text};
  }
}

Result<Scene>
read_clip (
    const std::filesystem::path &folder, const nlohmann::json &item, int frames)
{
  Scene scene{item.at ("name").get<std::string> (), {}};
  const int width = item.at ("width").get<int> ();
  const int height = item.at ("height").get<int> ();
  const int count = std::min (frames, item.at ("frames").get<int> ());
  const auto path = folder / item.at ("file").get<std::string> ();
  std::ifstream file (path, std::ios::binary);
  for (int i = 0; i < count; i++) {
    Picture picture (width, height);
    file.read (reinterpret_cast<char *> (picture.view ().data),
        std::streamsize (width) * height);
    if (!file)
      return Error{path.string () + " ends before frame " +
                   std::to_string (i + 1) + " of " + std::to_string (count)};
    scene.frames.push_back (std::move (picture));
  }
  return scene;
}

} // namespace

Result<Scene>
read_video (const std::string &path, int frames)
{
  if (!std::filesystem::exists (path))
    return Error{path + " is not there"};
  Scene scene{std::filesystem::path (path).stem ().string (), {}};
  const PipelinePtr pipeline (gst_parse_launch (
      "filesrc name=file ! decodebin ! videoconvert ! "
      "video/x-raw,format=GRAY8 ! appsink name=sink sync=false max-buffers=4",
      nullptr));
  if (!pipeline)
    return Error{"GStreamer's base plugins are not there"};
  g_object_set (
      child (pipeline, "file").get (), "location", path.c_str (), nullptr);
  const auto sink = child (pipeline, "sink");
  gst_element_set_state (pipeline.get (), GST_STATE_PLAYING);
  while (int (scene.frames.size ()) < frames) {
    const auto sample = next_sample (pipeline, GST_APP_SINK (sink.get ()));
    if (!sample)
      return Error{path + " cannot be decoded: " + sample.error ().message};
    if (!*sample)
      break;
    std::optional<Picture> picture = picture_of (sample->get ());
    if (!picture)
      return Error{path + " has a frame that cannot be read"};
    scene.frames.push_back (std::move (*picture));
  }
  if (scene.frames.empty ())
    return Error{path + " holds no frame"};
  return scene;
}

Result<std::vector<Scene>>
read_clips (const std::string &folder, int frames)
{
  std::ifstream file (std::filesystem::path (folder) / "manifest.json");
  if (!file)
    return Error{folder + " has no manifest.json"};
  std::vector<Scene> scenes;
  try {
    const auto manifest = nlohmann::json::parse (file);
    for (const nlohmann::json &item : manifest.at ("items")) {
      Result<Scene> scene = read_clip (folder, item, frames);
      if (!scene)
        return scene.error ();
      scenes.push_back (std::move (*scene));
    }
  } catch (const nlohmann::json::exception &wrong) {
    return Error{folder + "/manifest.json: " + wrong.what ()};
  }
  return scenes;
}

} // namespace codedexposure::quality
