/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "emulation/frame_source.h"

#include <algorithm>

#include "pipeline/messages.h"

namespace codedexposure::app
{

using namespace gst;

Result<std::unique_ptr<FrameSource>>
FrameSource::open (Chain &chain, bool loop)
{
  chain.caps ("video/x-raw,format={GRAY8,GRAY16_LE}")
      .to ("appsink", {{"sync", false}, {"max-buffers", 4}});
  auto frames = std::unique_ptr<FrameSource> (new FrameSource);
  frames->pipeline_ = chain.graph ().pipeline ();
  frames->sink_ = GST_APP_SINK (chain.last ());
  frames->loop_ = loop;
  gst_element_set_state (frames->pipeline_, GST_STATE_PLAYING);
  if (!frames->advance ())
    return Error{frames->why_ended ()};
  return frames;
}

FrameSource::~FrameSource ()
{
  gst_element_set_state (pipeline_, GST_STATE_NULL);
}

bool
FrameSource::advance ()
{
  sample_.reset (gst_app_sink_pull_sample (sink_));
  if (!sample_ && loop_ && gst_app_sink_is_eos (sink_) &&
      gst_element_seek_simple (
          pipeline_, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH, 0))
    sample_.reset (gst_app_sink_pull_sample (sink_));
  ended_ = !sample_ || !gst_video_info_from_caps (
                           &info_, gst_sample_get_caps (sample_.get ()));
  return !ended_;
}

bool
FrameSource::take (ImageView<std::uint16_t> picture)
{
  if (!sample_ && !advance ())
    return false;
  MappedFrame mapped (
      info_, gst_sample_get_buffer (sample_.get ()), GST_MAP_READ);
  if (mapped)
    read_pixels (mapped, [&picture] (auto pixels) {
      for (int y = 0; y < picture.height; y++)
        std::copy_n (pixels.row (y), picture.width, picture.row (y));
    });
  mapped.reset ();
  sample_.reset ();
  return true;
}

std::string
FrameSource::why_ended () const
{
  const MessagePtr message = next_message (pipeline_, GST_MESSAGE_ERROR);
  return message ? Told (message.get ()).error->message : "the scene has ended";
}

} // namespace codedexposure::app
