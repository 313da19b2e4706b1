/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Scenes that move and light that changes, slot by slot. */
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "base/image.h"

namespace codedexposure::test
{

/** Draws the scene during a slot. */
using Scene =
    std::function<void (std::int64_t slot, ImageView<std::uint8_t> out)>;

/** Part of white of a texture that goes on for ever. */
inline double
texture (int x, int y)
{
  static const std::vector<double> tile = [] {
    std::vector<double> values;
    for (int v = 0; v < 128; v++)
      for (int u = 0; u < 128; u++)
        values.push_back (0.45 +
                          0.2 * std::sin (u * 0.1964) * std::cos (v * 0.1473) +
                          0.15 * std::sin (u * 0.884 - v * 0.491) +
                          (u * 31 + v * 17) % 13 * 0.01);
    return values;
  }();
  return tile[std::size_t ((y & 127) * 128 + (x & 127))];
}

/** The texture, moved (dx, dy), in light of @p brightness. */
inline void
draw_texture (
    ImageView<std::uint8_t> out, int dx, int dy, double brightness = 1.0)
{
  for (int y = 0; y < out.height; y++)
    for (int x = 0; x < out.width; x++)
      out.at (x, y) = std::uint8_t (
          255 * std::min (1.0, brightness * texture (x + dx, y + dy)));
}

inline void
still (std::int64_t, ImageView<std::uint8_t> out)
{
  draw_texture (out, 0, 0);
}

inline void
moving (std::int64_t slot, ImageView<std::uint8_t> out)
{
  draw_texture (out, int (slot), -int (slot / 2));
}

/** A moving scene in light that changes with the slot. */
inline Scene
lit_by (std::function<double (std::int64_t slot)> light)
{
  return [light] (std::int64_t slot, ImageView<std::uint8_t> out) {
    draw_texture (out, int (slot), -int (slot / 2), light (slot));
  };
}

inline Scene
each_pixel (std::function<double (int x, int y, std::int64_t slot)> value)
{
  return [value] (std::int64_t slot, ImageView<std::uint8_t> out) {
    for (int y = 0; y < out.height; y++)
      for (int x = 0; x < out.width; x++)
        out.at (x, y) = std::uint8_t (255 * value (x, y, slot));
  };
}

/** Lamps on the mains, with two fifths of their light in the ripple, seen at
 * 100 slots a second. */
inline const Scene kMains = lit_by ([] (std::int64_t slot) {
  return 0.8 + 0.2 * std::sin (0.754 * double (slot));
});

} // namespace codedexposure::test
