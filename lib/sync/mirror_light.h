/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What a camera sees of a mirror. */
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <variant>

#include "base/geometry.h"
#include "base/image.h"
#include "mapping/mapping.h"

namespace codedexposure
{

/** What is known of one of two cameras. */
struct BeamCamera {
  Extent size;            ///< of its frames
  const Mapping *mapping; ///< to the mirrors; null: pixels are mirrors
  double black = 0.0;     ///< level without light
  double white = 255.0;   ///< pixels from here on are saturated

  /** Of the mirrors that it looks at. */
  Extent mirrors () const { return mapping ? mapping->mirrors () : size; }
  /** Where mirror (x, y) is in its frames. */
  Position place (int x, int y) const
  {
    const Position mirror{double (x), double (y)};
    return mapping ? mapping->camera_at (mirror) : mirror;
  }
  /** Whether @p at has four pixels around it. */
  bool contains (Position at) const
  {
    return at.x >= 0.0 && at.x <= size.width - 1.0 && at.y >= 0.0 &&
           at.y <= size.height - 1.0;
  }
};

/** The level at @p at, which lies between pixels. */
template <typename Pixel>
double
bilinear (ImageView<const Pixel> frame, Position at)
{
  const int x = int (at.x), y = int (at.y);
  const int right = std::min (x + 1, frame.width - 1);
  const int below = std::min (y + 1, frame.height - 1);
  const double dx = at.x - x, dy = at.y - y;
  return (frame.at (x, y) * (1.0 - dx) + frame.at (right, y) * dx) *
             (1.0 - dy) +
         (frame.at (x, below) * (1.0 - dx) + frame.at (right, below) * dx) * dy;
}

/** A frame of 8 or 16 bits. */
using GreyView =
    std::variant<ImageView<const std::uint8_t>, ImageView<const std::uint16_t>>;

/** Calls @p use with the level at each of @p places. */
template <typename Use>
void
each_level (const GreyView &frame, std::span<const Position> places, Use use)
{
  std::visit (
      [&] (const auto &pixels) {
        for (const Position at : places)
          use (bilinear (pixels, at));
      },
      frame);
}

} // namespace codedexposure
