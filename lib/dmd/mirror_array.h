/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Where the mirrors of an array are, and how a schedule lies on them. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "base/image.h"
#include "schedule/schedule.h"

namespace cexp
{

/** How rows and columns of addresses lie in the plane. */
enum class Array {
  orthogonal, ///< a square grid along the edges of the array
  /** A square grid turned by 45 degrees: odd rows are shifted by half a column,
   * rows are half a column apart. */
  diamond,
};

/** A point in the plane of the mirrors, in pitches of one column. */
struct MirrorPoint {
  double x = 0.0;
  double y = 0.0;
};

/** Coordinates of a diamond array along its two 45-degree axes. Mirrors that
 * share an edge differ by 1 in one of them. */
struct LatticePoint {
  int u = 0;
  int v = 0;
  bool operator== (const LatticePoint &) const = default;
};

/** Lattice point of the mirror in @p column and @p row of an array that goes on
 * in all directions. @p odd_rows_left  they are shifted to the left, not to the
 * right. */
constexpr LatticePoint
lattice_of (int column, int row, bool odd_rows_left = false)
{
  const int odd = floor_mod (row, 2);
  const int down = (row - odd) / 2, up = (row + odd) / 2;
  return odd_rows_left ? LatticePoint{column + down, column - up}
                       : LatticePoint{column + up, column - down};
}

/** Address (x: column, y: row) of a lattice point; the inverse of lattice_of.
 */
constexpr Offset
address_of (LatticePoint point, bool odd_rows_left = false)
{
  const int row = point.u - point.v;
  const int odd = floor_mod (row, 2);
  return {point.v + (odd_rows_left ? row + odd : row - odd) / 2, row};
}

/** Centre of a mirror. @p odd_row_shift  of a diamond array, +0.5 or -0.5:
 * flips, optics and a view from behind turn its sign. */
MirrorPoint mirror_position (
    Array array, int column, int row, double odd_row_shift = 0.5);

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
  case MirrorLayout::lattice: {
    const LatticePoint point = lattice_of (column, row, odd_rows_left);
    return {point.u, point.v};
  }
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
constexpr MirrorPoint
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
Offset mirror_at (MirrorPoint point);

/** The mirrors that show masks; the others are off. */
struct MirrorRegion {
  Extent size = {};
  Offset origin = {};

  /** "WxH" or "WxH+X+Y". */
  static Result<MirrorRegion> parse (std::string_view text);
  bool operator== (const MirrorRegion &) const = default;
};

/** How a schedule lies on an array. */
struct Placement {
  MirrorLayout layout = MirrorLayout::address;
  std::optional<MirrorRegion> region = {}; ///< none: all mirrors
  bool odd_rows_left = false;              ///< of a diamond array
  bool operator== (const Placement &) const = default;
};

/** The first of @p rows rows of addresses that the pilot takes. */
int pilot_top (const Schedule &schedule, MirrorLayout layout, int rows);

/** Error when @p placement does not suit an array of that kind and size. */
Result<void> check_placement (
    const Placement &placement, Array array, Extent size);

/**
 * The mirrors of mask @p mask, one byte a mirror by address, 1 on and 0 off.
 *
 * The tile and the pilot start where the region does, as render_mask () has it
 * for an array of the region's size; the pilot's rows are those of the tile,
 * two of addresses with MirrorLayout::cell. (With MirrorLayout::lattice they
 * are of addresses and lie across the tile's, of no use to a camera.)
 * @p out  the whole array; check_placement () must allow the placement.
 */
void render_mirrors (const Schedule &schedule, int mask,
    const Placement &placement, ImageView<std::uint8_t> out);

} // namespace cexp
