/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The filters of all mirrors of a frame; for this folder only. */
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "rectify/kernels.h"
#include "rectify/weights.h"

namespace codedexposure
{

/** Numbers the windows around mirrors: windows with the same elements have the
 * same number. */
class Surroundings
{
public:
  /** @p elements  outlive this.
   *  @p mirrors   of the array; beyond it, tiles continue.
   *  @p reach     of the windows, mirrors to each side. */
  Surroundings (const ElementMap &elements, Extent mirrors, int reach);

  /** Sets @p numbers to those of the windows around mirrors (0, @p y),
   * (1, @p y) ... */
  void find_row (int y, std::span<int> numbers);
  /** The elements of a window, row by row. */
  const std::vector<int> &window (int number) const
  {
    return *windows_[std::size_t (number)];
  }
  int count () const { return int (windows_.size ()); }
  /** Windows within one part repeat with its tile and have the first numbers:
   * as many as this. */
  int repeating () const { return repeating_; }
  /** Windows of mirrors of the array that do not repeat, at most. */
  double others () const;

private:
  template <typename ElementAt>
  int number_of (int x, int y, const ElementAt &element_at);
  void add_part (int part);
  int inside_part (int part, int x, int y) const;
  void find_border (int part, int y, std::span<int> numbers);

  const ElementMap &elements_;
  Extent mirrors_;
  int reach_, repeating_;
  std::map<std::vector<int>, int> numbers_;
  std::vector<const std::vector<int> *> windows_;
  std::vector<std::vector<int>> parts_; // in one period of each tile
};

/**
 * Filters for every surroundings and fraction of a pixel, made when they are
 * first requested, each for several amounts of noise.
 *
 * Weights change smoothly with the fraction, except for a kink where the centre
 * of a pixel falls on the centre of a mirror. They are solved on a coarse grid
 * of fractions, which contains the kink, and interpolated between. Next to
 * another part of the schedule, where few mirrors have the same surroundings,
 * each filter is solved.
 */
class FilterBank
{
public:
  /** @p scene  statistics of the mirrors' light. */
  FilterBank (const PixelView &view, const ElementMap &elements, Extent mirrors,
      const SceneClass &scene);

  const WeightSolver &solver () const { return solver_; }
  /** The time to make all filters, as a part of what is allowed. */
  double effort () const;
  /** The least that it can be, before anything is made. */
  static double effort (const PixelView &view, const Schedule &schedule);
  Surroundings &surroundings () { return surroundings_; }
  /** Noise of a pixel, rms, in units of the scene's standard deviation. */
  static constexpr std::array<double, rectify::kNoises> kNoises = {
      0.05, 0.11, 0.25, 0.55};
  /** Number of the filters for mirrors with surroundings @p around that are
   * seen @p fx, @p fy pixels, -0.5 to 0.5, from the centre of their window. */
  std::int32_t filter (int around, double fx, double fy);
  /** The same at the border of the frame, where the window is shifted into it:
   * of the mirror @p at, which is up to half a window further from the centre.
   * To a quarter of a pixel. */
  std::int32_t border_filter (int around, Offset at, double fx, double fy);
  /** Whether there is time and room for these. */
  bool has_border () const;

  /** See rectify::Filters. */
  struct Tables {
    std::vector<float> weights;
    std::vector<rectify::WindowScale> scales;
    std::vector<rectify::FilterError> errors;
  };
  Tables tables () && { return std::move (tables_); }

private:
  Neighbourhood neighbourhood (int around) const;
  Neighbourhood wide_neighbourhood (Offset at) const;
  std::vector<float> solve (
      const Neighbourhood &mirrors, double fx, double fy) const;
  const std::vector<float> &node (int around, int i, int j);
  std::vector<float> interpolated (int around, double fx, double fy);
  std::int32_t &known_filter (int around, int px, int py);
  void append (int around, const std::vector<float> &solved);

  const ElementMap &elements_;
  Extent mirrors_;
  WeightSolver solver_;
  Surroundings surroundings_;
  CodedCovariance covariance_;
  int parts_, steps_; // per pixel: filters, and intervals of the solved grid
  double most_light_ = 0.0; // of an element
  std::map<int, Neighbourhood> neighbourhoods_, border_neighbourhoods_;
  std::vector<std::vector<float>> nodes_;
  std::vector<std::int32_t> filters_; // of repeating surroundings
  std::map<std::array<int, 3>, std::int32_t> other_filters_, border_filters_;
  Tables tables_;
};

} // namespace codedexposure
