/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "base/geometry.h"

#include "base/text.h"

namespace codedexposure
{

std::string
size_text (Extent size)
{
  return std::to_string (size.width) + "x" + std::to_string (size.height);
}

std::string
rect_text (const Rect &rect)
{
  return size_text ({rect.width, rect.height}) + "+" + std::to_string (rect.x) +
         "+" + std::to_string (rect.y);
}

std::optional<Extent>
parse_size (std::string_view text)
{
  const auto rect = parse_rect (text);
  if (!rect || split (text, '+').size () != 1 || rect->width < 1 ||
      rect->height < 1)
    return std::nullopt;
  return Extent{rect->width, rect->height};
}

std::optional<Rect>
parse_rect (std::string_view text)
{
  const auto pieces = split (text, '+');
  const auto sides = split (pieces.front (), 'x');
  const bool has_corner = pieces.size () == 3;
  if ((pieces.size () != 1 && !has_corner) || sides.size () != 2)
    return std::nullopt;
  const auto width = parse_int (sides[0]), height = parse_int (sides[1]);
  const auto x = has_corner ? parse_int (pieces[1]) : 0;
  const auto y = has_corner ? parse_int (pieces[2]) : 0;
  if (!width || !height || !x || !y)
    return std::nullopt;
  return Rect{*x, *y, *width, *height};
}

} // namespace codedexposure
