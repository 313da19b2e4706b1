/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Parts of scenes. */
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "bench/scene.h"

namespace codedexposure
{

std::unique_ptr<SyntheticScene> make_candle (Extent size, bool blown_out);
std::unique_ptr<SyntheticScene> make_pour (Extent size);

/** A sine of that frequency and phase. */
inline double
swing (double seconds, double hertz, double phase = 0.0)
{
  return std::sin (2.0 * std::numbers::pi * (hertz * seconds + phase));
}

/** 0 up to @p from, 1 from @p to on, and smooth between. */
inline double
smooth_step (double from, double to, double x)
{
  const double part = std::clamp ((x - from) / (to - from), 0.0, 1.0);
  return part * part * (3.0 - 2.0 * part);
}

/** Positions in a picture of height 1, relative to its middle column and top
 * row: from pixels to positions and back. */
struct SceneFrame {
  Extent size;

  double unit () const { return double (size.height); }
  Position at (int x, int y) const
  {
    return {(x + 0.5 - size.width / 2.0) / unit (), (y + 0.5) / unit ()};
  }
  /** First pixel whose centre is not before that position, clamped. */
  int column (double x) const
  {
    return std::clamp (
        int (std::ceil (x * unit () + size.width / 2.0 - 0.5)), 0, size.width);
  }
  int row (double y) const
  {
    return std::clamp (int (std::ceil (y * unit () - 0.5)), 0, size.height);
  }
};

} // namespace codedexposure
