/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A straight line across a picture, along which its pixels are read. */
#pragma once

#include <cmath>
#include <string_view>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "schedule/tile.h"

namespace cexp
{

/** A place in a picture; pixel centres have whole coordinates. */
struct PicturePoint {
  double x = 0.0;
  double y = 0.0;
  bool operator== (const PicturePoint &) const = default;
};

/**
 * A line that is known before the size of the picture is: each coordinate is a
 * number of pixels, or a part of the way from the first pixel to the last one,
 * so that the same line fits coded frames and subframes.
 */
class ProfileLine
{
public:
  /**
   * "row:Y", "column:X" or "X0/Y0/X1/Y1". Every coordinate is a number of
   * pixels from the first one, such as 143 or 10.5, or 0% to 100% of the way
   * from the first to the last. Rows and columns are rounded to whole ones.
   */
  static Result<ProfileLine> parse (std::string_view text);

  /**
   * The points of the line in a picture of that size, evenly spaced, both ends
   * included: the pixels of a row or column; of any other line as many as are
   * as nearly as possible a pixel apart. Error when the line leaves the
   * picture.
   */
  Result<std::vector<PicturePoint>> points (Extent size) const;

private:
  struct Coordinate {
    double value = 0.0;
    bool relative = false; ///< value is the part of the way, 0..1
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
value_at (ImageView<const Pixel> picture, PicturePoint at)
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

} // namespace cexp
