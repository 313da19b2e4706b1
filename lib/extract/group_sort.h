/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The paper's sort of one group, to read and to measure against. */
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <span>
#include <utility>

namespace codedexposure
{

/** Groups smaller than this are sorted by insertion (paper, Fig. 7: k = 7). */
constexpr std::size_t kInsertionBelow = 7;

template <typename T, typename Less>
void
insertion_sort (std::span<T> values, Less &less)
{
  for (std::size_t i = 1; i < values.size (); i++) {
    const T value = values[i];
    std::size_t hole = i;
    for (; hole > 0 && less (value, values[hole - 1]); hole--)
      values[hole] = values[hole - 1];
    values[hole] = value;
  }
}

/**
 * Three-element-median quicksort with insertion sort below @p insertion_below
 * (paper, Section 3.3 and Fig. 7).
 *
 * @p values  sorted ascending in place.
 * @p less    strict weak order; passed by reference so that it can count.
 */
template <typename T, typename Less = std::less<>>
void
group_sort (std::span<T> values, Less &&less = {},
    std::size_t insertion_below = kInsertionBelow)
{
  while (values.size () >= std::max<std::size_t> (insertion_below, 3)) {
    T &first = values.front ();
    T &middle = values[values.size () / 2];
    T &last = values.back ();
    if (less (middle, first))
      std::swap (middle, first);
    if (less (last, middle)) {
      std::swap (last, middle);
      if (less (middle, first))
        std::swap (middle, first);
    }

    /* The ends are already on their side of the median and stop the scans. */
    const T pivot = middle;
    std::size_t low = 0;
    std::size_t high = values.size () - 1;
    do {
      while (less (values[++low], pivot)) {
      }
      while (less (pivot, values[--high])) {
      }
      if (low < high)
        std::swap (values[low], values[high]);
    } while (low < high);

    /* The smaller part first keeps the depth of the calls below log2 n. */
    std::span<T> small = values.first (low);
    std::span<T> large = values.subspan (low);
    if (small.size () > large.size ())
      std::swap (small, large);
    group_sort (small, less, insertion_below);
    values = large;
  }
  insertion_sort (values, less);
}

} // namespace codedexposure
