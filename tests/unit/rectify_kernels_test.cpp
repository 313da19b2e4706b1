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

template <typename Pixel>
float
rough_at (ImageView<const Pixel> from, int x, int y)
{
  const auto squared = [&] (int i, int j, int right, int below) {
    const float difference = float (from.at (x + i + right, y + j + below)) -
                             float (from.at (x + i, y + j));
    return difference * difference;
  };
  float columns[kSteps];
  for (int i = 0; i < kSteps; i++) {
    float across = 0.0f, down = 0.0f;
    for (int j = 0; j < kSteps; j++) {
      across += squared (i, j, 1, 0);
      down += squared (i, j, 0, 1);
    }
    columns[i] = across + down;
  }
  return (columns[0] + columns[1]) + (columns[2] + columns[3]);
}

/** Sums in the order of the kernels: of lanes, which are columns modulo 4. */
template <typename Pixel>
void
reference (ImageView<const Pixel> from, const Row &row, int taps, bool chosen,
    Pixel *to, float *errors)
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
    float scene = 0.0f;
    int filter = place.filter * kNoises;
    if (chosen) {
      const WindowScale &scale = filters.scales[place.filter];
      const int inside = taps / 2 - 2;
      const float rough = rough_at (from, place.x + inside, place.y + inside);
      scene = (rough / 32.0f * (0.5f / filters.noise) * scale.darkness - 1.0f) *
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

/** Of the blocks whose first pixels those of row @p y are, from @p x on. */
template <typename Pixel>
std::vector<float>
measured_row (const Kernels &kernels, ImageView<const Pixel> from, int x, int y)
{
  MeasureRow<Pixel> *run = std::get<MeasureRow<Pixel> *const &> (
      std::tie (kernels.measure_bytes, kernels.measure_words));
  const int count = from.width - x - kSteps;
  std::vector<float> row (std::size_t (count) + 1, 77.0f);
  run ({from.row (y) + x, from.stride, from.width - x}, count, row.data ());
  EXPECT_EQ (row.back (), 77.0f); // nothing behind the row
  row.pop_back ();
  return row;
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
    const std::size_t count = row.places.size ();
    std::vector<Pixel> expected (count);
    std::vector<float> expected_errors (count);
    reference (
        view, row, taps, chosen, expected.data (), expected_errors.data ());
    EXPECT_GT (std::count (expected.begin (), expected.end (), 0), 5);
    for (const Kernels &kernels : supported_kernels ()) {
      SCOPED_TRACE (kernels.name);
      SCOPED_TRACE (taps);
      RectifyRow<Pixel> *run = std::get<RectifyRow<Pixel> *const(&)[3]> (
          std::tie (kernels.bytes, kernels.words))[(taps - 5) / 2];
      const int inside = taps / 2 - 2;
      std::vector<float> roughness;
      for (int y = 0; y + kSteps < kCamera.height; y++)
        for (const float sum : measured_row (kernels, view, 0, y))
          roughness.push_back (sum);
      if (chosen)
        row.filters.roughness = {
            roughness.data (), kCamera.width - kSteps, -inside, -inside};
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

/* With nothing behind the last row. */
template <typename Pixel>
void
compare_measures ()
{
  std::mt19937 random{6};
  for (const int width : {5, 8, 9, 12, 13, 131, 132, 133, 300}) {
    Image<Pixel> frame (width, kSteps + 1);
    for (int y = 0; y <= kSteps; y++)
      for (int x = 0; x < width; x++)
        frame.at (x, y) = Pixel (random ());
    const ImageView<const Pixel> view = std::as_const (frame).view ();
    for (const Kernels &kernels : supported_kernels ()) {
      SCOPED_TRACE (kernels.name);
      for (const int first : {0, 1, width - kSteps - 1}) {
        std::vector<float> expected;
        for (int x = first; x + kSteps < width; x++)
          expected.push_back (rough_at (view, x, 0));
        EXPECT_EQ (measured_row (kernels, view, first, 0), expected) << width;
      }
    }
  }
}

TEST (RectifyKernels, MeasureAsTheReferenceDoes)
{
  compare_measures<std::uint8_t> ();
  compare_measures<std::uint16_t> ();
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
