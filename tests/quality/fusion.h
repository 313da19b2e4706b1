/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Accuracy of fused frames. */
#pragma once

#include <string>
#include <vector>

#include "fuse/fuser.h"
#include "scene.h"
#include "trial.h"

namespace codedexposure::quality
{

/** Mean over frames of the figures of single frames, as in the literature on
 * compressed video. */
struct FrameMean {
  double psnr = 0.0; ///< dB, peak 255
  double ssim = 0.0;
  /** Root mean square error of the change to the next frame, grey levels. */
  double flicker = 0.0;
  /** Energy of the Laplacian, relative to that of the truth: below 1, detail is
   * missing; above, it is noise or invented. */
  double detail = 0.0;
  /** Correlation of the Laplacian with that of the truth. */
  double likeness = 0.0;
};

/** At most 99 dB, peak 255. */
double psnr (const Picture &frame, const Picture &truth);

/** Structural similarity (Wang et al., 2004) with uniform windows of 7x7, their
 * sample covariance, K1 = 0.01, K2 = 0.03, without the border. */
double ssim (ImageView<const std::uint8_t> a, ImageView<const std::uint8_t> b);

FrameMean compare (
    const std::vector<Picture> &frames, const std::vector<Picture> &truth);

/** Fused frames of all coded frames of a stream; @p partners: none, or one for
 * each. */
std::vector<Picture> fuse (const std::vector<Picture> &coded,
    const Schedule &schedule, const FuseOptions &options,
    const std::vector<Picture> &partners = {});

} // namespace codedexposure::quality
