/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* OpenCV's ways to find where a camera stands, on the same bench. */
#pragma once

#include <vector>

#include "moire_trial.h"

namespace cexp::quality
{

/** Prints the field errors of phase correlation, ECC and chessboard corners
 * beside that of a calibration, for the same benches and the same noise. Says
 * so where there is no OpenCV. */
void print_rivals (const std::vector<MoireTrial> &trials);

} // namespace cexp::quality
