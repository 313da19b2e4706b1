/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "partner_seek.h"

#include <algorithm>
#include <atomic>
#include <memory>

#include "common/meta.h"
#include "common/raii.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

/* PTS at position 0 of a stream, which a seek does not change. */
constexpr gint64 kUnknown = -1;
using Zero = std::atomic<gint64>;

struct Turner {
  Zero coded = kUnknown, partners = kUnknown;
  std::atomic<bool> says_exposures = false;
};
using Held = std::shared_ptr<Turner>; // by both probes

/* A quarter of the frame period, by which partners may be apart. */
gint64
slack_at (GstPad *pad)
{
  const CapsPtr caps (gst_pad_get_current_caps (pad));
  GstVideoInfo info;
  if (!caps || !gst_video_info_from_caps (&info, caps.get ()) ||
      info.fps_n <= 0)
    return 0;
  return GST_SECOND * info.fps_d / (4 * gint64 (info.fps_n));
}

GstEvent *
turned (GstEvent *seek, gint64 shift, gint64 slack)
{
  gdouble rate = 1;
  GstFormat format = GST_FORMAT_TIME;
  GstSeekFlags flags = GST_SEEK_FLAG_NONE;
  GstSeekType start_type = GST_SEEK_TYPE_NONE, stop_type = GST_SEEK_TYPE_NONE;
  gint64 start = 0, stop = -1;
  gst_event_parse_seek (
      seek, &rate, &format, &flags, &start_type, &start, &stop_type, &stop);
  if (start_type == GST_SEEK_TYPE_SET)
    start = std::max<gint64> (0, start + shift - slack);
  if (stop_type == GST_SEEK_TYPE_SET && stop >= 0)
    stop = std::max<gint64> (start + 1, stop + shift + slack);
  GstEvent *made = gst_event_new_seek (
      rate, format, flags, start_type, start, stop_type, stop);
  gst_event_set_seqnum (made, gst_event_get_seqnum (seek));
  return made;
}

void
follow (GstEvent *event, Zero &zero)
{
  if (GST_EVENT_TYPE (event) != GST_EVENT_SEGMENT)
    return;
  const GstSegment *segment = segment_of (event);
  if (segment->format == GST_FORMAT_TIME)
    zero = gint64 (segment->start) - gint64 (segment->time);
}

GstPadProbeReturn
on_coded (GstPad *, GstPadProbeInfo *info, gpointer held)
{
  follow (
      GST_PAD_PROBE_INFO_EVENT (info), (*static_cast<Held *> (held))->coded);
  return GST_PAD_PROBE_OK;
}

GstPadProbeReturn
on_partners (GstPad *pad, GstPadProbeInfo *info, gpointer held)
{
  const Held &self = *static_cast<Held *> (held);
  if (GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_BUFFER) {
    const auto meta = get_frame_meta (GST_PAD_PROBE_INFO_BUFFER (info));
    self->says_exposures =
        meta && GST_CLOCK_TIME_IS_VALID (meta->exposure_start);
    return GST_PAD_PROBE_OK;
  }
  GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
  follow (event, self->partners);
  const gint64 coded = self->coded, partners = self->partners;
  if (GST_EVENT_TYPE (event) != GST_EVENT_SEEK || !self->says_exposures ||
      coded == kUnknown || partners == kUnknown)
    return GST_PAD_PROBE_OK;
  info->data = turned (event, coded - partners, slack_at (pad));
  gst_event_unref (event);
  return GST_PAD_PROBE_OK;
}

} // namespace

void
turn_seeks (GstElement *partners, GstPad *coded)
{
  const auto turner = std::make_shared<Turner> ();
  const auto watch = [&turner] (GstPad *pad, int what, GstPadProbeCallback on) {
    gst_pad_add_probe (pad, GstPadProbeType (what), on, new Held (turner),
        [] (gpointer held) { delete static_cast<Held *> (held); });
  };
  watch (coded, GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM, on_coded);
  watch (pad_of (partners, "src").get (),
      GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_BOTH, on_partners);
}

} // namespace codedexposure::app
