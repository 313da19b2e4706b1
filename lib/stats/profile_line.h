/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A straight line across a picture, along which a profile is measured. */
#pragma once

#include <cmath>
#include <string_view>
#include <vector>

#include "base/geometry.h"
#include "base/image.h"
#include "base/result.h"

namespace codedexposure
{

/**
 * A line that can be given before the size of the picture is known. Each
 * coordinate is in pixels, or relative to the distance from the first to the
 * last pixel, so that the same line fits coded frames and subframes.
 */
class ProfileLine
{
public:
  /**
   * "row:Y", "column:X" or "X0/Y0/X1/Y1". A coordinate is in pixels from the
   * first one, such as 143 or 10.5, or 0% to 100% of the distance from the
   * first to the last pixel. Rows and columns are rounded to integers.
   */
  static Result<ProfileLine> parse (std::string_view text);

  /**
   * The points of the line in a picture of this size, evenly spaced, including
   * both ends: the pixels of a row or column; otherwise points that are about
   * one pixel apart. Error when the line leaves the picture.
   */
  Result<std::vector<Position>> points (Extent size) const;

private:
  struct Coordinate {
    double value = 0.0;
    bool relative = false; ///< to the distance of first and last pixel
    double in (int length) const;
  };
  enum class Kind { kRow, kColumn, kFree };

  static Result<Coordinate> parse_coordinate (std::string_view text);

  Kind kind_ = Kind::kRow;
  Coordinate x0_, y0_, x1_, y1_;
};

/** The value of @p picture at @p at, interpolated linearly between the four
 * pixels around it; @p at lies within the centres of the outermost pixels. */
template <typename Pixel>
double
value_at (ImageView<const Pixel> picture, Position at)
{
  const int x = int (at.x), y = int (at.y);
  const double fx = at.x - x, fy = at.y - y;
  const int right = fx > 0.0 ? x + 1 : x;
  const int below = fy > 0.0 ? y + 1 : y;
  const auto across = [&] (int row) {
    return std::lerp (
        double (picture.at (x, row)), double (picture.at (right, row)), fx);
  };
  return std::lerp (across (y), across (below), fy);
}

} // namespace codedexposure
