/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "calibrate/stage.h"

#include <algorithm>
#include <cmath>

namespace codedexposure
{

namespace
{

/** The mirror that a pixel sees in an aligned position: borders of mirrors on
 * borders of pixels, the first pixel on the first mirror. */
double
aligned_mirror (double pixel, double pixels_per_mirror)
{
  return (pixel + 0.5) / pixels_per_mirror - 0.5;
}

} // namespace

const char *
stage_text (CalibrationStage stage)
{
  constexpr const char *kTexts[] = {"searching", "coarse", "fine", "aligned",
      "mapping", "solving", "mapped", "failed", "found"};
  return kTexts[int (stage)];
}

StageCorrection
correct_stage (const Mapping &mapping, const StageOptions &options)
{
  const double ratio = options.pixels_per_mirror;
  const double right = mapping.camera ().width - 1.0;
  const double bottom = mapping.camera ().height - 1.0;
  const auto off = [&] (double x, double y) {
    const Position mirror = mapping.mirror_at (x, y);
    return Position{mirror.x - aligned_mirror (x, ratio),
        mirror.y - aligned_mirror (y, ratio)};
  };
  const Position centre = off (right / 2, bottom / 2);
  const Position whole{std::round (centre.x), std::round (centre.y)};
  const Pose pose = mapping.pose ();

  StageCorrection correction;
  correction.offset = {centre.x - whole.x, centre.y - whole.y};
  correction.rotation = pose.rotation;
  correction.magnification = pose.magnification;
  for (const double x : {0.0, right})
    for (const double y : {0.0, bottom}) {
      const Position corner = off (x, y);
      correction.deviation = std::max (correction.deviation,
          std::hypot (corner.x - whole.x, corner.y - whole.y));
    }
  correction.state = correction.deviation <= options.tolerance
                         ? CalibrationStage::aligned
                     : correction.deviation <= 1.0 ? CalibrationStage::fine
                                                   : CalibrationStage::coarse;

  const double pitch = options.mirror_pitch;
  correction.stage_x = -correction.offset.x * (options.flip_x ? -pitch : pitch);
  correction.stage_y = -correction.offset.y * (options.flip_y ? -pitch : pitch);
  correction.stage_theta =
      -pose.rotation * (options.flip_theta ? -1000.0 : 1000.0);
  correction.magnify = (ratio / pose.magnification - 1.0) * 1000.0;
  return correction;
}

Mapping
centred_mapping (Extent camera, Extent mirrors, double pixels_per_mirror)
{
  const double slope = 1.0 / pixels_per_mirror;
  const double x0 = (mirrors.width - 1 - slope * (camera.width - 1)) / 2;
  const double y0 = (mirrors.height - 1 - slope * (camera.height - 1)) / 2;
  Result<Mapping> mapping = Mapping::make (
      {camera, mirrors, {slope, 0, x0, 0, slope, y0, 0, 0, 1}, {}, {}});
  return mapping ? *std::move (mapping) : Mapping (camera);
}

} // namespace codedexposure
