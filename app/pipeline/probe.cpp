/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "probe.h"

#include <filesystem>
#include <memory>

#include <gst/pbutils/pbutils.h>

#include "common/raii.h"
#include "common/tag.h"
#include "failure.h"

namespace codedexposure::app
{

using namespace gst;

VideoFacts
probe_video (const std::string &path)
{
  constexpr GstClockTime kPatience = 30 * GST_SECOND;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file (path, ignored))
    fail ("cannot read " + path + "; give the name of a video file");
  const ObjectPtr<GstDiscoverer> discoverer (
      gst_discoverer_new (kPatience, nullptr));
  const CharPtr uri (gst_filename_to_uri (path.c_str (), nullptr));
  const ObjectPtr<GstDiscovererInfo> info (
      discoverer && uri
          ? gst_discoverer_discover_uri (discoverer.get (), uri.get (), nullptr)
          : nullptr);
  const std::unique_ptr<GList, FreeWith<gst_discoverer_stream_info_list_free>>
      streams (
          info ? gst_discoverer_info_get_video_streams (info.get ()) : nullptr);
  if (!streams)
    fail (path + " is no video that the installed decoders can read");
  auto *video = GST_DISCOVERER_VIDEO_INFO (streams->data);
  for (const GstTagList *tags : {gst_discoverer_info_get_tags (info.get ()),
           gst_discoverer_stream_info_get_tags (
               GST_DISCOVERER_STREAM_INFO (video))})
    if (tags && setup_from_tags (tags))
      fail (path + " has coded frames, which are no scene; decode it first",
          Exit::usage);
  return {{int (gst_discoverer_video_info_get_width (video)),
              int (gst_discoverer_video_info_get_height (video))},
      {int (gst_discoverer_video_info_get_framerate_num (video)),
          int (gst_discoverer_video_info_get_framerate_denom (video))}};
}

} // namespace codedexposure::app
