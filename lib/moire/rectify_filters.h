/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The weights of all mirrors of a frame; for the sources of lib/moire only. */
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "moire/rectify_weights.h"
#include "schedule/tile.h"

namespace cexp
{

/** Mirrors whose windows bear the same elements have one number. */
class Surroundings
{
public:
  Surroundings (const Schedule &schedule, int reach);

  int count () const { return int (first_.size ()); }
  /** Of mirrors (0, @p y), (1, @p y) ..., which repeat after period () ones. */
  const int *row (int y) const
  {
    return number_.data () + std::ptrdiff_t (floor_mod (y, rows_)) * period_;
  }
  int period () const { return period_; }
  /** A mirror that has it. */
  Offset first (int number) const { return first_[std::size_t (number)]; }

private:
  int period_, rows_;
  std::vector<int> number_;
  std::vector<Offset> first_;
};

/**
 * Filters for every surroundings and fraction of a pixel, made when they are
 * first asked for, each for several amounts of noise.
 *
 * Weights change smoothly with the fraction, but for a kink where a pixel looks
 * straight at a mirror: they are solved for on a coarse grid of fractions, that
 * one among them, and filters lie on straight lines between.
 */
class FilterBank
{
public:
  FilterBank (const PixelView &view, const Schedule &schedule,
      const Matrix &elements, double correlation_length);

  const WeightSolver &solver () const { return solver_; }
  const Surroundings &surroundings () const { return surroundings_; }
  /** Noise of a pixel, rms, as a part of the scene's variation. */
  static constexpr std::array<double, 4> kNoises = {0.05, 0.11, 0.25, 0.55};
  /** Number of the filters of mirrors that have surroundings @p around and are
   * seen @p fx, @p fy pixels, -0.5 to 0.5, from their window's middle one. */
  std::int32_t filter (int around, double fx, double fy);
  /** Of each filter, 1 by how rough its window looks (WeightSolver). */
  std::vector<float> smoothness () && { return std::move (smoothness_); }
  /** Filter after filter, for each of kNoises, row by row, each row with zeros
   * up to row_length (). */
  std::vector<float> weights () && { return std::move (weights_); }
  static constexpr int row_length (int taps) { return (taps + 3) / 4 * 4; }

private:
  const std::vector<float> &node (int around, int i, int j);
  const Neighbourhood &neighbourhood (int around);
  void append (int around, int px, int py);

  const Schedule &schedule_;
  const Matrix &elements_;
  WeightSolver solver_;
  Surroundings surroundings_;
  SpaceCorrelation space_;
  int parts_, steps_; // of a pixel: filters, and solved ones
  std::map<int, Neighbourhood> neighbourhoods_;
  std::vector<std::vector<float>> nodes_;
  std::vector<std::int32_t> filters_;
  std::vector<float> weights_, smoothness_;
};

} // namespace cexp
