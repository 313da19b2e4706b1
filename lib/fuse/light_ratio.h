/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How bright two cameras see the same places. */
#pragma once

#include <algorithm>
#include <cmath>

#include "base/image.h"
#include "fuse/coded_stream.h"

namespace codedexposure::fuse
{

/**
 * Light of the first camera for each 1 of the second. Where places differ in
 * brightness and both cameras agree on it, that is the ratio of the
 * differences, for which no black level is known; else the ratio of the means.
 */
class LightRatio
{
public:
  /** What both cameras saw of a place, in any unit. */
  void add (double first, double second)
  {
    places_++;
    sum_ += first;
    other_sum_ += second;
    squares_ += first * first;
    other_squares_ += second * second;
    products_ += first * second;
  }

  bool known () const { return sum_ > 0.0 && other_sum_ > 0.0; }
  /** Within 1e-3 and 1e3; 1 where nothing is known. */
  double value () const
  {
    constexpr double kLeast = 1e-3, kMost = 1e3;
    constexpr double kAgree = 0.98; // squared correlation
    if (!known ())
      return 1.0;
    const double spread = squares_ - sum_ * sum_ / places_;
    const double other = other_squares_ - other_sum_ * other_sum_ / places_;
    const double common = products_ - sum_ * other_sum_ / places_;
    const bool agree = spread > 0.0 && other > 0.0 && common > 0.0 &&
                       common * common > kAgree * spread * other;
    return std::clamp (
        agree ? std::sqrt (spread / other) : sum_ / other_sum_, kLeast, kMost);
  }

private:
  double places_ = 0.0;
  double sum_ = 0.0, other_sum_ = 0.0;
  double squares_ = 0.0, other_squares_ = 0.0, products_ = 0.0;
};

/** Pixels that are compared: those below these values, DN, of which the second
 * camera has some without light. */
struct LightLimits {
  float first, second;
  float second_black;
};
/** Each row of so many, in parts of this width. No tile has all of a slot in
 * one of these rows. */
struct LightParts {
  int rows, width;
};

/** By parts of rows of which all pixels are compared.
 * @p coded, @p partner  of the cameras of @p stream. */
template <typename Pixel>
LightRatio
light_ratio (const CodedStream &stream, ImageView<const Pixel> coded,
    ImageView<const Pixel> partner, const LightLimits &limits, LightParts parts)
{
  const auto gain_at = [] (const float *gain, int x) {
    return gain ? gain[x] : 1.0f;
  };
  LightRatio ratio;
  for (int y = 0; y < coded.height; y += parts.rows) {
    const Pixel *a = coded.row (y), *b = partner.row (y);
    const float *of_a = stream.camera ().gain (y);
    const float *of_b = stream.partner_camera ()->gain (y);
    for (int left = 0; left + parts.width <= coded.width; left += parts.width) {
      float first = 0.0f, second = 0.0f;
      bool bright = false;
      for (int x = left; x < left + parts.width; x++) {
        bright |= float (a[x]) >= limits.first || float (b[x]) >= limits.second;
        first += float (a[x]) * gain_at (of_a, x);
        second += (float (b[x]) - limits.second_black) * gain_at (of_b, x);
      }
      if (!bright)
        ratio.add (double (first), double (second));
    }
  }
  return ratio;
}

} // namespace codedexposure::fuse
