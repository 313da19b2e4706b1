/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Random valid schedules for tests of the text forms. */
#pragma once

#include <algorithm>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "schedule/schedule.h"

namespace codedexposure::test
{

/** Draws valid schedules; the same seed draws the same ones. */
class ScheduleSource
{
public:
  explicit ScheduleSource (unsigned seed) : random_ (seed) {}

  /** Tile and code with a name, which presets can say. */
  Schedule named ()
  {
    for (;;) {
      const Tile tile = named_tile ();
      static constexpr const char *kCodes[] = {
          "sequential", "staircase", "s-matrix"};
      const auto code = Code::named (kCodes[below (3)], tile.elements ());
      if (code.ok ())
        if (auto schedule = with_options ({tile, *code}); schedule.ok ())
          return *std::move (schedule);
    }
  }

  /** Tile, code or both written out, which only JSON can say. */
  Schedule written ()
  {
    for (;;) {
      const Tile tile = below (3) == 0 ? named_tile () : written_tile ();
      auto schedule = with_options ({tile, written_code (tile.elements ())});
      if (schedule.ok ())
        return *std::move (schedule);
    }
  }

private:
  int below (int bound) { return int (random_ () % unsigned (bound)); }

  Tile named_tile ()
  {
    for (;;) {
      const int n = 2 + below (below (4) == 0 ? 255 : 24);
      const auto tile = below (3) == 0
                            ? Tile::raster (1 + below (16), 1 + n / 8)
                        : below (8) == 0 ? Tile::diamond (n)
                                         : Tile::lattice (n, below (n));
      if (tile.ok ())
        return *tile;
    }
  }

  /** The labels of a named tile, renamed. */
  Tile written_tile ()
  {
    const Tile tile = named_tile ();
    const std::vector<int> names = permutation (tile.elements ());
    std::vector<std::uint8_t> labels;
    for (const std::uint8_t label : tile.labels ())
      labels.push_back (std::uint8_t (names[label]));
    return *Tile::from_labels (
        tile.period_x (), tile.period_y (), std::move (labels));
  }

  Code written_code (int n)
  {
    std::vector<std::string> rows;
    for (int e = 0; e < n; e++) {
      std::string &row = rows.emplace_back (std::size_t (n), '0');
      for (char &bit : row)
        bit = char ('0' + below (2));
      row[std::size_t (below (n))] = '1';
    }
    return *Code::from_rows (rows);
  }

  std::vector<int> permutation (int n)
  {
    std::vector<int> order (std::size_t (n), 0);
    std::iota (order.begin (), order.end (), 0);
    std::shuffle (order.begin (), order.end (), random_);
    return order;
  }

  Nanoseconds time ()
  {
    static constexpr Nanoseconds kScales[] = {1, 10, 1000, 100'000, 1'000'000};
    return below (3) == 0 ? 0 : kScales[below (5)] * below (100'000);
  }

  Result<Schedule> with_options (Schedule::Parts parts)
  {
    parts.timing = {time (), time (), time ()};
    if (below (3) == 0)
      parts.order = permutation (parts.tile.elements ());
    if (below (2) == 0)
      parts.phase = {below (50), below (Schedule::kMaxMirrors + 1)};
    if (below (2) == 0)
      parts.leak =
          std::uniform_real_distribution (0.0, Schedule::kMaxLeak) (random_);
    if (below (2) == 0)
      parts.pilot_rows = below (Schedule::kMaxMirrors + 1);
    if (below (4) == 0)
      for (const int x : {0, 100})
        parts.regions.push_back ({{x + below (90), below (100), 8, 4},
            *Tile::lattice (4, 2), *Code::named ("staircase", 4),
            permutation (4), {2 * below (10), below (10)}});
    return Schedule::make (std::move (parts));
  }

  std::mt19937 random_;
};

} // namespace codedexposure::test
