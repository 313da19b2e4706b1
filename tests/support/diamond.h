/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Where the mirrors of an array are, written down plainly. */
#pragma once

#include "schedule/mirror_array.h"

namespace codedexposure
{

/** Centre of a mirror in pitches of one column. @p odd_row_shift  of a diamond
 * array, +0.5 or -0.5: flips, optics and a view from behind turn its sign. */
inline Position
mirror_position (Array array, int column, int row, double odd_row_shift = 0.5)
{
  if (array == Array::orthogonal)
    return {double (column), double (row)};
  const double shift = row % 2 != 0 ? odd_row_shift : 0.0;
  return {column + shift, 0.5 * row};
}

} // namespace codedexposure
