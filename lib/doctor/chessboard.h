/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A chessboard on the mirrors, and OpenCV's search for its corners. */
#pragma once

#include <cstdint>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "doctor/lens_fit.h"
#include "schedule/still_mask.h"

namespace codedexposure
{

/** Squares that are off and on in turn, on mirrors that are on. */
struct Chessboard {
  Offset first;                ///< mirror
  int square = 16;             ///< mirrors, side of a square
  int columns = 14, rows = 11; ///< squares

  bool on (int x, int y) const;
  /** The corner between squares (i, j) and (i + 1, j + 1), among mirrors. */
  Position corner (int i, int j) const;
  StillMask mask () const;
};

/**
 * The inner corners of a chessboard, row after row, in pixels. Which corner is
 * the first one is not determined. Error when there is no such board, or when
 * this build lacks OpenCV.
 *
 * @p picture: light, from black to white.
 */
Result<std::vector<Position>> find_corners (
    ImageView<const std::uint8_t> picture, int columns, int rows);

/**
 * A corner from the edges that cross there, without a bias by the pixels' size.
 *
 * @p light: 0 to 1. @p corner: to a pixel. @p side: of a square, pixels.
 */
Position refine_corner (
    const Image<float> &light, Position corner, double side);

/** Those of @p pairs that a projection explains (RANSAC), to @p tolerance
 * mirrors. */
std::vector<PlacePair> without_outliers (
    const std::vector<PlacePair> &pairs, double tolerance);

/** Whether this build has OpenCV. */
bool has_chessboard ();

} // namespace codedexposure
