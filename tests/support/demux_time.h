/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux, and the times and numbers of what it gives. */
#pragma once

#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "common/meta.h"
#include "harness.h"

namespace codedexposure::test
{

constexpr GstClockTime kMs = GST_MSECOND;

inline BufferPtr
coded_frame (GstClockTime pts, int width = 16, int height = 16)
{
  return frame_of (
      draw<std::uint8_t> (width, height, [] (int x, int y) { return x + y; }),
      pts);
}

inline GstClockTime
pts_of (const BufferPtr &buffer)
{
  return GST_BUFFER_PTS (buffer.get ());
}

inline GstClockTime
duration_of (const BufferPtr &buffer)
{
  return GST_BUFFER_DURATION (buffer.get ());
}

inline bool
discont (const BufferPtr &buffer)
{
  return GST_BUFFER_IS_DISCONT (buffer.get ());
}

/** codedexposure-demux that gets frames of 16x16 pixels. */
class DemuxTime : public ::testing::Test
{
protected:
  void start (const std::string &settings = "schedule=sequential:2x2",
      const std::string &rate = "25/1")
  {
    demux =
        std::make_unique<ElementHarness> ("codedexposure-demux " + settings);
    demux->set_caps (gray_caps (16, 16, rate));
  }
  void push (GstClockTime pts)
  {
    ASSERT_EQ (demux->push (coded_frame (pts)), GST_FLOW_OK);
  }
  void push_all (std::initializer_list<GstClockTime> milliseconds)
  {
    for (GstClockTime ms : milliseconds)
      push (ms * kMs);
  }
  std::vector<BufferPtr> pull_all (const std::string &pad = "")
  {
    return demux->pull_all (pad);
  }
  /** PTS in ms of all subframes on "src", negative for DISCONT. A DISCONT at 0
   * is -1. */
  std::vector<int> discont_times ()
  {
    std::vector<int> times;
    for (const BufferPtr &buffer : pull_all ()) {
      const int ms = int (pts_of (buffer) / kMs);
      times.push_back (discont (buffer) ? (ms == 0 ? -1 : -ms) : ms);
    }
    return times;
  }
  /** Numbers of the frames whose subframes are on "src". */
  std::vector<guint64> frame_numbers ()
  {
    std::vector<guint64> numbers;
    for (const BufferPtr &buffer : pull_all ())
      if (const auto meta = get_frame_meta (buffer.get ()); meta->subframe == 0)
        numbers.push_back (meta->frame);
    return numbers;
  }
  void push_segment (gdouble rate, GstClockTime start, GstClockTime stop)
  {
    GstSegment segment;
    gst_segment_init (&segment, GST_FORMAT_TIME);
    segment.rate = rate;
    segment.start = start;
    segment.stop = stop;
    segment.position = rate < 0 ? stop : start;
    ASSERT_TRUE (demux->push_event (gst_event_new_segment (&segment)));
  }
  guint64 counter (const char *name)
  {
    return counter_of (demux->element (), name);
  }

  std::unique_ptr<ElementHarness> demux;
};

} // namespace codedexposure::test
