/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How to move the camera so that its pixels are aligned with the mirrors. */
#pragma once

#include "mapping/mapping.h"

namespace codedexposure
{

/** The target of the alignment, and the scales of the stage that holds the
 * camera. */
struct StageOptions {
  double pixels_per_mirror = 1.0; ///< target
  /** The bench is aligned if no pixel of the frame is further than this from
   * its aligned position, in mirrors. Subframes lose 0.2 dB at 0.05. */
  double tolerance = 0.05;
  /** Stage travel for one mirror, in micrometres: the pitch of the mirrors
   * times the magnification of the optics. */
  double mirror_pitch = 7.56;
  bool flip_x = false; ///< the stage's x is opposite to the picture's
  bool flip_y = false;
  bool flip_theta = false; ///< its angle is anticlockwise on the screen
};

/** How far a calibration has come. */
enum class CalibrationStage {
  searching, ///< no grating is seen
  coarse,    ///< a pixel is off by more than one mirror
  fine,
  aligned, ///< all pixels are within the tolerance
  mapping, ///< the patterns of a calibration are shown, one after the other
  solving,
  mapped,
  failed,
  found, ///< the phase of the tile
};
const char *stage_text (CalibrationStage stage);

/**
 * How to move the stage. As all mirrors are the same, the target is the nearest
 * aligned position; the mapping contains which mirrors the camera sees there.
 */
struct StageCorrection {
  /** coarse, fine or aligned. */
  CalibrationStage state = CalibrationStage::coarse;
  /** From the aligned position to the mirror that the centre of the frame sees,
   * mirrors to the right and downwards. */
  Position offset;
  double rotation = 0.0;      ///< degrees, as of Pose
  double magnification = 1.0; ///< pixels per mirror
  /** Largest distance of the four corners from the aligned position, mirrors.
   */
  double deviation = 0.0;
  /** Movement of the stage: micrometres, and thousandths of a degree. */
  double stage_x = 0.0, stage_y = 0.0, stage_theta = 0.0;
  /** Change of the magnification, in thousandths. */
  double magnify = 0.0;
};
StageCorrection correct_stage (
    const Mapping &mapping, const StageOptions &options);

/** Camera and mirrors parallel, with the same centre. */
Mapping centred_mapping (
    Extent camera, Extent mirrors, double pixels_per_mirror);

} // namespace codedexposure
