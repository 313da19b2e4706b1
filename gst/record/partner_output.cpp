/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "partner_output.h"

#include <utility>

#include <gst/video/video.h>

#include "common/element.h"
#include "common/kept_frame.h"
#include "common/meta.h"
#include "common/tag.h"
#include "parts.h"

namespace codedexposure::gst
{

void
PartnerOutput::restart ()
{
  PartnerOutput fresh;
  fresh.pad_ = pad_;
  *this = std::move (fresh);
}

void
PartnerOutput::follow (GstEvent *event)
{
  switch (GST_EVENT_TYPE (event)) {
  case GST_EVENT_STREAM_START:
    stream_sent_ = segment_sent_ = setup_sent_ = false;
    caps_.reset ();
    break;
  case GST_EVENT_SEGMENT:
    segment_sent_ = false;
    break;
  case GST_EVENT_FLUSH_STOP:
    last_.reset ();
    last_number_.reset ();
    [[fallthrough]];
  case GST_EVENT_EOS:
  case GST_EVENT_FLUSH_START:
    gst_pad_push_event (pad_, gst_event_ref (event));
    break;
  default:
    break;
  }
}

void
PartnerOutput::set_setup (const StreamSetup &setup)
{
  StreamSetup own{.schedule = setup.schedule,
      .mapping = setup.partner->mapping,
      .size = setup.partner->size,
      .rate = setup.rate,
      .bits = setup.bits,
      .simulated = setup.simulated,
      .off_beam = true};
  if (setup_ == own)
    return;
  setup_ = std::move (own);
  setup_sent_ = false;
}

/* None: frames that are encoded cannot be made here. */
std::optional<Partner>
PartnerOutput::stand_in (GstCaps *caps) const
{
  GstVideoInfo info;
  if (last_)
    return Partner{BufferPtr (gst_buffer_ref (last_->buffer.get ())),
        CapsPtr (gst_caps_ref (last_->caps.get ()))};
  if (is_encoded (caps) || !setup_ || !gst_video_info_from_caps (&info, caps))
    return {};
  const auto [width, height] = *setup_->size;
  CapsPtr own (gst_caps_copy (caps));
  gst_caps_set_simple (own.get (), "width", G_TYPE_INT, width, "height",
      G_TYPE_INT, height, nullptr);
  if (!gst_video_info_from_caps (&info, own.get ()))
    return {};
  const gsize size = GST_VIDEO_INFO_SIZE (&info);
  BufferPtr black (gst_buffer_new_allocate (nullptr, size, nullptr));
  gst_buffer_memset (black.get (), 0, 0, size);
  return Partner{std::move (black), std::move (own)};
}

guint64
PartnerOutput::lost_before (GstBuffer *frame)
{
  const auto partner = get_partner (frame);
  const auto meta =
      partner ? get_frame_meta (partner->buffer.get ()) : std::nullopt;
  if (!meta)
    return 0;
  const auto before = std::exchange (last_number_, meta->frame);
  return before && meta->frame > *before ? meta->frame - *before - 1 : 0;
}

void
PartnerOutput::use_caps (const CapsPtr &caps)
{
  if (caps_ && gst_caps_is_equal (caps_.get (), caps.get ()))
    return;
  caps_.reset (gst_caps_ref (caps.get ()));
  gst_pad_push_event (pad_, gst_event_new_caps (caps.get ()));
}

GstFlowReturn
PartnerOutput::push (GstElement *element, GstBuffer *frame, GstCaps *caps,
    const GstSegment &segment)
{
  auto partner = get_partner (frame);
  const bool is_alone = !partner;
  if (is_alone)
    partner = stand_in (caps);
  if (!partner) {
    POST_ERROR (element, STREAM, FORMAT,
        "The first frame has no partner, so that the track of the second "
        "camera cannot begin with it. Begin with a later frame, or decode the "
        "frames before they are recorded again.");
    return GST_FLOW_ERROR;
  }
  if (!std::exchange (stream_sent_, true)) {
    const CharPtr id (gst_pad_create_stream_id (pad_, element, "partner"));
    gst_pad_push_event (pad_, gst_event_new_stream_start (id.get ()));
  }
  use_caps (partner->caps);
  if (!std::exchange (segment_sent_, true))
    gst_pad_push_event (pad_, gst_event_new_segment (&segment));
  if (setup_ && !std::exchange (setup_sent_, true))
    gst_pad_push_event (pad_, setup_to_event (*setup_));
  BufferPtr buffer (gst_buffer_copy (partner->buffer.get ()));
  GST_BUFFER_PTS (buffer.get ()) = GST_BUFFER_PTS (frame);
  GST_BUFFER_DTS (buffer.get ()) = GST_CLOCK_TIME_NONE;
  GST_BUFFER_DURATION (buffer.get ()) = GST_BUFFER_DURATION (frame);
  if (is_alone)
    GST_BUFFER_FLAG_SET (buffer.get (), GST_BUFFER_FLAG_GAP);
  last_ = {kept_frame (partner->buffer.get ()), std::move (partner->caps)};
  return gst_pad_push (pad_, buffer.release ());
}

} // namespace codedexposure::gst
