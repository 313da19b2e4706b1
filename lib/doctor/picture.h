/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What pictures of an even light say of the camera and of the target. */
#pragma once

#include <array>

#include "doctor/checks.h"
#include "doctor/stack.h"

namespace codedexposure
{

/**
 * Keeps what is needed of frames of one mask to tell, whatever the camera says
 * of itself: "colour" (pixels of a 2x2 mosaic get different light),
 * "noise-reduction" and "sharpening" (the noise of neighbours, or of frames, is
 * not independent), "moving" and "texture" (the light is not even, and changes
 * its place).
 */
class PictureCheck
{
public:
  /** @p frames: that will come. */
  explicit PictureCheck (int frames) : frames_ (frames) {}

  /** Of the same mask and size, not saturated, in their order. */
  void add (const SeenFrame &frame);
  /** Measures and judges in @p finding. @p all: the same frames, four or more.
   * @p dark: their mean without light. */
  void judge (const Stack &all, const Image<float> &dark, int largest,
      Finding &finding);

private:
  int frames_;
  std::vector<Image<std::uint16_t>> middles_; // of frames
  std::array<Image<float>, 2> halves_;        // sums of frames
};

/** Mean of frames. */
struct FrameMean {
  ImageView<const float> picture;
  int frames = 0;
};

/**
 * How much more two means of the same mask differ than their noise explains, as
 * the ratio of the squares, in what neighbouring pixels have in common. 1 if
 * nothing moved; not measured where pixels are full.
 *
 * @p noise: of such frames. @p dark: their mean without light.
 */
Measured change_between (const FrameMean &a, const FrameMean &b,
    const Stack &noise, const Image<float> &dark);

/** The reading of that. */
inline constexpr const char *kChange = "change of the picture";

} // namespace codedexposure
