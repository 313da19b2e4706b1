/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Where the mirrors of an array are, and how a schedule lies on them. */
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "base/geometry.h"
#include "schedule/schedule.h"

namespace codedexposure
{

/** How rows and columns of addresses lie in the plane. */
enum class Array {
  orthogonal, ///< a square grid along the edges of the array
  /** A square grid turned by 45 degrees: odd rows are shifted by half a column,
   * rows are half a column apart. */
  diamond,
};

/** Place of the mirror in @p column and @p row along the two 45-degree axes of
 * a diamond array that goes on in all directions; mirrors that share an edge
 * differ by 1 in one of them. @p odd_rows_left  they are shifted to the left,
 * not to the right. */
constexpr Offset
lattice_of (int column, int row, bool odd_rows_left = false)
{
  const int odd = floor_mod (row, 2);
  const int down = (row - odd) / 2, up = (row + odd) / 2;
  return odd_rows_left ? Offset{column + down, column - up}
                       : Offset{column + up, column - down};
}

/** Address (x: column, y: row) of a place on the lattice; the inverse of
 * lattice_of (). */
constexpr Offset
address_of (Offset lattice, bool odd_rows_left = false)
{
  const int row = lattice.x - lattice.y;
  const int odd = floor_mod (row, 2);
  return {lattice.y + (odd_rows_left ? row + odd : row - odd) / 2, row};
}

/** Which pixel of a schedule's tile each mirror is. On orthogonal arrays,
 * address is the only one that keeps groups square. */
enum class MirrorLayout {
  /** Columns and rows of addresses are pixels: on a diamond array, groups are
   * parallelograms twice as wide as high. */
  address,
  /** The 45-degree axes of a diamond array are the axes of the tile: squares of
   * edge-sharing mirrors, for a camera that is turned by 45 degrees. */
  lattice,
  /** Two rows make one pixel row, and two mirrors one square pixel: groups
   * parallel to the edges of a diamond array and to a camera's pixels. */
  cell,
};

/** "address", "lattice" or "cell". */
Result<MirrorLayout> parse_layout (std::string_view text);
const char *layout_text (MirrorLayout layout);

/** Pixel of the tile that the mirror in @p column and @p row is. */
constexpr Offset
tile_pixel (
    MirrorLayout layout, int column, int row, bool odd_rows_left = false)
{
  switch (layout) {
  case MirrorLayout::lattice:
    return lattice_of (column, row, odd_rows_left);
  case MirrorLayout::cell:
    return {column, (row - floor_mod (row, 2)) / 2};
  case MirrorLayout::address:
    break;
  }
  return {column, row};
}

/** Where on a diamond array (its odd rows shifted to the right) the place
 * (@p x, @p y) of the tile is: whole numbers are the centres of what makes one
 * pixel of @p layout. */
constexpr Position
tile_place (MirrorLayout layout, double x, double y)
{
  switch (layout) {
  case MirrorLayout::lattice:
    return {(x + y) / 2, (x - y) / 2};
  case MirrorLayout::cell: // between the two mirrors of a pixel
    return {x + 0.25, y + 0.25};
  case MirrorLayout::address: // between even and odd rows
    break;
  }
  return {x + 0.25, y / 2};
}

/** Address of the mirror of a diamond array, its odd rows shifted to the right,
 * that covers @p point; the array goes on in all directions. */
Offset mirror_at (Position point);

/** The mirrors that show masks, as "WxH" or "WxH+X+Y". */
Result<Rect> parse_region (std::string_view text);

/** How a schedule lies on an array. */
struct Placement {
  MirrorLayout layout = MirrorLayout::address;
  std::optional<Rect> region = {}; ///< others are off; none: all mirrors
  bool odd_rows_left = false;      ///< of a diamond array
  bool operator== (const Placement &) const = default;
};

/** The first of @p rows rows of addresses that the pilot takes. */
int pilot_top (const Schedule &schedule, MirrorLayout layout, int rows);

/** Error when @p placement does not suit an array of that kind and size. */
Result<void> check_placement (
    const Placement &placement, Array array, Extent size);

} // namespace codedexposure
