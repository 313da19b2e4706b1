/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The filters of all mirrors of a frame; for this folder only. */
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numeric>
#include <span>
#include <vector>

#include "rectify/kernels.h"
#include "rectify/weights.h"

namespace codedexposure
{

/* A pixel is divided into as many parts as the number of filters allows, and
 * into a coarser grid for those that are solved. */
constexpr int kMaxFilters = 1 << 15;
constexpr int kMaxParts = 32;
constexpr int kMinParts = 4;
constexpr int kSteps = 8;
constexpr int kFewSteps = 4;
constexpr int kManySurroundings = 16;
/* Surroundings up to which there are filters for the border: 0.7 MB each. */
constexpr int kMostAtBorder = 64;

/* Multiplications that are allowed for windows that repeat, and for those next
 * to other parts of the schedule: some seconds. */
constexpr double kMaxWork = 5e9, kMaxWorkOfOthers = 1.5e10;
/* Mirrors in all windows that repeat: a fraction of a gigabyte. */
constexpr double kMaxMirrors = 5e7;

constexpr std::int32_t kUnknown = -1;

/* Smaller roughness of a window counts as this. */
constexpr float kMinRoughness = 0.01f;

/* Fraction of a pixel, -0.5 to 0.5. */
inline double
node_at (int node, int steps)
{
  return double (node) / steps - 0.5;
}

/* The nodes of one half of a pixel and their weights at a fraction: Lagrange's
 * polynomial through them. */
struct Interpolation {
  int first;
  std::vector<float> parts;

  Interpolation (double at, int steps) : first (at < 0.0 ? 0 : steps / 2)
  {
    for (int i = first; i <= first + steps / 2; i++) {
      double part = 1.0;
      for (int j = first; j <= first + steps / 2; j++)
        if (j != i)
          part *= (at - node_at (j, steps)) /
                  (node_at (i, steps) - node_at (j, steps));
      parts.push_back (float (part));
    }
  }
};

inline std::vector<SlotShares>
shares_of (const ElementMap &elements)
{
  std::vector<SlotShares> shares (std::size_t (elements.elements ()));
  for (int e = 0; e < elements.elements (); e++)
    for (int slot = 0; slot < elements.schedule ().slots (); slot++)
      if (const double light = elements.light (e, slot); light > 0.0)
        shares[std::size_t (e)].push_back ({slot, light});
  return shares;
}

/* Beyond the mirrors, tiles continue. */
inline int
element_near (const ElementMap &elements, Extent mirrors, int x, int y)
{
  const int part = elements.part_at (std::clamp (x, 0, mirrors.width - 1),
      std::clamp (y, 0, mirrors.height - 1));
  return elements.at (part, x, y);
}

/** Numbers the windows around mirrors: windows with the same elements have the
 * same number. */
class Surroundings
{
public:
  /** @p elements  outlive this.
   *  @p mirrors   of the array; beyond it, tiles continue.
   *  @p reach     of the windows, mirrors to each side. */
  Surroundings (const ElementMap &elements, Extent mirrors, int reach)
      : elements_ (elements), mirrors_ (mirrors), reach_ (reach)
  {
    for (int i = 0; i < elements.parts (); i++)
      add_part (i);
    repeating_ = count ();
  }

  /** Sets @p numbers to those of the windows around mirrors (0, @p y),
   * (1, @p y) ... */
  void find_row (int y, std::span<int> numbers)
  {
    for (std::size_t x = 0; x < numbers.size (); x++)
      numbers[x] = inside_part (0, int (x), y);
    for (int i = 1; i < elements_.parts (); i++)
      find_border (i, y, numbers);
  }

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
  double others () const
  {
    double count = 0.0;
    for (const Region &region : elements_.schedule ().regions ()) {
      const double width = region.rect.width, height = region.rect.height;
      const double border = 2.0 * reach_;
      count += (width + border) * (height + border) -
               std::max (width - border, 0.0) * std::max (height - border, 0.0);
    }
    return count;
  }

private:
  /* Of the window around mirror @x, @y. */
  template <typename ElementAt>
  int number_of (int x, int y, const ElementAt &element_at)
  {
    std::vector<int> window;
    for (int j = y - reach_; j <= y + reach_; j++)
      for (int i = x - reach_; i <= x + reach_; i++)
        window.push_back (element_at (i, j));
    const auto [at, is_new] =
        numbers_.try_emplace (std::move (window), count ());
    if (is_new)
      windows_.push_back (&at->first);
    return at->second;
  }

  void add_part (int part)
  {
    const Tile &tile = elements_.part (part).tile ();
    const Offset corner = elements_.corner (part);
    std::vector<int> &numbers = parts_.emplace_back ();
    for (int y = 0; y < tile.period_y (); y++)
      for (int x = 0; x < tile.period_x (); x++)
        numbers.push_back (number_of (corner.x + x, corner.y + y,
            [&] (int i, int j) { return elements_.at (part, i, j); }));
  }

