/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Rows of a frame that threads share. */
#pragma once

#include <algorithm>
#include <stop_token>

#include "base/workers.h"

namespace codedexposure::fuse
{

/** Thrown when a stop was requested; Fuser turns it into
 * ErrorCode::cancelled. */
struct Stopped {
};

/** Who computes a frame, and what can end it early. */
struct Task {
  Workers &workers;
  std::stop_token stop;

  /** Workers::run (); throws Stopped when it was stopped. */
  template <typename Use>
  void run (int parts, const Use &use) const
  {
    if (!workers.run (parts, use, stop))
      throw Stopped ();
  }
};

/** Rows first .. end - 1, and the thread that computes them. */
struct Band {
  int first, end;
  int worker;
};

/** Calls use (band) for all of @p rows rows, in any order, with at least
 * @p min_rows at a time: all of them if there is one thread, as neighbouring
 * bands compute some rows twice. */
template <typename Use>
void
run_bands (const Task &task, int rows, int min_rows, const Use &use)
{
  constexpr int kForEachThread = 2;
  const int threads = task.workers.count ();
  const int bands = threads == 1 ? 1 : kForEachThread * threads;
  const int height = std::max ((rows + bands - 1) / bands, min_rows);
  task.run ((rows + height - 1) / height, [&] (int part, int worker) {
    const int first = part * height;
    use (Band{first, std::min (first + height, rows), worker});
  });
}

} // namespace codedexposure::fuse
