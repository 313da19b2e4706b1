/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux that extracts by a schedule, beside what the library
 * extracts. */
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "extract/extractor.h"
#include "harness.h"
#include "preset.h"

namespace codedexposure::test
{

constexpr GstClockTime kPeriod = 40 * GST_MSECOND;

/* Every pixel encodes its position. */
template <typename Pixel = std::uint8_t>
Image<Pixel>
picture (int width = 24, int height = 24)
{
  return draw<Pixel> (width, height, [] (int x, int y) {
    return sizeof (Pixel) == 1 ? (7 * x + 31 * y) % 251 : 2621 * x + 41 * y;
  });
}

/* The subframes of @coded that the library decodes. */
template <typename Pixel>
std::vector<Image<Pixel>>
expected (const std::string &preset, const Image<Pixel> &coded, Method method)
{
  const auto extractor = Extractor<Pixel>::make (
      schedule_of (preset), coded.width (), coded.height (), {method});
  EXPECT_TRUE (extractor) << extractor.error ().message;
  std::vector<Image<Pixel>> subframes (std::size_t (extractor->subframes ()),
      Image<Pixel> (extractor->subframe_size ().width,
          extractor->subframe_size ().height));
  std::vector<ImageView<Pixel>> views;
  for (auto &subframe : subframes)
    views.push_back (subframe.view ());
  EXPECT_TRUE (extractor->run (coded.view (), views));
  return subframes;
}

inline std::string
in_force (ElementHarness &demux)
{
  return text_property (demux.element (), "schedule-in-force");
}

inline int
method_in_force (ElementHarness &demux)
{
  return property<int> (demux.element (), "method-in-force");
}

/** codedexposure-demux that gets frames of 24x24 pixels, 25 a second. */
class DemuxSchedule : public ::testing::Test
{
protected:
  void start (const std::string &settings)
  {
    demux =
        std::make_unique<ElementHarness> ("codedexposure-demux " + settings);
    demux->set_caps (gray_caps (24, 24));
  }
  GstFlowReturn push (int frame)
  {
    return demux->push (frame_of (picture (), GstClockTime (frame) * kPeriod));
  }
  std::unique_ptr<ElementHarness> demux;
};

} // namespace codedexposure::test
