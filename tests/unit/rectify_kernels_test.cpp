/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Kernels of rectification: every instruction set of the processor, compared
 * with a scalar reference bit for bit. */
#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "base/geometry.h"
#include "base/image.h"
#include "random_numbers.h"
#include "rectify/kernels.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::rectify;
using test::random_numbers;

constexpr int kFilters = 5;
constexpr Extent kCamera{61, 23};

/** What a row of mirrors is made with. */
struct Row {
  std::vector<Place> places;
  std::vector<float> weights;
  std::vector<WindowScale> scales;
  std::vector<FilterError> errors;
  Filters filters;
};

Row
random_row (int taps, float largest)
{
  Row row;
  std::mt19937 random{7};
  const auto up_to = [&] (int most) {
    return int (random () % unsigned (most + 1));
  };
  for (int i = 0; i < 200; i++) {
    const int kind = up_to (9);
    const Place pixel{std::int16_t (up_to (kCamera.width - 1)),
        std::int16_t (up_to (kCamera.height - 1)), Place::kLookup};
    row.places.push_back (
        kind == 0   ? Place{}
        : kind == 1 ? pixel
                    : Place{std::int16_t (up_to (kCamera.width - taps)),
                          std::int16_t (up_to (kCamera.height - taps)),
                          up_to (kFilters - 1)});
  }
  const auto some = random_numbers (
      std::size_t (kFilters * kNoises * taps * row_length (taps)), 3);
  for (std::size_t i = 0; i < some.size (); i++) {
    const bool filled = int (i) % row_length (taps) >= taps;
    row.weights.push_back (filled ? 0.0f : some[i] / float (taps * taps));
  }
  for (int i = 0; i < kFilters; i++) {
    row.scales.push_back ({1.0f + float (i), 1.0f + 0.3f * float (i)});
    for (int noise = 0; noise < kNoises; noise++)
      row.errors.push_back ({0.01f * float (i + noise), 0.1f * float (noise)});
  }
  const float noise = 0.2f * largest;
  row.filters = {row.weights.data (), row.scales.data (), row.errors.data (),
      {4.0f, 1.5f, 0.5f}, noise * noise, largest};
  return row;
}

/** Sums in the order of the kernels: of lanes, which are columns modulo 4. */
template <typename Pixel>
void
reference (ImageView<const Pixel> from, const Row &row, int taps, Pixel *to,
    float *errors)
{
  const Filters &filters = row.filters;
  for (std::size_t i = 0; i < row.places.size (); i++) {
    const Place &place = row.places[i];
    errors[i] = 0.0f;
    if (place.filter < 0) {
      to[i] = place.filter == Place::kLookup ? from.at (place.x, place.y) : 0;
      continue;
    }
    const auto at = [&] (int x, int y) {
      return float (from.at (place.x + x, place.y + y));
    };
    const auto sum_of = [] (const float *lanes) {
      return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
    };
    const int first = taps / 2 - 2;
    float differences[4];
    for (int lane = 0; lane < 4; lane++) {
      float across = 0.0f, down = 0.0f;
      for (int y = first; y < first + 4; y++) {
        const int x = first + lane;
        const float right = at (x + 1, y) - at (x, y);
        const float below = at (x, y + 1) - at (x, y);
        across += right * right;
        down += below * below;
      }
      differences[lane] = across + down;
    }
    float scene = 0.0f;
    int filter = place.filter * kNoises;
    if (filters.scales) {
      const WindowScale &scale = filters.scales[place.filter];
      scene = (sum_of (differences) / 32.0f * (0.5f / filters.noise) *
                      scale.darkness -
                  1.0f) *
              scale.smoothness;
      for (const float limit : filters.limits)
        filter += scene <= limit;
    }
    const float *weights = filters.weights + filter * taps * row_length (taps);
    float lanes[12] = {};
    for (int y = 0; y < taps; y++)
      for (int x = 0; x < taps; x++)
        lanes[x] += weights[y * row_length (taps) + x] * at (x, y);
    for (int lane = 0; lane < 4; lane++)
      lanes[lane] = (lanes[lane] + lanes[lane + 4]) + lanes[lane + 8];
    to[i] = Pixel (std::int32_t (
        std::clamp (sum_of (lanes) + 0.5f, 0.0f, filters.largest)));
    const FilterError &error = filters.errors[filter];
    errors[i] = std::sqrt (
        filters.noise * (std::max (scene, 0.0f) * error.scene + error.noise));
  }
}

/** @p chosen  whether filters are chosen by the noise. */
template <typename Pixel>
void
compare (float largest, bool chosen)
{
  std::mt19937 random{5};
  Image<Pixel> frame (kCamera.width, kCamera.height);
  for (int y = 0; y < kCamera.height; y++)
    for (int x = 0; x < kCamera.width; x++)
      frame.at (x, y) =
          Pixel (random () % unsigned (y < 8 ? largest / 16 : largest));
  const ImageView<const Pixel> view = std::as_const (frame).view ();
  const Source<Pixel> source{view.row (0), view.stride, view.width};
  for (const int taps : {5, 7, 9}) {
    Row row = random_row (taps, largest);
    if (!chosen)
      row.filters.scales = nullptr;
    const std::size_t count = row.places.size ();
    std::vector<Pixel> expected (count);
    std::vector<float> expected_errors (count);
    reference (view, row, taps, expected.data (), expected_errors.data ());
    EXPECT_GT (std::count (expected.begin (), expected.end (), 0), 5);
    for (const Kernels &kernels : supported_kernels ()) {
      SCOPED_TRACE (kernels.name);
      SCOPED_TRACE (taps);
      RectifyRow<Pixel> *run = std::get<RectifyRow<Pixel> *const(&)[3]> (
          std::tie (kernels.bytes, kernels.words))[(taps - 5) / 2];
      std::vector<Pixel> made (count + 1, Pixel (77)), without (made);
      std::vector<float> errors (count + 1, 77.0f);
      run (source, row.places.data (), int (count), row.filters, made.data (),
          errors.data ());
      run (source, row.places.data (), int (count), row.filters,
          without.data (), nullptr);
      EXPECT_EQ (made, without);
      EXPECT_EQ (made.back (), Pixel (77)); // nothing behind the row
      EXPECT_EQ (errors.back (), 77.0f);
      made.pop_back ();
      errors.pop_back ();
      EXPECT_EQ (made, expected);
      EXPECT_EQ (errors, expected_errors);
    }
  }
}

TEST (RectifyKernels, EqualTheReference)
{
  for (const bool chosen : {true, false}) {
    SCOPED_TRACE (chosen);
    compare<std::uint8_t> (255.0f, chosen);
    compare<std::uint16_t> (4095.0f, chosen);
    compare<std::uint16_t> (65535.0f, chosen);
  }
}

} // namespace
