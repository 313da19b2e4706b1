/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How true subframes and fused frames of a misaligned camera are, with its
 * mapping and without. */
#pragma once

#include "metrics.h"
#include "optics/bench.h"
#include "scene.h"
#include "schedule/schedule.h"

namespace cexp::quality
{

/** PSNR in dB, away from the border of the frame. */
struct RectifyScore {
  double point = 0.0; ///< of the subframes' pixels
  double full = 0.0;  ///< of frames at full size, the gaps filled linearly; no
                      ///< number where there are regions
  double fused = 0.0; ///< of frames that were fused (FuseQuality::kFast)
};

struct RectifyOutcome {
  RectifyScore aligned;      ///< a camera that stands where it should
  RectifyScore misaligned;   ///< one that does not, as its frames are
  RectifyScore rectified;    ///< the same with the mapping of a calibration
  double milliseconds = 0.0; ///< to rectify one frame
};

/** @p options  of the misaligned bench; the mapping comes from a calibration
 *             on it. One-hot schedules. */
RectifyOutcome run_rectify (
    const Scene &scene, const Schedule &schedule, const BenchOptions &options);

/** What the numbers of docs/calibration.md are about: turned by half a degree,
 * 1 % larger, 0.4 px aside; blur and noise of an ordinary camera. */
BenchOptions misaligned_bench (double psf_sigma = 0.5);

} // namespace cexp::quality
