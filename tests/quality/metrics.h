/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Errors and statistics of pictures. */
#pragma once

#include <cstdint>

#include "base/image.h"

namespace codedexposure::quality
{

/**
 * Squared differences of 8-bit values, pooled: one mean over everything that
 * was added, so that a bad subframe is not averaged away by good ones as it
 * would be in a mean of decibels.
 */
class PooledError
{
public:
  void add (double value, double truth)
  {
    const double d = value - truth;
    sum_ += d * d;
    count_++;
  }
  PooledError &operator+= (const PooledError &other)
  {
    sum_ += other.sum_;
    count_ += other.count_;
    return *this;
  }
  /** Peak signal-to-noise ratio in dB at peak 255; infinite where nothing
   * differed. Needs at least one value. */
  double psnr () const;

private:
  double sum_ = 0.0;
  std::uint64_t count_ = 0;
};

double mean_of (ImageView<const std::uint8_t> image);
/** Standard deviation over the pixels. */
double deviation_of (ImageView<const std::uint8_t> image);
/** Shannon entropy of the histogram of grey levels, bits a pixel: 0..8. */
double entropy_of (ImageView<const std::uint8_t> image);

} // namespace codedexposure::quality
