/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync between pads of the test, linked in so that the mirrors of simulated
 * DMDs are those of the test. */
#pragma once

#include <array>

#include "common/meta.h"
#include "harness.h"
#include "schedule/timing.h"

namespace codedexposure::test
{

constexpr int kSyncWidth = 64;
constexpr int kSyncHeight = 48;

/** A dmdsync with @p settings, and frames for it. */
class SyncHarness : public ElementHarness
{
public:
  explicit SyncHarness (const std::string &settings = "")
      : ElementHarness ("dmdsync " + settings)
  {
  }

  /** Sends caps of 64x48 pixels at @p rate and a segment. */
  void start (const FrameRate &rate = {25, 1})
  {
    rate_ = rate;
    set_caps (gray_caps (kSyncWidth, kSyncHeight,
        std::to_string (rate.num) + "/" + std::to_string (rate.den)));
  }
  GstClockTime time_of (int frame) const
  {
    return GstClockTime (rate_.time_of (frame));
  }

  /** Sends a frame, flat or with a level for each element of a 2x2 tile. */
  GstFlowReturn send (GstClockTime pts, int level = 100)
  {
    return send_levels (pts, {level, level, level, level});
  }
  GstFlowReturn send_levels (GstClockTime pts, std::array<int, 4> levels)
  {
    return push (frame_of (draw<std::uint8_t> (kSyncWidth, kSyncHeight,
                               [&] (int x, int y) {
                                 return levels[std::size_t (x % 2 + y % 2 * 2)];
                               }),
        pts));
  }
  /** Sends frames @p first to @p last - 1 at their times. */
  void send_frames (int first, int last)
  {
    for (int frame = first; frame < last; frame++)
      ASSERT_EQ (send (time_of (frame)), GST_FLOW_OK);
  }

  template <typename T>
  T get_property (const char *name)
  {
    return property<T> (element (), name);
  }
  guint64 counter (const char *name)
  {
    GstStructure *stats = nullptr;
    g_object_get (element (), "stats", &stats, nullptr);
    const StructurePtr owned (stats);
    guint64 value = G_MAXUINT64;
    EXPECT_TRUE (gst_structure_get_uint64 (stats, name, &value)) << name;
    return value;
  }

private:
  FrameRate rate_;
};

inline bool
has_flag (const BufferPtr &buffer, GstBufferFlags flag)
{
  return GST_BUFFER_FLAG_IS_SET (buffer.get (), flag);
}

inline FrameMeta
meta_of (const BufferPtr &buffer)
{
  const auto meta = get_frame_meta (buffer.get ());
  EXPECT_TRUE (meta);
  return meta.value_or (FrameMeta ());
}

inline guint64
uint64_field (const MessagePtr &message, const char *name)
{
  guint64 value = G_MAXUINT64;
  EXPECT_TRUE (
      message && gst_structure_get_uint64 (
                     gst_message_get_structure (message.get ()), name, &value))
      << name;
  return value;
}

inline int
int_field (const MessagePtr &message, const char *name)
{
  int value = G_MININT;
  EXPECT_TRUE (
      message && gst_structure_get_int (
                     gst_message_get_structure (message.get ()), name, &value))
      << name;
  return value;
}

inline std::string
string_field (const MessagePtr &message, const char *name)
{
  EXPECT_TRUE (message) << "no message with " << name;
  const gchar *text =
      message ? gst_structure_get_string (
                    gst_message_get_structure (message.get ()), name)
              : nullptr;
  return text ? text : "";
}

} // namespace codedexposure::test
