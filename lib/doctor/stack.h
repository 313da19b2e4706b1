/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames of the same mask, put together. */
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "doctor/checks.h"

namespace codedexposure
{

/** Mean and noise of each pixel over frames. */
struct Stack {
  int frames = 0;
  Nanoseconds time = 0; ///< mean of the stamps
  Image<float> mean;    ///< DN
  /** Over time, without what all pixels have in common: flicker and drift are
   * not noise of the sensor. */
  Image<float> variance;
  /** Frames in which a pixel was 0, and in which it had the largest DN. */
  Image<std::uint8_t> zeros, full;
  std::uint16_t bits_seen = 0; ///< that are set in a pixel of a frame
  double scatter = 0.0;        ///< rms of the means of frames, DN
};

/**
 * Puts frames of one size together as they come, in the memory of a few
 * pictures.
 */
class StackSum
{
public:
  /** @p largest: DN. */
  explicit StackSum (int largest) : largest_ (largest) {}

  /** At most 255 of them. */
  void add (const SeenFrame &frame);
  /**
   * Of one frame or more. @p dark: mean without light, so that common changes
   * of light are in proportion to it; null: they are the same in each pixel.
   * Error where it has another size.
   */
  Result<Stack> stack (const Image<float> *dark = nullptr) &&;

private:
  int largest_;
  Stack stack_; // its mean and variance come at the end
  /* Against the first frame: sums of values, of their squares, and of their
   * products with the means of frames. */
  Image<std::uint16_t> first_;
  Image<float> sum_, squares_, products_;
  Nanoseconds times_ = 0;
  double level_ = 0.0; // mean of the first frame
  double levels_ = 0.0, level_squares_ = 0.0;
};

/** Calls @p take with as many frames without damage as asked for, or half as
 * many after five times that time, of one size. Error with fewer. */
Result<void> look_for_whole_frames (Examination &examination,
    const StillMask &mask, int slots, int frames,
    const std::function<void (const SeenFrame &)> &take);

/** The same, put together as a StackSum does. */
Result<Stack> look_at_light (Examination &examination, const StillMask &mask,
    int slots, int frames, const Image<float> *dark = nullptr);

/** Every @p step th pixel of every @p step th row. */
Image<float> thinned (const Image<float> &image, int step);
/** The step with which a million pixels of a picture are left, or a few more.
 */
int thinning_of (Extent picture);

/** Means over the pixels of @p stack that are not 0 in @p good. */
struct StackMeans {
  double mean = 0.0, variance = 0.0;
  double spread = 0.0; ///< standard deviation of the pixels' means, DN
  double zeros = 0.0;  ///< part of the values that are 0
  double full = 0.0;   ///< part that is the largest DN
  double values = 0.0; ///< pixels times frames
};
StackMeans means_of (const Stack &stack, ImageView<const std::uint8_t> good);

/** Light of pixels, as parts of their mean light, from @p dark to @p bright:
 * equally many pixels have each. */
std::vector<double> light_parts (const Image<float> &dark,
    const Image<float> &bright, ImageView<const std::uint8_t> good);

/** The slots that lie in the exposure as a whole, in shorter ones: each is at
 * least @p shortest long. */
Examination::Lit fine_slots (
    const Examination &examination, Nanoseconds shortest);

/** @p finding of check @p name; where frames do not come, a finding that says
 * so in place of the error. */
Result<Finding> or_no_frames (Result<Finding> finding, const std::string &name);

/** 255 for @p high and more, 0 for @p low and less. */
Image<std::uint8_t> picture_of (
    const Image<float> &image, double low, double high);

/** "12,40 13,7", rounded, of some of them where there are many. */
std::string places_text (const std::vector<Position> &places);

} // namespace codedexposure
