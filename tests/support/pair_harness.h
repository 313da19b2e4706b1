/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-pair between two cameras of the test. */
#pragma once

#include <thread>
#include <utility>
#include <vector>

#include "common/messages.h"
#include "common/meta.h"
#include "common/partner.h"
#include "common/tag.h"
#include "harness.h"
#include "two_beams.h"

namespace codedexposure::test::pairs
{

using namespace two_beams;

inline constexpr GstClockTime kMs = GST_MSECOND;
inline constexpr GstClockTime kPeriod = 40 * kMs;

/* A frame that is known again by its number. */
inline BufferPtr
numbered (guint64 number, GstClockTime pts, Image<std::uint8_t> picture = {})
{
  if (picture.width () == 0)
    picture = draw<std::uint8_t> (
        kWidth, kHeight, [&] (int x, int y) { return int (number) + x + y; });
  BufferPtr frame = frame_of (picture, pts);
  GST_BUFFER_OFFSET (frame.get ()) = number;
  GST_BUFFER_DURATION (frame.get ()) = kPeriod;
  return frame;
}

/* The frames @numbers, at their times and @late. */
inline std::vector<BufferPtr>
frames (const std::vector<guint64> &numbers, GstClockTime late = 0)
{
  std::vector<BufferPtr> all;
  for (const guint64 number : numbers)
    all.push_back (numbered (number, number * kPeriod + late));
  return all;
}

inline constexpr guint64 kAlone = G_MAXUINT64;
using Numbers = std::vector<std::pair<guint64, guint64>>; ///< with partner

class Pair : public ::testing::Test
{
protected:
  Pair ()
      : pair ("codedexposure-pair", "on", "src"),
        off (gst_harness_new_with_element (pair.element (), "off", nullptr))
  {
    gst_harness_set_live (pair.get (), FALSE);
    gst_harness_set_live (off.get (), FALSE);
    pair.set_caps (gray_caps (kWidth, kHeight));
    gst_harness_set_src_caps_str (
        off.get (), gray_caps (kWidth, kHeight).c_str ());
  }

  /* All frames of both cameras, each from a thread of its own, to the end. */
  Numbers run (std::vector<BufferPtr> on, std::vector<BufferPtr> partners)
  {
    const auto push = [] (GstHarness *to, std::vector<BufferPtr> all) {
      for (BufferPtr &frame : all)
        gst_harness_push (to, frame.release ());
      gst_harness_push_event (to, gst_event_new_eos ());
    };
    std::jthread second (push, off.get (), std::move (partners));
    std::jthread first (push, pair.get (), std::move (on));
    Numbers numbers;
    GstBuffer *next = nullptr;
    /* With an error, the end does not come. */
    while (gst_harness_pull_until_eos (pair.get (), &next) && next) {
      out.emplace_back (next);
      const auto partner = get_partner (next);
      numbers.emplace_back (GST_BUFFER_OFFSET (next),
          partner ? GST_BUFFER_OFFSET (partner->buffer.get ()) : kAlone);
    }
    return numbers;
  }
  guint64 counter (const char *name)
  {
    return property<guint64> (pair.element (), name);
  }
  void expect_counters (
      guint64 paired, guint64 alone, guint64 refused, guint64 dropped)
  {
    EXPECT_EQ (counter ("frames-paired"), paired);
    EXPECT_EQ (counter ("frames-alone"), alone);
    EXPECT_EQ (counter ("pairs-refused"), refused);
    EXPECT_EQ (counter ("partners-dropped"), dropped);
  }
  void expect_lost (
      const char *reason, guint64 count, GstClockTime from, GstClockTime to)
  {
    const auto begun = pair.posted<PartnerLost> ();
    const auto ended = pair.posted<PartnerLost> ();
    ASSERT_TRUE (begun && ended);
    EXPECT_TRUE (begun->active);
    EXPECT_EQ (begun->reason, reason);
    EXPECT_EQ (begun->from, from);
    EXPECT_FALSE (ended->active);
    EXPECT_EQ (ended->reason, reason);
    EXPECT_EQ (ended->frames, count);
    EXPECT_EQ (ended->from, from);
    EXPECT_EQ (ended->to, to);
  }
  void push_setup (GstHarness *to, const StreamSetup &setup)
  {
    ASSERT_TRUE (gst_harness_push_event (to, setup_to_event (setup)));
  }
  /* The stream tag, with a second camera of 40x30 pixels of that setup. */
  std::optional<StreamSetup> tag_with (StreamSetup second)
  {
    second.off_beam = true;
    push_setup (off.get (), second);
    push_setup (pair.get (), {.schedule = second.schedule});
    gst_harness_set_src_caps_str (off.get (), gray_caps (40, 30).c_str ());
    run (frames ({0}), {});
    std::optional<StreamSetup> tagged;
    while (const EventPtr event = pair.pull_event (GST_EVENT_TAG))
      if (const auto setup = setup_from_tags (tags_of (event.get ())))
        tagged = setup->value ();
    return tagged;
  }

  ElementHarness pair;
  HarnessPtr off;
  std::vector<BufferPtr> out;
};

} // namespace codedexposure::test::pairs