  /* The window lies within @part. */
  int inside_part (int part, int x, int y) const
  {
    const Tile &tile = elements_.part (part).tile ();
    const Offset corner = elements_.corner (part);
    const int column = floor_mod (x - corner.x, tile.period_x ());
    const int row = floor_mod (y - corner.y, tile.period_y ());
    return parts_[std::size_t (part)]
                 [std::size_t (row * tile.period_x () + column)];
  }

  /* The windows that overlap region @part. */
  void find_border (int part, int y, std::span<int> numbers)
  {
    const Rect &rect =
        elements_.schedule ().regions ()[std::size_t (part) - 1].rect;
    if (y < rect.y - reach_ || y >= rect.bottom () + reach_)
      return;
    const Rect inner{rect.x + reach_, rect.y + reach_, rect.width - 2 * reach_,
        rect.height - 2 * reach_};
    const auto element_at = [this] (int i, int j) {
      return element_near (elements_, mirrors_, i, j);
    };
    const int first = std::max (0, rect.x - reach_);
    const int end = std::min (int (numbers.size ()), rect.right () + reach_);
    for (int x = first; x < end; x++) {
      int &number = numbers[std::size_t (x)];
      number = inner.holds (x, y) ? inside_part (part, x, y)
                                  : number_of (x, y, element_at);
    }
  }

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
      const SceneClass &scene)
      : elements_ (elements), mirrors_ (mirrors), solver_ (view),
        surroundings_ (elements, mirrors, solver_.reach ()),
        covariance_ (scene, shares_of (elements), elements.schedule ().slots (),
            2 * solver_.reach (view.taps / 2)),
        parts_ (kMaxParts),
        steps_ (surroundings_.count () > kManySurroundings ? kFewSteps : kSteps)
  {
    const int count = surroundings_.repeating ();
    while (parts_ > kMinParts && count * parts_ * parts_ > kMaxFilters)
      parts_ /= 2;
    filters_.assign (
        std::size_t (count) * std::size_t (parts_ * parts_), kUnknown);
    nodes_.resize (
        std::size_t (count) * std::size_t ((steps_ + 1) * (steps_ + 1)));
    for (int e = 0; e < elements.elements (); e++)
      most_light_ = std::max (most_light_, elements.light (e));
  }

  const WeightSolver &solver () const { return solver_; }

  /** The time to make all filters, as a part of what is allowed. Next to other
   * parts, each window has its own covariances. */
  double effort () const
  {
    const double work = solver_.work (), mirrors = solver_.mirrors ();
    const double nodes = (steps_ + 1.0) * (steps_ + 1.0);
    return surroundings_.repeating () * nodes * work / kMaxWork +
           surroundings_.others () * (work + 5.0 * mirrors * mirrors) /
               kMaxWorkOfOthers;
  }

  /** The least that it can be, before anything is made. */
  static double effort (const PixelView &view, const Schedule &schedule)
  {
    const WeightSolver solver (view);
    const auto windows = [] (const Tile &tile) {
      return double (tile.period_x ()) * tile.period_y ();
    };
    double repeating = windows (schedule.tile ());
    for (const Region &region : schedule.regions ())
      repeating += windows (region.tile);
    return std::max (kFewSteps * kFewSteps * solver.work () / kMaxWork,
        repeating * solver.mirrors () / kMaxMirrors);
  }

  Surroundings &surroundings () { return surroundings_; }
  /** Noise of a pixel, rms, in units of the scene's standard deviation. */
  static constexpr std::array<double, rectify::kNoises> kNoises = {
      0.05, 0.11, 0.25, 0.55};

  /** Number of the filters for mirrors with surroundings @p around that are
   * seen @p fx, @p fy pixels, -0.5 to 0.5, from the centre of their window. */
  std::int32_t filter (int around, double fx, double fy)
  {
    const auto part_of = [this] (double f) {
      return std::clamp (int ((f + 0.5) * parts_), 0, parts_ - 1);
    };
    const auto middle_of = [this] (int part) {
      return (part + 0.5) / parts_ - 0.5;
    };
    const int px = part_of (fx), py = part_of (fy);
    std::int32_t &known = known_filter (around, px, py);
    if (known == kUnknown) {
      known = std::int32_t (tables_.scales.size ());
      const double x = middle_of (px), y = middle_of (py);
      append (around, around < surroundings_.repeating ()
                          ? interpolated (around, x, y)
                          : solve (neighbourhood (around), x, y));
    }
    return known;
  }

