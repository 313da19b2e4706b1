/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The kernels of rectification, which are compiled once per instruction set;
 * for this folder only. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace codedexposure::rectify
{

/** Amounts of noise, of each of which a mirror has a filter. */
constexpr int kNoises = 4;

/** Pixels of a row that can be read beyond the first one of a window. */
constexpr int kRead = 16;

constexpr int
row_length (int taps)
{
  return (taps + 3) / 4 * 4;
}

/** The first pixel of a mirror's window, or the pixel to copy. */
struct Place {
  static constexpr std::int32_t kLookup = -1, kUnseen = -2;

  std::int16_t x = 0, y = 0;
  std::int32_t filter = kUnseen; ///< its number, or one of the above
};

/** How a mirror's window shows the scene. */
struct WindowScale {
  float smoothness; ///< 1 / roughness (WeightSolver)
  float darkness;   ///< light of the brightest element / that of the mirror
};

/** Squared error of a filter: `scene` times the variance of the mirrors' light,
 * and `noise` times that of a pixel's noise beyond the noise itself. */
struct FilterError {
  float scene, noise;
};

/** How rough the scene is, for windows whose first pixel is (x, y), (x + 1, y)
 * ...: sums of MeasureRow. */
struct Roughness {
  const float *first = nullptr; ///< null: the first filter of each is used
  std::ptrdiff_t length = 0;    ///< of a row
  int x = 0, y = 0;
};

/** Of every mirror: weights, row by row, each filled up with zeros to
 * row_length (), and errors, kNoises of each after the other. */
struct Filters {
  const float *weights;
  const WindowScale *scales;
  const FilterError *errors;
  /** Ratios of the scene's variance and the noise's: below each, the filters
   * for the next larger noise are used. */
  float limits[kNoises - 1];
  float noise;   ///< of a pixel: variance, DN^2
  float largest; ///< DN, to which results are clamped
  Roughness roughness = {};
};

/** Pixels of a camera. */
template <typename Pixel>
struct Source {
  const Pixel *first;
  std::ptrdiff_t stride; ///< bytes
  int width;
};

/** Differences along each side of a window that say how rough it is. */
constexpr int kSteps = 4;

/** Sums of squared differences of neighbours in blocks of 5 x 5 pixels, whose
 * first ones are those of a row: of kSteps x kSteps pixels with those right of
 * them and below.
 * @p from   from the first block on.
 * @p count  blocks, at most from.width - kSteps. */
template <typename Pixel>
using MeasureRow = void (const Source<Pixel> &from, int count, float *to);

/** Mirrors of a row.
 * @p errors  their errors beyond the noise, rms, DN; null: not wanted. */
template <typename Pixel>
using RectifyRow = void (const Source<Pixel> &from, const Place *places,
    int count, const Filters &filters, Pixel *to, float *errors);

struct Kernels {
  std::string_view name;
  MeasureRow<std::uint8_t> *measure_bytes;
  MeasureRow<std::uint16_t> *measure_words;
  /** For windows of 5, 7 and 9 pixels along a side. */
  RectifyRow<std::uint8_t> *bytes[3];
  RectifyRow<std::uint16_t> *words[3];
};

/** Those that this machine can run, fastest first. */
std::span<const Kernels> supported_kernels ();

} // namespace codedexposure::rectify
