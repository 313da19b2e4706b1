/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The patterns that a calibration shows on the mirrors. */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/geometry.h"
#include "base/image.h"
#include "base/result.h"

namespace codedexposure
{

/** The direction along which a pattern varies. */
enum class Axis { x, y, both };

/**
 * One pattern: which mirrors are on while the camera exposes a frame.
 *
 * "dark", "white"        all mirrors off, on
 * "grating-A:P/K"        A = x: mirrors with (x + K) mod P < P / 2; y: the same
 *                        of y; both: those that are on in x and in y
 * "gray-A:W/B"           A = x: bit B of the Gray code of x / W, rounded down,
 *                        so that stripes are W mirrors wide; y: of y
 * "gray-A:W/B-inverse"   the complement
 */
struct Pattern {
  enum class Kind { dark, white, grating, gray };
  static constexpr int kMinPeriod = 2;
  static constexpr int kMaxPeriod = 256;
  static constexpr int kMaxBit = 13;

  Kind kind = Kind::dark;
  Axis axis = Axis::x;
  /** grating: period in mirrors, even; gray: width W of a stripe. */
  int period = 0;
  int phase = 0;        ///< grating: mirrors, 0..period - 1
  int bit = 0;          ///< gray: 0 is the finest
  bool inverse = false; ///< gray

  static Result<Pattern> parse (std::string_view text);
  std::string text () const;
  bool on (int x, int y) const;
  /** What the beam of the mirrors that are off shows of it. Not for gratings in
   * both directions, of which the complement is no pattern. */
  Pattern complement () const;

  bool operator== (const Pattern &) const = default;
};

/** The grating in both directions for LiveMoire; its fringes are visible to the
 * eye, too. */
Pattern live_grating (int period = 4);

/**
 * The patterns of a calibration of @p mirrors, in this order: dark, white, the
 * Gray codes of x and y with their inverses, the finest bit last, and the
 * gratings of x and y at all phases. Gray stripes are half a period wide.
 */
std::vector<Pattern> calibration_patterns (Extent mirrors, int period = 12);

} // namespace codedexposure
