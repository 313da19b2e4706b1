/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "calibrate/fringes.h"

#include <algorithm>
#include <cmath>

#include "base/statistics.h"

namespace codedexposure
{

float
Fringes::full_amplitude () const
{
  float most = 0.0f;
  each_pixel (amplitude,
      [&] (int x, int y) { most = std::max (most, amplitude.at (x, y)); });
  return most / 2;
}

std::uint8_t
Fringes::grey (int x, int y, float full) const
{
  const float contrast =
      full > 0.0f ? std::min (1.0f, amplitude.at (x, y) / full) : 0.0f;
  return std::uint8_t (127.5f * contrast * (1.0f + std::cos (phase.at (x, y))));
}

} // namespace codedexposure
