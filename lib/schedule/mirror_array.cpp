/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/mirror_array.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/text.h"

namespace codedexposure
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

} // namespace

Offset
mirror_at (Position point)
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

Result<Rect>
parse_region (std::string_view text)
{
  const auto region = parse_rect (text);
  if (!region || region->width < 1 || region->height < 1 || region->x < 0 ||
      region->y < 0)
    return Error{"cannot use " + in_quotes (text) +
                 " as a region; write WxH or WxH+X+Y in mirrors"};
  return *region;
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
  const Rect &region = *placement.region;
  if (region.x < 0 || region.y < 0 || region.width < 1 || region.height < 1 ||
      region.x > size.width - region.width ||
      region.y > size.height - region.height)
    return Error{"a region of " + size_text ({region.width, region.height}) +
                 " at " + std::to_string (region.x) + ", " +
                 std::to_string (region.y) + " does not lie within the " +
                 size_text (size) + " mirrors of the array"};
  if (array == Array::diamond && region.y % 2 != 0)
    return Error{"a region of a diamond array must start in an even row, not "
                 "in row " +
                 std::to_string (region.y) +
                 ": groups would lean the other way"};
  return {};
}

} // namespace codedexposure
