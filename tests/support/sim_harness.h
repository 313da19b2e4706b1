/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-sim with a moving scene before it. */
#pragma once

#include <string>

#include "harness.h"

namespace codedexposure::test
{

constexpr GstClockTime kMs = GST_MSECOND;

/** A scene that differs in every pixel of every frame. */
template <typename Pixel>
Image<Pixel>
scene (int width, int height, int frame)
{
  return draw<Pixel> (width, height, [frame] (int x, int y) {
    return x * 7919 + y * 104729 + frame * 15485863 + x * y * frame;
  });
}

template <typename Pixel>
Image<Pixel>
flat (int width, int height, int value)
{
  return draw<Pixel> (width, height, [value] (int, int) { return value; });
}

class SimHarness : public ElementHarness
{
public:
  explicit SimHarness (const std::string &properties = "")
      : ElementHarness ("codedexposure-sim " + properties)
  {
  }

  /** Sends caps of a size and an input rate; frames of send () follow it. */
  void start (int width, int height, int num = 100, int den = 1,
      const std::string &format = "GRAY8")
  {
    width_ = width;
    height_ = height;
    num_ = num;
    den_ = den;
    set_caps (gray_caps (width, height,
        std::to_string (num) + "/" + std::to_string (den), format));
  }
  /** Time of input frame @p k. */
  GstClockTime time (guint64 k) const
  {
    return gst_util_uint64_scale (
        k, GST_SECOND * guint64 (den_), guint64 (num_));
  }

  template <typename Pixel>
  GstFlowReturn send (int k, const Image<Pixel> &picture)
  {
    return push (frame_of (picture, time (guint64 (k))));
  }
  /** Input frame @p k, all of one value. */
  GstFlowReturn send (int k, int value = 0)
  {
    return send (k, flat<std::uint8_t> (width_, height_, value));
  }
  void send_range (int from, int to)
  {
    for (int k = from; k < to; k++)
      ASSERT_EQ (send (k), GST_FLOW_OK) << "frame " << k;
  }

  template <typename Pixel = std::uint8_t>
  Image<Pixel> coded ()
  {
    const BufferPtr buffer = pull ();
    EXPECT_TRUE (buffer) << "no coded frame";
    return buffer ? image_of<Pixel> (buffer.get (), pad_caps ().get ())
                  : Image<Pixel> ();
  }
  guint64 counter (const char *name)
  {
    return property<guint64> (element (), name);
  }

private:
  int width_ = 0, height_ = 0, num_ = 0, den_ = 1;
};

/** Values of the four elements when each input frame is flat. */
inline std::vector<int>
elements_of (SimHarness &sim, const std::vector<int> &levels)
{
  for (std::size_t k = 0; k < levels.size (); k++)
    EXPECT_EQ (sim.send (int (k), levels[k]), GST_FLOW_OK);
  const Image<std::uint8_t> coded = sim.coded ();
  return {coded.at (0, 0), coded.at (1, 0), coded.at (0, 1), coded.at (1, 1)};
}

} // namespace codedexposure::test
