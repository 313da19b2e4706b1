/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/mirror_array.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/text.h"
#include "schedule/pilot.h"

namespace cexp
{

namespace
{

struct LayoutName {
  MirrorLayout layout;
  const char *name;
};

constexpr std::array<LayoutName, 3> kLayouts{
    {{MirrorLayout::address, "address"}, {MirrorLayout::lattice, "lattice"},
        {MirrorLayout::cell, "cell"}}};

std::string
size_text (Extent size)
{
  return std::to_string (size.width) + "x" + std::to_string (size.height);
}

} // namespace

MirrorPoint
mirror_position (Array array, int column, int row, double odd_row_shift)
{
  if (array == Array::orthogonal)
    return {double (column), double (row)};
  const double shift = row % 2 != 0 ? odd_row_shift : 0.0;
  return {column + shift, 0.5 * row};
}

Offset
mirror_at (MirrorPoint point)
{
  // Along the lattice's axes, mirrors are squares around whole numbers.
  return address_of ({int (std::floor (point.x + point.y + 0.5)),
      int (std::floor (point.x - point.y + 0.5))});
}

Result<MirrorLayout>
parse_layout (std::string_view text)
{
  for (const LayoutName &known : kLayouts)
    if (text == known.name)
      return known.layout;
  return Error{"no layout is called " + in_quotes (text) +
               "; layouts are address, lattice and cell"};
}

const char *
layout_text (MirrorLayout layout)
{
  return kLayouts[std::size_t (layout)].name;
}

Result<MirrorRegion>
MirrorRegion::parse (std::string_view text)
{
  const auto parts = split (text, '+');
  const auto sides = split (parts[0], 'x');
  const auto number = [] (std::string_view digits, int lowest) {
    const auto value = parse_int (digits);
    return value && *value >= lowest ? value : std::nullopt;
  };
  if (sides.size () == 2 && (parts.size () == 1 || parts.size () == 3)) {
    const auto width = number (sides[0], 1), height = number (sides[1], 1);
    const auto x = parts.size () == 3 ? number (parts[1], 0) : 0;
    const auto y = parts.size () == 3 ? number (parts[2], 0) : 0;
    if (width && height && x && y)
      return MirrorRegion{{*width, *height}, {*x, *y}};
  }
  return Error{"cannot use " + in_quotes (text) +
               " as a region; write WxH or WxH+X+Y in mirrors"};
}

int
pilot_top (const Schedule &schedule, MirrorLayout layout, int rows)
{
  const int addresses = layout == MirrorLayout::cell ? 2 : 1;
  return std::max (0, rows - addresses * schedule.pilot_rows ());
}

Result<void>
check_placement (const Placement &placement, Array array, Extent size)
{
  if (array == Array::orthogonal && placement.layout != MirrorLayout::address)
    return Error{std::string ("layout=") + layout_text (placement.layout) +
                 " is for diamond arrays; this one is orthogonal: leave layout "
                 "out"};
  if (!placement.region)
    return {};
  const MirrorRegion &region = *placement.region;
  if (region.origin.x > size.width - region.size.width ||
      region.origin.y > size.height - region.size.height)
    return Error{"a region of " + size_text (region.size) + " at +" +
                 std::to_string (region.origin.x) + "+" +
                 std::to_string (region.origin.y) +
                 " does not lie within the " + size_text (size) +
                 " mirrors of the array"};
  if (array == Array::diamond && region.origin.y % 2 != 0)
    return Error{"a region of a diamond array must start in an even row, not "
                 "in row " +
                 std::to_string (region.origin.y) +
                 ": groups would lean the other way"};
  return {};
}

void
render_mirrors (const Schedule &schedule, int mask, const Placement &placement,
    ImageView<std::uint8_t> out)
{
  const MirrorRegion region =
      placement.region.value_or (MirrorRegion{{out.width, out.height}, {}});
  const int slot = mask % schedule.slots ();
  const int pilot = pilot_top (schedule, placement.layout, region.size.height);

  for (int y = 0; y < out.height; y++)
    std::fill_n (out.row (y), out.width, std::uint8_t (0));
  for (int y = 0; y < region.size.height; y++) {
    std::uint8_t *row = out.row (region.origin.y + y) + region.origin.x;
    for (int x = 0; x < region.size.width; x++) {
      const Offset pixel =
          tile_pixel (placement.layout, x, y, placement.odd_rows_left);
      row[x] = y < pilot ? schedule.open (pixel.x, pixel.y, slot)
                         : pilot_open (x, mask, schedule.slots ());
    }
  }
}

} // namespace cexp
