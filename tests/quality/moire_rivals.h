/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* OpenCV's methods to measure the pose of a camera, on the same bench. */
#pragma once

#include <vector>

#include "moire_trial.h"

namespace codedexposure::quality
{

/** Prints the field errors of phase correlation, ECC and chessboard corners,
 * and those of a calibration with the same benches and noise. Prints a note
 * without OpenCV. */
void print_rivals (const std::vector<MoireTrial> &trials);

} // namespace codedexposure::quality
