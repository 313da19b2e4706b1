/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A recording of the part log, and what the part restore makes of it. */
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "recorded.h"

namespace codedexposure::test
{

/** kFrames frames: the third is CORRUPTED, late ones are DISCONT. */
struct Recording {
  std::vector<BufferPtr> frames, lines;

  explicit Recording (const std::vector<int> &order = {0, 1, 2, 3, 4, 5},
      const std::vector<guint64> &numbers = {})
  {
    /* The file lets it start before the pad is requested. */
    ElementHarness log ("part-log location=/dev/null");
    log.request ("track");
    log.set_caps (gray_caps (8, 8));
    log.push_event (setup_to_event (setup_of ("staircase:2x2")));
    for (int last = 0; const int i : order) {
      BufferPtr frame = picture (i);
      if (std::exchange (last, std::max (last, i)) > i)
        GST_BUFFER_FLAG_SET (frame.get (), GST_BUFFER_FLAG_DISCONT);
      FrameMeta meta = meta_of (i);
      meta.frame = numbers.empty () ? meta.frame : numbers[std::size_t (i)];
      set_frame_meta (frame.get (), meta);
      if (i == 2)
        GST_BUFFER_FLAG_SET (frame.get (), GST_BUFFER_FLAG_CORRUPTED);
      EXPECT_EQ (log.push (std::move (frame)), GST_FLOW_OK);
      frames.push_back (picture (i));
    }
    log.push_event (gst_event_new_eos ());
    while (BufferPtr line = log.pull ("track"))
      lines.push_back (std::move (line));
    EXPECT_EQ (lines.size (), std::size_t (kFrames + 1));
  }
};

class Restore : public ::testing::Test
{
protected:
  Restore ()
  {
    track.reset (
        gst_harness_new_with_element (file.element (), "track", nullptr));
    gst_harness_set_src_caps_str (track.get (), "text/x-raw,format=utf8");
    file.set_caps (gray_caps (8, 8));
  }
  void push_line (int i)
  {
    gst_harness_push (
        track.get (), recording.lines[std::size_t (i)].release ());
  }
  GstFlowReturn push_frame (int i)
  {
    return file.push (std::move (recording.frames[std::size_t (i)]));
  }
  void end ()
  {
    gst_harness_push_event (track.get (), gst_event_new_eos ());
    file.push_event (gst_event_new_eos ());
  }
  /** All frames and lines, but the named ones. */
  void play (int without_frame = -1, int without_line = -1)
  {
    for (int i = 0; i <= kFrames; i++) {
      if (i != without_line)
        push_line (i);
      if (i < kFrames && i != without_frame)
        push_frame (i);
    }
    end ();
    while (BufferPtr frame = file.pull ())
      restored.push_back (std::move (frame));
  }
  bool corrupted (int i) const
  {
    return GST_BUFFER_FLAG_IS_SET (
        restored.at (std::size_t (i)).get (), GST_BUFFER_FLAG_CORRUPTED);
  }
  /** The setup in the tags that came out last. */
  std::optional<StreamSetup> setup ()
  {
    std::optional<StreamSetup> last;
    while (const EventPtr event = file.pull_event (GST_EVENT_TAG)) {
      GstTagList *tags = nullptr;
      gst_event_parse_tag (event.get (), &tags);
      if (const auto setup = setup_from_tags (tags); setup && *setup)
        last = setup->value ();
    }
    return last;
  }
  std::string schedule ()
  {
    const auto last = setup ();
    return last ? last->schedule.text () : "";
  }

  Recording recording;
  ElementHarness file{"part-restore"};
  HarnessPtr track;
  std::vector<BufferPtr> restored;
};

} // namespace codedexposure::test
