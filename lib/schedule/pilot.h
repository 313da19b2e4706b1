/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A strip of mirrors with a code of its own that makes the phase of the masks
 * visible on any scene. */
#pragma once

namespace cexp
{

/**
 * The sum of the masks over a whole exposure does not depend on their order:
 * on a still scene a code of one frame cannot show that the masks are shifted
 * by whole slots. The pilot therefore has a period of two frames. Its columns,
 * x mod 4, open for N slots in a row out of 2 N:
 *   0: slots 0 .. N-1          1: slots h .. h+N-1, h = N / 2 rounded down
 *   2: when column 0 is shut   3: when column 1 is shut
 * so that the four means of one frame tell the phase modulo 2 N.
 */
constexpr int kPilotColumns = 4;

/** Whether the pilot's mirrors in column @p x are open in mask @p mask of
 * 2 @p slots. */
constexpr bool
pilot_open (int x, int mask, int slots)
{
  const int lag = (x & 1) != 0 ? slots / 2 : 0;
  const bool in_first = (mask - lag + 2 * slots) % (2 * slots) < slots;
  return in_first == ((x & 2) == 0);
}

} // namespace cexp
