/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What a target and a camera do to a picture by themselves. */
#pragma once

#include <cstdint>
#include <vector>

#include "base/image.h"
#include "bench/sick_options.h"

namespace codedexposure
{

/** The brightness of the target at @p seconds is a factor of @p light: one of
 * mean 1 with blobs of some ten pixels. */
void look_at_target (
    const SickBenchOptions &options, double seconds, ImageView<float> light);

/** Each pixel of a 2x2 mosaic sees one colour of a white light. */
void filter_colours (ImageView<float> light);

/** What becomes of each pixel value up to @p largest: a power of it, perhaps
 * with more contrast in the middle. */
std::vector<std::uint16_t> response_table (
    int largest, double gamma, bool contrast = false);

/** The camera's own changes of its pictures, and of its gain and exposure. */
class Processing
{
public:
  explicit Processing (const SickBenchOptions &options);

  double gain () const { return gain_; }         ///< of the frames that follow
  double exposure () const { return exposure_; } ///< part of the longest
  /** Changes @p picture, which follows the sensor. */
  void apply (ImageView<std::uint16_t> picture);

private:
  void follow (ImageView<std::uint16_t> picture);
  void subtract_dark (ImageView<std::uint16_t> picture) const;
  void mix (ImageView<std::uint16_t> picture, double part) const;

  SickBenchOptions options_;
  int largest_;
  std::vector<std::uint16_t> table_; ///< of a pixel value; empty: the same
  double gain_ = 1.0, exposure_ = 1.0;
};

} // namespace codedexposure
