/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Images that do not fit what they are given to are refused, and left alone. */
#include <functional>

#include <gtest/gtest.h>

#include "extract/extractor.h"
#include "fuse/fuser.h"
#include "rectify/rectifier.h"

namespace
{

using namespace codedexposure;

template <typename Pixel>
using Views = std::vector<ImageView<Pixel>>;

template <typename Pixel>
class ViewsTest : public ::testing::Test
{
protected:
  static constexpr int kWidth = 12, kHeight = 8;

  void SetUp () override
  {
    coded = memory.view ().block (0, 0, kWidth, kHeight);
    for (int k = 0; k < 4; k++)
      halves.push_back (
          memory.view ().block (16 + 6 * (k % 2), 4 * (k / 2), 6, 4));
    for (int k = 0; k < 4; k++)
      wholes.push_back (memory.view ().block (16 * k, 16, kWidth, kHeight));
  }

  /** How a view can be wrong, each way at one of @p views. */
  static std::vector<Views<Pixel>> spoilt (const Views<Pixel> &views)
  {
    std::vector<Views<Pixel>> all;
    const auto spoil = [&] (const std::function<void (ImageView<Pixel> &)> &how,
                           std::size_t which) {
      all.push_back (views);
      how (all.back ()[which]);
    };
    using View = ImageView<Pixel>;
    for (const std::size_t which : {std::size_t (0), views.size () - 1}) {
      spoil ([] (View &view) { view.data = nullptr; }, which);
      spoil ([] (View &view) { view.width--; }, which);
      spoil ([] (View &view) { view.height++; }, which);
      spoil ([] (View &view) { view.height = -view.height; }, which);
      spoil (
          [] (View &view) {
            view.stride = view.width * std::ptrdiff_t (sizeof (Pixel)) - 1;
          },
          which);
      spoil ([] (View &view) { view.stride = -view.stride; }, which);
      if constexpr (sizeof (Pixel) > 1)
        spoil ([] (View &view) { view.stride++; }, which);
    }
    return all;
  }

  /** Outputs that share a pixel with each other or with @p input. */
  static std::vector<Views<Pixel>> overlapping (
      const Views<Pixel> &views, ImageView<Pixel> input)
  {
    std::vector<Views<Pixel>> all (5, views);
    all[0].back () = views.front ();
    all[1].back ().data = views.front ().data + views.front ().width - 1;
    all[2].back ().data = views.front ().row (views.front ().height - 1) -
                          views.front ().width + 1;
    all[3].front ().data = input.row (input.height - 1) + input.width - 1;
    all[4].front () =
        input.block (0, 0, views.front ().width, views.front ().height);
    all[4].front ().stride =
        std::ptrdiff_t (std::size_t (views.front ().width) * sizeof (Pixel));
    return all;
  }

  template <typename Run>
  void expect_refused (const std::vector<Views<Pixel>> &all, const Run &run)
  {
    const Image<Pixel> before = memory;
    for (std::size_t i = 0; i < all.size (); i++) {
      const auto result = run (all[i]);
      EXPECT_FALSE (result) << i;
      if (!result) {
        EXPECT_EQ (result.error ().code, ErrorCode::invalid_argument);
      }
    }
    EXPECT_EQ (memory, before);
  }

  Image<Pixel> memory{64, 32};
  ImageView<Pixel> coded;
  Views<Pixel> halves, wholes;
  const Schedule schedule;
};

using Pixels = ::testing::Types<std::uint8_t, std::uint16_t>;
TYPED_TEST_SUITE (ViewsTest, Pixels);

TYPED_TEST (ViewsTest, OfAnExtractor)
{
  const auto extractor =
      Extractor<TypeParam>::make (this->schedule, this->kWidth, this->kHeight);
  ASSERT_TRUE (extractor);
  const auto run = [&] (const Views<TypeParam> &views) {
    return extractor->run (this->coded, views);
  };
  EXPECT_TRUE (run (this->halves));
  this->expect_refused (this->spoilt (this->halves), run);
  this->expect_refused (this->overlapping (this->halves, this->coded), run);
  this->expect_refused ({{}, {this->halves[0]}}, run);
  this->expect_refused (
      this->spoilt ({this->coded}), [&] (const Views<TypeParam> &views) {
        return extractor->run (views[0], this->halves);
      });
}

TYPED_TEST (ViewsTest, OfARectifier)
{
  const auto rectifier = Rectifier::make (
      Mapping (Extent{this->kWidth, this->kHeight}), this->schedule);
  ASSERT_TRUE (rectifier);
  using Input = ImageView<const TypeParam>;
  const auto run = [&] (const Views<TypeParam> &views) {
    return rectifier->run (Input (this->coded), views[0]);
  };
  const Views<TypeParam> output{this->wholes[0]};
  EXPECT_TRUE (run (output));
  this->expect_refused (this->spoilt (output), run);
  this->expect_refused ({{this->coded}}, run);
  this->expect_refused (
      this->spoilt ({this->coded}), [&] (const Views<TypeParam> &views) {
        return rectifier->run (Input (views[0]), output[0]);
      });
}

TYPED_TEST (ViewsTest, OfAFuser)
{
  auto fuser =
      Fuser<TypeParam>::make (this->schedule, this->kWidth, this->kHeight);
  ASSERT_TRUE (fuser);
  const auto run = [&] (const Views<TypeParam> &views) {
    return fuser->fuse (views);
  };
  this->expect_refused ({this->wholes}, run);
  this->expect_refused (this->spoilt ({this->coded}),
      [&] (const Views<TypeParam> &views) { return fuser->take (views[0]); });
  ASSERT_EQ (fuser->pending (), 0);
  ASSERT_TRUE (fuser->take (this->coded));
  this->expect_refused (this->spoilt (this->wholes), run);
  this->expect_refused ({{}, {this->wholes[0]}}, run);
  Views<TypeParam> twice = this->wholes;
  twice[1] = twice[0];
  this->expect_refused ({twice}, run);
  EXPECT_EQ (fuser->pending (), 1);
  EXPECT_TRUE (run (this->wholes));
}

/* Side by side in one image, each row of an output lies between two rows of
 * another. */
TYPED_TEST (ViewsTest, OutputsMayLieSideBySide)
{
  const auto extractor =
      Extractor<TypeParam>::make (this->schedule, this->kWidth, this->kHeight);
  ASSERT_TRUE (extractor);
  for (const int left : {0, 52}) {
    Views<TypeParam> views;
    for (int k = 0; k < 4; k++)
      views.push_back (this->memory.view ().block (
          (left + 6 * (k % 2)) % 64, 12 + 4 * (k / 2), 6, 4));
    EXPECT_TRUE (extractor->run (this->coded, views)) << left;
  }
}

} // namespace
