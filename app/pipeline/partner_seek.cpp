/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "partner_seek.h"

#include <algorithm>
#include <atomic>
#include <memory>

#include "common/meta.h"
#include "pipeline/pads.h"

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

/* A quarter of the frame period, by which partners may be apart. */
gint64
slack_at (GstPad *pad)
{
  const auto info = video_at (pad);
  return info && info->fps_n > 0
             ? GST_SECOND * info->fps_d / (4 * gint64 (info->fps_n))
             : 0;
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

void
watch_partners (Turner &turner, GstPad *pad, GstPadProbeInfo *info)
{
  if (GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_BUFFER) {
    const auto meta = get_frame_meta (GST_PAD_PROBE_INFO_BUFFER (info));
    turner.says_exposures =
        meta && GST_CLOCK_TIME_IS_VALID (meta->exposure_start);
    return;
  }
  GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
  follow (event, turner.partners);
  const gint64 coded = turner.coded, partners = turner.partners;
  if (GST_EVENT_TYPE (event) != GST_EVENT_SEEK || !turner.says_exposures ||
      coded == kUnknown || partners == kUnknown)
    return;
  info->data = turned (event, coded - partners, slack_at (pad));
  gst_event_unref (event);
}

} // namespace

void
turn_seeks (GstElement *partners, GstPad *coded)
{
  const auto turner = std::make_shared<Turner> (); // of both probes
  add_probe (coded, GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM,
      [turner] (GstPad *, GstPadProbeInfo *info) {
        follow (GST_PAD_PROBE_INFO_EVENT (info), turner->coded);
        return GST_PAD_PROBE_OK;
      });
  add_probe (pad_of (partners, "src").get (),
      GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_BOTH,
      [turner] (GstPad *pad, GstPadProbeInfo *info) {
        watch_partners (*turner, pad, info);
        return GST_PAD_PROBE_OK;
      });
}

} // namespace codedexposure::app
