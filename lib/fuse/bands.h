/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Rows of a frame that threads share. */
#pragma once

#include <algorithm>
#include <utility>

#include "base/workers.h"

namespace codedexposure::fuse
{

/** Rows first .. end - 1, and the thread that computes them. */
struct Band {
  int first, end;
  int worker;
};

/** Calls use (band) for all of @p rows rows, in any order, with at least
 * @p min_rows at a time: all of them if there is one thread, as neighbouring
 * bands compute some rows twice. False when it was stopped. */
template <typename Use>
bool
run_bands (Workers &workers, int rows, int min_rows, std::stop_token stop,
    const Use &use)
{
  constexpr int kForEachThread = 2;
  const int bands =
      workers.count () == 1 ? 1 : kForEachThread * workers.count ();
  const int height = std::max ((rows + bands - 1) / bands, min_rows);
  return workers.run ((rows + height - 1) / height,
      [&] (int part, int worker) {
        const int first = part * height;
        use (Band{first, std::min (first + height, rows), worker});
      },
      std::move (stop));
}

} // namespace codedexposure::fuse
