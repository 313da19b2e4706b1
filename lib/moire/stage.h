/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How to move the camera so that its pixels stand on the mirrors. */
#pragma once

#include "schedule/mapping.h"

namespace cexp
{

/** What is aimed at, and how the stage that holds the camera is graduated. */
struct StageOptions {
  double pixels_per_mirror = 1.0; ///< that are wanted
  /** Largest distance, anywhere in the frame, from where a pixel should look,
   * at which the bench is aligned, in mirrors. Subframes lose 0.2 dB at 0.05.
   */
  double tolerance = 0.05;
  /** Way of the stage for one mirror, in micrometres: the pitch of the mirrors
   * times the magnification of the optics. */
  double mirror_pitch = 7.56;
  bool flip_x = false; ///< the stage's x runs against the picture's
  bool flip_y = false;
  bool flip_theta = false; ///< its angle runs anticlockwise on the screen
};

enum class AlignmentState {
  searching, ///< no grating is seen
  coarse,    ///< somewhere, a pixel is off by more than one mirror
  fine,
  aligned, ///< all pixels are where they should be, to the tolerance
};
const char *alignment_state_text (AlignmentState state);

/**
 * What to change. Mirrors are all alike: of all good places the camera is sent
 * to the nearest one, and which mirrors it then sees is for the mapping to say.
 */
struct StageCorrection {
  AlignmentState state = AlignmentState::searching;
  /** From the good place to where the centre of the frame looks, mirrors to the
   * right and downwards. */
  Position offset;
  double rotation = 0.0;      ///< degrees, as of Stance
  double magnification = 1.0; ///< pixels a mirror
  /** Largest distance from the good place, of the four corners, mirrors. */
  double deviation = 0.0;
  /** To move the stage by: micrometres, and thousandths of a degree. */
  double stage_x = 0.0, stage_y = 0.0, stage_theta = 0.0;
  /** To change the magnification by, in thousandths. */
  double magnify = 0.0;
};
StageCorrection correct_stage (
    const Mapping &mapping, const StageOptions &options);

/** Camera and mirrors parallel, their centres one on the other. */
Mapping centred_mapping (
    Extent camera, Extent mirrors, double pixels_per_mirror);

} // namespace cexp
