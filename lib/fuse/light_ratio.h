/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How bright two cameras see the same places. */
#pragma once

#include <algorithm>
#include <cmath>

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

} // namespace codedexposure::fuse
