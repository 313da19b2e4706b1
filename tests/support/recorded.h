/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames with what is known of them, as a recording has them. */
#pragma once

#include "common/meta.h"
#include "common/tag.h"
#include "harness.h"

namespace codedexposure::test
{

inline constexpr GstClockTime kPeriod = 40 * GST_MSECOND;
inline constexpr int kFrames = 6;

inline guint64
counted (GstElement *element, const char *name)
{
  const StructurePtr counters (property<GstStructure *> (element, "counters"));
  guint64 value = 0;
  EXPECT_TRUE (gst_structure_get_uint64 (counters.get (), name, &value));
  return value;
}

inline BufferPtr
picture (int frame)
{
  return frame_of (draw<std::uint8_t> (8, 8,
                       [frame] (int x, int y) { return 9 * frame + x + y; }),
      GstClockTime (frame) * kPeriod);
}

inline FrameMeta
meta_of (int frame)
{
  FrameMeta meta;
  meta.frame = 10 + guint64 (frame);
  meta.exposure_start = GstClockTime (frame) * kPeriod + 3;
  meta.exposure_duration = 39'200'000;
  meta.locked = frame != 3;
  meta.slip = frame == 3 ? 2 : 0;
  meta.lost_before = frame == 1 ? 2 : 0;
  meta.bits = 7;
  return meta;
}

inline StreamSetup
setup_of (const char *schedule)
{
  return {*Schedule::parse (schedule)};
}

} // namespace codedexposure::test
