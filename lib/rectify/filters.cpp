/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "rectify/filters.h"

#include <algorithm>
#include <cstddef>

namespace codedexposure
{

namespace
{

/* A pixel is divided into as many parts as the number of filters allows, and
 * into a coarser grid for those that are solved. */
constexpr int kMaxFilters = 1 << 15;
constexpr int kMaxParts = 32;
constexpr int kMinParts = 4;
constexpr int kSteps = 8;
constexpr int kFewSteps = 4;
constexpr int kManySurroundings = 16;

constexpr std::int32_t kUnknown = -1;

/* Smaller roughness of a window counts as this. */
constexpr float kMinRoughness = 0.01f;

/* Fraction of a pixel, -0.5 to 0.5. */
double
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

} // namespace

Surroundings::Surroundings (const Elements &elements, int reach)
    : elements_ (elements), reach_ (reach)
{
  for (int i = 0; i < elements.parts (); i++)
    add_part (i);
  repeating_ = count ();
}

int
Surroundings::number_of (std::vector<int> window)
{
  const auto [at, is_new] = numbers_.try_emplace (std::move (window), count ());
  if (is_new)
    windows_.push_back (&at->first);
  return at->second;
}

void
Surroundings::add_part (int part)
{
  const Tile &tile = elements_.tile (part);
  const Rect &rect = elements_.rect (part);
  std::vector<int> &numbers = parts_.emplace_back ();
  for (int y = 0; y < tile.period_y (); y++)
    for (int x = 0; x < tile.period_x (); x++) {
      std::vector<int> window;
      for (int j = -reach_; j <= reach_; j++)
        for (int i = -reach_; i <= reach_; i++)
          window.push_back (
              elements_.at (part, rect.x + x + i, rect.y + y + j));
      numbers.push_back (number_of (std::move (window)));
    }
}

/* The window lies within @part. */
int
Surroundings::inside_part (int part, int x, int y) const
{
  const Tile &tile = elements_.tile (part);
  const Rect &rect = elements_.rect (part);
  const int column = floor_mod (x - rect.x, tile.period_x ());
  const int row = floor_mod (y - rect.y, tile.period_y ());
  return parts_[std::size_t (part)]
               [std::size_t (row * tile.period_x () + column)];
}

void
Surroundings::find_row (int y, std::span<int> numbers)
{
  for (std::size_t x = 0; x < numbers.size (); x++)
    numbers[x] = inside_part (0, int (x), y);
  for (int i = 1; i < elements_.parts (); i++)
    find_border (i, y, numbers);
}

/* The windows that overlap region @part. */
void
Surroundings::find_border (int part, int y, std::span<int> numbers)
{
  const Rect &rect = elements_.rect (part);
  if (y < rect.y - reach_ || y >= rect.bottom () + reach_)
    return;
  const Rect inner{rect.x + reach_, rect.y + reach_, rect.width - 2 * reach_,
      rect.height - 2 * reach_};
  const int first = std::max (0, rect.x - reach_);
  const int end = std::min (int (numbers.size ()), rect.right () + reach_);
  for (int x = first; x < end; x++) {
    int &number = numbers[std::size_t (x)];
    if (inner.holds (x, y)) {
      number = inside_part (part, x, y);
      continue;
    }
    std::vector<int> window;
    for (int j = -reach_; j <= reach_; j++)
      for (int i = -reach_; i <= reach_; i++)
        window.push_back (elements_.at (x + i, y + j));
    number = number_of (std::move (window));
  }
}

FilterBank::FilterBank (
    const PixelView &view, const Elements &elements, const SceneClass &scene)
    : elements_ (elements), solver_ (view),
      surroundings_ (elements, solver_.reach ()),
      covariance_ (
          scene, elements.shares (), elements.slots (), 2 * solver_.reach ()),
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
}

Neighbourhood
FilterBank::neighbourhood (int around) const
{
  return {elements_, covariance_, surroundings_.window (around)};
}

/* If elements differ in brightness, even flat light makes a window rough, and
 * its noise cannot be derived from the roughness. */
std::vector<float>
FilterBank::solve (const Neighbourhood &mirrors, double fx, double fy) const
{
  static constexpr std::array<double, kNoises.size ()> kUneven = {
      kNoises[1], kNoises[1], kNoises[1], kNoises[1]};
  return solver_.solve (mirrors, fx, fy, mirrors.even () ? kNoises : kUneven);
}

const std::vector<float> &
FilterBank::node (int around, int i, int j)
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

std::vector<float>
FilterBank::interpolated (int around, double fx, double fy)
{
  const Interpolation x (fx, steps_), y (fy, steps_);
  std::vector<float> sum;
  for (std::size_t j = 0; j < y.parts.size (); j++)
    for (std::size_t i = 0; i < x.parts.size (); i++) {
      const float part = x.parts[i] * y.parts[j];
      const auto &solved = node (around, x.first + int (i), y.first + int (j));
      sum.resize (solved.size ());
      for (std::size_t k = 0; k < solved.size (); k++)
        sum[k] += part * solved[k];
    }
  return sum;
}

std::int32_t &
FilterBank::known_filter (int around, int px, int py)
{
  if (around < surroundings_.repeating ())
    return filters_[std::size_t ((around * parts_ + py) * parts_ + px)];
  return other_filters_.try_emplace ({around, px, py}, kUnknown).first->second;
}

std::int32_t
FilterBank::filter (int around, double fx, double fy)
{
  const auto part_of = [this] (double f) {
    return std::clamp (int ((f + 0.5) * parts_), 0, parts_ - 1);
  };
  const auto middle_of = [this] (
                             int part) { return (part + 0.5) / parts_ - 0.5; };
  const int px = part_of (fx), py = part_of (fy);
  std::int32_t &known = known_filter (around, px, py);
  if (known == kUnknown) {
    known = std::int32_t (scales_.size ());
    const double x = middle_of (px), y = middle_of (py);
    append (around, around < surroundings_.repeating ()
                        ? interpolated (around, x, y)
                        : solve (neighbourhood (around), x, y));
  }
  return known;
}

/* @solved: from WeightSolver::solve (). */
void
FilterBank::append (int around, const std::vector<float> &solved)
{
  const int taps = solver_.taps (), length = row_length (taps);
  const float *from = solved.data ();
  for (std::size_t row = 0; row < kNoises.size () * std::size_t (taps); row++) {
    weights_.insert (weights_.end (), from, from + taps);
    weights_.resize (weights_.size () + std::size_t (length - taps));
    from += taps;
  }
  const auto &window = surroundings_.window (around);
  const double light = elements_.light (window[window.size () / 2]);
  scales_.push_back ({1.0f / std::max (solved.back (), kMinRoughness),
      float (elements_.most_light () / light)});
}

} // namespace codedexposure
