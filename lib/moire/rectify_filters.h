/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The weights of all mirrors of a frame; for the sources of lib/moire only. */
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "moire/rectify_weights.h"

namespace cexp
{

/** Mirrors whose windows bear the same elements have one number. */
class Surroundings
{
public:
  /** Windows reach @p reach mirrors to each side. @p elements outlive this. */
  Surroundings (const Elements &elements, int reach);

  /** Sets @p numbers to those of mirrors (0, @p y), (1, @p y) ... */
  void find_row (int y, std::span<int> numbers);
  /** The elements of a window, row by row. */
  const std::vector<int> &window (int number) const
  {
    return *windows_[std::size_t (number)];
  }
  int count () const { return int (windows_.size ()); }
  /** Those of mirrors with one part around them repeat with its tile, and have
   * the first numbers. */
  int repeating () const { return repeating_; }

private:
  int number_of (std::vector<int> window);
  void add_part (int part);
  int in_part (int part, int x, int y) const;
  void find_border (int part, int y, std::span<int> numbers);

  const Elements &elements_;
  int reach_, repeating_;
  std::map<std::vector<int>, int> numbers_;
  std::vector<const std::vector<int> *> windows_;
  std::vector<std::vector<int>>
      parts_; // numbers in a period of the part's tile
};

/**
 * Filters for every surroundings and fraction of a pixel, made when they are
 * first asked for, each for several amounts of noise.
 *
 * Weights change smoothly with the fraction, but for a kink where a pixel looks
 * straight at a mirror: they are solved for on a coarse grid of fractions, that
 * one among them, and filters lie on straight lines between. Next to another
 * part of the schedule, where few mirrors have the same surroundings, each
 * filter is solved for.
 */
class FilterBank
{
public:
  FilterBank (const PixelView &view, const Elements &elements,
      double correlation_length);

  const WeightSolver &solver () const { return solver_; }
  Surroundings &surroundings () { return surroundings_; }
  /** Noise of a pixel, rms, as a part of the scene's variation. */
  static constexpr std::array<double, 4> kNoises = {0.05, 0.11, 0.25, 0.55};
  /** Number of the filters of mirrors that have surroundings @p around and are
   * seen @p fx, @p fy pixels, -0.5 to 0.5, from their window's middle one. */
  std::int32_t filter (int around, double fx, double fy);

  /** What a filter's window tells of its scene. */
  struct Look {
    float smoothness; ///< 1 by how rough it looks (WeightSolver)
    float darkness;   ///< light of the brightest element by the mirror's
  };
  /** Of each filter. */
  std::vector<Look> looks () && { return std::move (looks_); }
  /** Filter after filter, for each of kNoises, row by row, each row with zeros
   * up to row_length (). */
  std::vector<float> weights () && { return std::move (weights_); }
  static constexpr int row_length (int taps) { return (taps + 3) / 4 * 4; }

private:
  Neighbourhood neighbourhood (int around) const;
  std::vector<float> solve (
      const Neighbourhood &mirrors, double fx, double fy) const;
  const std::vector<float> &node (int around, int i, int j);
  std::vector<float> between_nodes (int around, double fx, double fy);
  std::int32_t &known_filter (int around, int px, int py);
  void append (int around, const std::vector<float> &solved);

  const Elements &elements_;
  WeightSolver solver_;
  Surroundings surroundings_;
  SpaceCorrelation space_;
  int parts_, steps_; // of a pixel: filters, and solved ones
  std::map<int, Neighbourhood> neighbourhoods_;
  std::vector<std::vector<float>> nodes_;
  std::vector<std::int32_t> filters_; // of surroundings that repeat
  std::map<std::array<int, 3>, std::int32_t> others_;
  std::vector<float> weights_;
  std::vector<Look> looks_;
};

} // namespace cexp
