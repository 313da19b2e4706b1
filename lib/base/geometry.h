/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Points, sizes and rectangles in a plane of pixels or of mirrors; x grows to
 * the right, y downwards. Names of variables say which plane is meant. */
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace codedexposure
{

/** A place or a displacement. */
template <typename T>
struct Point {
  T x{};
  T y{};
  bool operator== (const Point &) const = default;
};

/** In whole pixels or mirrors. */
using Offset = Point<int>;
/** In parts of them; the centre of the first one is (0, 0), that of its right
 * neighbour (1, 0). */
using Position = Point<double>;

/** The size of a block. */
struct Extent {
  int width = 1;
  int height = 1;
  bool operator== (const Extent &) const = default;
};

/** The pixels [x, x + width) by [y, y + height). */
struct Rect {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;

  int right () const { return x + width; }
  int bottom () const { return y + height; }
  bool holds (int px, int py) const
  {
    return px >= x && px < right () && py >= y && py < bottom ();
  }
  bool meets (const Rect &other) const
  {
    return x < other.right () && other.x < right () && y < other.bottom () &&
           other.y < bottom ();
  }
  bool operator== (const Rect &) const = default;
};

/** "192x144" */
std::string size_text (Extent size);
/** The inverse of size_text () for sizes of 1 or more; none for another text. */
std::optional<Extent> parse_size (std::string_view text);
/** "192x144+64+32": width, height and corner. */
std::string rect_text (const Rect &rect);
/** The inverse of rect_text (); "192x144" starts at 0, 0. None for another
 * text. Numbers may be negative. */
std::optional<Rect> parse_rect (std::string_view text);

/** The remainder in [0, n) that belongs to floor division; n > 0. */
constexpr int
floor_mod (int a, int n)
{
  const int r = a % n;
  return r < 0 ? r + n : r;
}

} // namespace codedexposure
