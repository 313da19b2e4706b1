/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Copies a recording with the times of one of a camera: it begins late, because
 * masks are uploaded first, its first frames are half a period apart until the
 * camera's clock is known, and its times jitter.
 *
 *   camera_file IN OUT [OPTION...]
 *
 *   --start=MS          time of the first frame [6400]
 *   --early=N           so many frames are half a period apart [5]
 *   --lose=A-B          frames that are missing
 *   --corrupt=A-B       frames that are flagged
 *   --pattern=A-B       frames during which the mirrors show a pattern
 *   --setup=N:SCHEDULE  from frame N on, they have another schedule
 */
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include <gst/gst.h>

#include "common/meta.h"
#include "common/tag.h"
#include "schedule/schedule.h"

using namespace codedexposure;
using namespace codedexposure::gst;

namespace
{

struct Shape {
  std::map<std::string, std::string> options;

  std::string text (const char *name, const char *otherwise) const
  {
    const auto found = options.find (name);
    return found == options.end () ? otherwise : found->second;
  }
  guint64 number (const char *name, const char *otherwise) const
  {
    return std::strtoull (text (name, otherwise).c_str (), nullptr, 10);
  }
  bool holds (const char *name, guint64 frame) const
  {
    guint64 from = 0, until = 0;
    return std::sscanf (text (name, "").c_str (),
               "%" G_GUINT64_FORMAT "-%" G_GUINT64_FORMAT, &from,
               &until) == 2 &&
           from <= frame && frame <= until;
  }

  GstClockTime pts (guint64 frame, GstClockTime period) const
  {
    const guint64 early = number ("early", "5");
    const guint64 jitter = frame * 7919 % 100'000; // ns
    return number ("start", "6400") * GST_MSECOND +
           std::min (frame, early) * (period / 2) +
           (frame - std::min (frame, early)) * period + jitter;
  }
};

/* The setup that is in force on @pad, with another schedule. */
void
change_setup (GstPad *pad, const std::string &schedule)
{
  for (guint i = 0;; i++) {
    const EventPtr tags (gst_pad_get_sticky_event (pad, GST_EVENT_TAG, i));
    if (!tags)
      std::exit (3);
    const auto setup = setup_from_tags (tags_of (tags.get ()));
    if (!setup)
      continue;
    StreamSetup changed = setup->value ();
    changed.schedule = Schedule::parse (schedule).value ();
    gst_pad_send_event (pad, setup_to_event (changed));
    return;
  }
}

GstPadProbeReturn
on_frame (GstPad *pad, GstPadProbeInfo *info, gpointer data)
{
  const Shape &shape = *static_cast<Shape *> (data);
  GstBuffer *frame =
      gst_buffer_make_writable (GST_PAD_PROBE_INFO_BUFFER (info));
  info->data = frame;
  auto meta = get_frame_meta (frame);
  if (!meta)
    std::exit (3);
  if (shape.holds ("lose", meta->frame))
    return GST_PAD_PROBE_DROP;
  const std::string setup = shape.text ("setup", "");
  const auto colon = setup.find (':');
  if (colon != setup.npos &&
      std::strtoull (setup.c_str (), nullptr, 10) == meta->frame)
    change_setup (pad, setup.substr (colon + 1));
  const GstClockTime pts = shape.pts (meta->frame, GST_BUFFER_DURATION (frame));
  if (GST_CLOCK_TIME_IS_VALID (meta->exposure_start))
    meta->exposure_start += pts - GST_BUFFER_PTS (frame);
  if (shape.holds ("pattern", meta->frame))
    meta->pattern = "black";
  set_frame_meta (frame, *meta);
  GST_BUFFER_PTS (frame) = pts;
  if (shape.holds ("corrupt", meta->frame))
    GST_BUFFER_FLAG_SET (frame, GST_BUFFER_FLAG_CORRUPTED);
  return GST_PAD_PROBE_OK;
}

} // namespace

int
main (int argc, char **argv)
{
  gst_init (&argc, &argv);
  Shape shape;
  for (int i = 3; i < argc; i++) {
    const std::string word = argv[i];
    const auto equals = word.find ('=');
    if (!word.starts_with ("--") || equals == word.npos)
      return 2;
    shape.options[word.substr (2, equals - 2)] = word.substr (equals + 1);
  }
  GstElement *pipeline =
      gst_parse_launch ("filesrc name=in ! codedexposure-recorddemux ! queue ! "
                        "codedexposure-recordmux name=mux ! filesink name=out",
          nullptr);
  if (argc < 3 || !pipeline)
    return 2;
  const auto element = [pipeline] (const char *name) {
    return ObjectPtr<GstElement> (
        gst_bin_get_by_name (GST_BIN (pipeline), name));
  };
  g_object_set (element ("in").get (), "location", argv[1], nullptr);
  g_object_set (element ("out").get (), "location", argv[2], nullptr);
  const ObjectPtr<GstPad> pad (
      gst_element_get_static_pad (element ("mux").get (), "sink"));
  gst_pad_add_probe (
      pad.get (), GST_PAD_PROBE_TYPE_BUFFER, on_frame, &shape, nullptr);
  gst_element_set_state (pipeline, GST_STATE_PLAYING);
  const ObjectPtr<GstBus> bus (gst_element_get_bus (pipeline));
  GstMessage *message =
      gst_bus_timed_pop_filtered (bus.get (), GST_CLOCK_TIME_NONE,
          GstMessageType (GST_MESSAGE_ERROR | GST_MESSAGE_EOS));
  const bool ended = GST_MESSAGE_TYPE (message) == GST_MESSAGE_EOS;
  gst_element_set_state (pipeline, GST_STATE_NULL);
  return ended ? 0 : 1;
}