  /** The same at the border of the frame, where the window is shifted into it:
   * of the mirror @p at, which is up to half a window further from the centre.
   * To a quarter of a pixel. */
  std::int32_t border_filter (int around, Offset at, double fx, double fy)
  {
    constexpr double kParts = 4.0;
    const int ix = int (std::lround (kParts * fx));
    const int iy = int (std::lround (kParts * fy));
    const auto [known, is_new] =
        border_filters_.try_emplace ({around, ix, iy}, kUnknown);
    if (!is_new)
      return known->second;
    known->second = std::int32_t (tables_.scales.size ());
    const double x = ix / kParts, y = iy / kParts;
    if (around < surroundings_.repeating ()) {
      auto wide = border_neighbourhoods_.find (around);
      if (wide == border_neighbourhoods_.end ())
        wide = border_neighbourhoods_.emplace (around, wide_neighbourhood (at))
                   .first;
      append (around, solve (wide->second, x, y));
    } else {
      append (around, solve (wide_neighbourhood (at), x, y));
    }
    return known->second;
  }

  /** Whether there is time and room for these. */
  bool has_border () const
  {
    return surroundings_.repeating () <= kMostAtBorder;
  }

  /** See rectify::Filters. */
  struct Tables {
    std::vector<float> weights;
    std::vector<rectify::WindowScale> scales;
    std::vector<rectify::FilterError> errors;
  };
  Tables tables () && { return std::move (tables_); }

private:
  Neighbourhood neighbourhood (int around) const
  {
    return {elements_, covariance_, surroundings_.window (around)};
  }

  /* Of all mirrors that a window sees which is shifted into the frame. */
  Neighbourhood wide_neighbourhood (Offset at) const
  {
    const int reach = solver_.reach (solver_.taps () / 2);
    std::vector<int> window;
    for (int y = at.y - reach; y <= at.y + reach; y++)
      for (int x = at.x - reach; x <= at.x + reach; x++)
        window.push_back (element_near (elements_, mirrors_, x, y));
    return {elements_, covariance_, window};
  }

  /* If elements differ in brightness, even flat light makes a window rough, and
   * its noise cannot be derived from the roughness. */
  std::vector<float> solve (
      const Neighbourhood &mirrors, double fx, double fy) const
  {
    static constexpr std::array<double, kNoises.size ()> kUneven = {
        kNoises[1], kNoises[1], kNoises[1], kNoises[1]};
    return solver_.solve (mirrors, fx, fy, mirrors.even () ? kNoises : kUneven);
  }

  const std::vector<float> &node (int around, int i, int j)
  {
    std::vector<float> &weights =
        nodes_[std::size_t ((around * (steps_ + 1) + j) * (steps_ + 1) + i)];
    if (weights.empty ()) {
      auto known = neighbourhoods_.find (around);
      if (known == neighbourhoods_.end ())
        known = neighbourhoods_.emplace (around, neighbourhood (around)).first;
      weights = solve (known->second, node_at (i, steps_), node_at (j, steps_));
    }
    return weights;
  }

  std::vector<float> interpolated (int around, double fx, double fy)
  {
    const Interpolation x (fx, steps_), y (fy, steps_);
    std::vector<float> sum;
    for (std::size_t j = 0; j < y.parts.size (); j++)
      for (std::size_t i = 0; i < x.parts.size (); i++) {
        const float part = x.parts[i] * y.parts[j];
        const auto &solved =
            node (around, x.first + int (i), y.first + int (j));
        sum.resize (solved.size ());
        for (std::size_t k = 0; k < solved.size (); k++)
          sum[k] += part * solved[k];
      }
    return sum;
  }

  std::int32_t &known_filter (int around, int px, int py)
  {
    if (around < surroundings_.repeating ())
      return filters_[std::size_t ((around * parts_ + py) * parts_ + px)];
    return other_filters_.try_emplace ({around, px, py}, kUnknown)
        .first->second;
  }

  /* @solved: from WeightSolver::solve (). */
  void append (int around, const std::vector<float> &solved)
  {
    const int taps = solver_.taps ();
    const float *from = solved.data ();
    const float *scene = from + kNoises.size () * std::size_t (taps * taps);
    for (std::size_t noise = 0; noise < kNoises.size (); noise++) {
      const float gain =
          std::inner_product (from, from + taps * taps, from, 0.0f);
      tables_.errors.push_back (
          {std::max (scene[noise], 0.0f), std::max (gain - 1.0f, 0.0f)});
      for (int row = 0; row < taps; row++, from += taps) {
        tables_.weights.insert (tables_.weights.end (), from, from + taps);
        tables_.weights.resize (
            tables_.weights.size () +
            std::size_t (rectify::row_length (taps) - taps));
      }
    }
    const auto &window = surroundings_.window (around);
    const double light = elements_.light (window[window.size () / 2]);
    tables_.scales.push_back ({1.0f / std::max (solved.back (), kMinRoughness),
        float (most_light_ / light)});
  }

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
