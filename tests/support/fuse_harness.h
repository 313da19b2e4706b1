/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-fuse beside what the library fuses. */
#pragma once

#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "fuse/fuser.h"
#include "harness.h"
#include "preset.h"

namespace codedexposure::test
{

constexpr GstClockTime kPeriod = 40 * GST_MSECOND;
constexpr int kWidth = 24, kHeight = 20;

/* Frame @number of a moving texture. */
template <typename Pixel = std::uint8_t>
Image<Pixel>
picture (int number)
{
  return draw<Pixel> (kWidth, kHeight, [number] (int x, int y) {
    const int value = (7 * (x + 3 * number) + 31 * y) % 251;
    return sizeof (Pixel) == 1 ? value : 257 * value;
  });
}

/* The frames that the library fuses from the pictures @numbers. */
template <typename Pixel = std::uint8_t>
std::vector<Image<Pixel>>
expected (const std::string &preset, std::initializer_list<int> numbers,
    const FuseOptions &options = {})
{
  auto fuser =
      Fuser<Pixel>::make (schedule_of (preset), kWidth, kHeight, options);
  EXPECT_TRUE (fuser) << fuser.error ().message;
  std::vector<Image<Pixel>> frames;
  const auto fuse_one = [&] {
    std::vector<Image<Pixel>> slots (std::size_t (fuser->slots ()),
        Image<Pixel> (fuser->size ().width, fuser->size ().height));
    EXPECT_TRUE (fuser->fuse (views_of (slots)));
    frames.insert (frames.end (), slots.begin (), slots.end ());
  };
  for (const int number : numbers) {
    EXPECT_TRUE (fuser->take (picture<Pixel> (number).view ()));
    if (fuser->pending () > options.lookahead)
      fuse_one ();
  }
  while (fuser->pending () > 0)
    fuse_one ();
  return frames;
}

/** codedexposure-fuse that gets frames of a moving texture. */
class Fuse : public ::testing::Test
{
protected:
  void start (const std::string &settings = "schedule=sequential:lattice:4/2",
      const std::string &rate = "25/1", const std::string &format = "GRAY8")
  {
    fuse = std::make_unique<ElementHarness> ("codedexposure-fuse " + settings);
    fuse->set_caps (gray_caps (kWidth, kHeight, rate, format));
  }
  void push (int number, GstClockTime pts, int flags = 0)
  {
    BufferPtr frame = frame_of (picture (number), pts);
    GST_BUFFER_FLAG_SET (frame.get (), flags);
    ASSERT_EQ (fuse->push (std::move (frame)), GST_FLOW_OK);
  }
  void push (int number) { push (number, GstClockTime (number) * kPeriod); }
  void push_segment (GstClockTime start = 0)
  {
    GstSegment segment;
    gst_segment_init (&segment, GST_FORMAT_TIME);
    segment.start = start;
    ASSERT_TRUE (fuse->push_event (gst_event_new_segment (&segment)));
  }
  void flush ()
  {
    ASSERT_TRUE (fuse->push_event (gst_event_new_flush_start ()));
    ASSERT_TRUE (fuse->push_event (gst_event_new_flush_stop (TRUE)));
  }
  std::vector<BufferPtr> pull_all () { return fuse->pull_all (); }
  template <typename Pixel = std::uint8_t>
  std::vector<Image<Pixel>> pull_images ()
  {
    return test::pull_images<Pixel> (*fuse);
  }
  /* Indices of the frames with DISCONT. */
  std::vector<std::size_t> disconts ()
  {
    std::vector<std::size_t> places;
    const auto all = pull_all ();
    for (std::size_t i = 0; i < all.size (); i++)
      if (GST_BUFFER_IS_DISCONT (all[i].get ()))
        places.push_back (i);
    return places;
  }
  GstClockTime min_latency ()
  {
    gst_harness_set_upstream_latency (fuse->get (), 5 * GST_MSECOND);
    return gst_harness_query_latency (fuse->get ());
  }
  std::unique_ptr<ElementHarness> fuse;
};

} // namespace codedexposure::test
