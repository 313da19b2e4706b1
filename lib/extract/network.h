/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A sorting network of any size. */
#pragma once

namespace codedexposure
{

/**
 * Calls compare (low, high) for every comparator of Batcher's merge exchange
 * (Knuth, The Art of Computer Programming 3, algorithm 5.2.2M): when each has
 * left the smaller value at its low and the larger one at its high position,
 * positions 0..n - 1 are sorted.
 */
template <typename Compare>
[[gnu::always_inline]] constexpr void
merge_exchange (int n, Compare compare)
{
  int top = 1;
  while (2 * top < n)
    top *= 2;
  for (int p = top; p > 0; p /= 2) {
    int apart = p, odd = 0;
    for (int q = top;; q /= 2) {
      for (int i = 0; i + apart < n; i++)
        if ((i & p) == odd)
          compare (i, i + apart);
      if (q == p)
        break;
      apart = q - p;
      odd = p;
    }
  }
}

} // namespace codedexposure
