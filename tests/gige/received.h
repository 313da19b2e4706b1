/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What comes from a camera in software, compared with what it sent. */
#pragma once

#include <map>
#include <string>
#include <vector>

#include "camera_rig.h"

namespace codedexposure::test
{

/** Pixels of @p buffer that are not those of the scene's frame. */
template <typename Pixel>
int
wrong_pixels (GstBuffer *buffer, const GstVideoInfo &info, std::uint64_t frame,
    int mask, int shift = 0)
{
  MappedFrame mapped (info, buffer, GST_MAP_READ);
  if (!mapped)
    return -1;
  const auto view = view_of<Pixel> (mapped);
  int wrong = 0;
  for (int y = 0; y < view.height; y++)
    for (int x = 0; x < view.width; x++)
      wrong += view.at (x, y) != ((scene_pixel (frame, x, y) & mask) << shift);
  return wrong;
}

/** What came behind dmdsync, each frame compared with the scene's frame of its
 * number. Nobody knows of frames that are lost before the first one, and those
 * that were exposed before the stream's time 0 have a number but do not come.
 */
struct Received {
  guint64 scene = 0;             // first frame of the camera's
  std::map<guint64, int> frames; // by number, how often
  std::vector<guint64> order;
  guint64 first_frame = 0; // of the camera, that is number 0
  int wrong = 0;

  void take (GstBuffer *buffer, const GstVideoInfo &info)
  {
    const guint64 number = GST_BUFFER_OFFSET (buffer);
    if (order.empty ()) {
      guint64 frame = number;
      while (frame < number + 100 &&
             wrong_pixels<std::uint8_t> (buffer, info, scene + frame, 255) > 0)
        frame++;
      first_frame = frame - number;
    }
    frames[number]++;
    order.push_back (number);
    wrong += wrong_pixels<std::uint8_t> (
                 buffer, info, scene + first_frame + number, 255) != 0;
  }
};

/** Frames that dmdsync was given, and that are not lost on purpose. */
inline guint64
came (const CameraPipeline &pipeline, const Received &received)
{
  return received.order.size () + counter (pipeline, "frames-early");
}

inline guint64
sum_of (const CameraPipeline &pipeline, const char *message, const char *field)
{
  guint64 sum = 0;
  for (const MessagePtr &said : pipeline.messages) {
    const GstStructure *structure = gst_message_get_structure (said.get ());
    guint64 value = 0;
    if (structure && gst_structure_has_name (structure, message) &&
        gst_structure_get_uint64 (structure, field, &value))
      sum += value;
  }
  return sum;
}

constexpr const char *kSync = "dmdsync name=sync timestamp-at=device-clock ! ";

} // namespace codedexposure::test
