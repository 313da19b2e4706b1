/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "stats/profile_line.h"

#include <algorithm>

#include "base/text.h"
#include "base/try.h"

namespace codedexposure
{

double
ProfileLine::Coordinate::in (int length) const
{
  return relative ? value * (length - 1) : value;
}

Result<ProfileLine::Coordinate>
ProfileLine::parse_coordinate (std::string_view text)
{
  const bool relative = text.ends_with ('%');
  const auto number =
      parse_real (relative ? text.substr (0, text.size () - 1) : text);
  const double largest = relative ? 100.0 : 1e6;
  if (!number || *number < 0.0 || *number > largest)
    return Error{in_quotes (text) +
                 " is not a coordinate; use pixels, such as 143, or a "
                 "percentage, 0% to 100%"};
  return Coordinate{relative ? *number / 100.0 : *number, relative};
}

Result<ProfileLine>
ProfileLine::parse (std::string_view text)
{
  ProfileLine line;
  std::vector<Coordinate *> wanted = {
      &line.x0_, &line.y0_, &line.x1_, &line.y1_};
  std::string_view coordinates = text;
  line.kind_ = Kind::kFree;
  if (text.starts_with ("row:") || text.starts_with ("column:")) {
    const bool is_row = text.starts_with ("row:");
    line.kind_ = is_row ? Kind::kRow : Kind::kColumn;
    wanted = {is_row ? &line.y0_ : &line.x0_};
    coordinates.remove_prefix (text.find (':') + 1);
  }
  const auto parts = split (coordinates, '/');
  if (parts.size () != wanted.size ())
    return Error{in_quotes (text) +
                 " is not a line; use row:Y, column:X or X0/Y0/X1/Y1, in "
                 "pixels or in %"};
  for (std::size_t i = 0; i < parts.size (); i++) {
    ASSIGN_OR_RETURN (*wanted[i], parse_coordinate (parts[i]));
  }
  return line;
}

Result<std::vector<Position>>
ProfileLine::points (Extent size) const
{
  Position from{x0_.in (size.width), y0_.in (size.height)};
  Position to{x1_.in (size.width), y1_.in (size.height)};
  if (kind_ == Kind::kRow) {
    from = {0.0, std::round (from.y)};
    to = {double (size.width - 1), from.y};
  } else if (kind_ == Kind::kColumn) {
    from = {std::round (from.x), 0.0};
    to = {from.x, double (size.height - 1)};
  }
  const double right = std::max (from.x, to.x);
  const double bottom = std::max (from.y, to.y);
  if (right > size.width - 1 || bottom > size.height - 1)
    return Error{"the line reaches pixel (" + real_text (right) + ", " +
                 real_text (bottom) + ") of a picture of " + size_text (size) +
                 "; its last pixel is (" + std::to_string (size.width - 1) +
                 ", " + std::to_string (size.height - 1) +
                 "); percentages such as 50% fit every size"};

  const int steps = std::max (
      1, int (std::lround (std::hypot (to.x - from.x, to.y - from.y))));
  std::vector<Position> points;
  if (from == to)
    return std::vector{from};
  for (int i = 0; i <= steps; i++) {
    const double part = double (i) / steps;
    points.push_back (
        {std::lerp (from.x, to.x, part), std::lerp (from.y, to.y, part)});
  }
  return points;
}

} // namespace codedexposure
