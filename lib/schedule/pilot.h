/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A strip of mirrors with a code of its own, which shows the phase of the masks
 * with any scene. */
#pragma once

#include <bit>

namespace codedexposure
{

/**
 * The sum of the masks over a whole exposure does not depend on their order:
 * on a still scene a code of one frame cannot show that the masks are shifted
 * by whole slots. The pilot therefore has a period of two frames. Each of its
 * columns is on in one mask out of 2 N. In phase, a frame lights columns of
 * masks 0 .. N-1 only or of masks N .. 2N-1 only, whatever the light;
 * masks that come late light columns at the end of the other half as well,
 * those that come early columns at its start.
 *
 * One slot a column, because that is what a sensor set for a one-hot code can
 * take. The columns repeat; in each turn their masks ascend, so that lit
 * columns lie side by side and the blur of a lens matters at two places only.
 * The masks lie close at the borders of the two frames, where a loss of
 * synchronisation shows first.
 */
constexpr int kPilotColumns = 32;

/** The mask out of 2 @p slots in which the pilot's mirrors in column @p column
 * are on: 2^k - 1 masks from a border, no farther than half a frame. */
constexpr int
pilot_mask (int column, int slots)
{
  constexpr int kSide = kPilotColumns / 4;
  const int frame = column / (2 * kSide);
  const int place = column % (2 * kSide);
  const bool at_start = place < kSide;
  const int from_border = at_start ? place : 2 * kSide - 1 - place;
  const int depths = std::bit_width (unsigned ((slots - 1) / 2 + 1));
  const int depth = (1 << (from_border * depths / kSide)) - 1;
  return frame * slots + (at_start ? depth : slots - 1 - depth);
}

/** Whether the pilot's mirrors in column @p x are on in mask @p mask of
 * 2 @p slots. */
constexpr bool
pilot_on (int x, int mask, int slots)
{
  return pilot_mask (x % kPilotColumns, slots) == mask;
}

} // namespace codedexposure
