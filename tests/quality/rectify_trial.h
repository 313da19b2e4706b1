/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Accuracy of subframes and fused frames of a misaligned camera, with and
 * without its mapping. */
#pragma once

#include "bench/bench.h"
#include "metrics.h"
#include "scene.h"
#include "schedule/schedule.h"

namespace codedexposure::quality
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

/** The bench of docs/calibration.md: rotated by half a degree, magnified by 1
 * %, shifted by 0.4 px; ordinary blur and noise. */
BenchOptions misaligned_bench (double psf_sigma = 0.5);

} // namespace codedexposure::quality
