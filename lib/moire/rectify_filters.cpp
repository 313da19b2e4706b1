/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "moire/rectify_filters.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace cexp
{

namespace
{

/* Parts into which a pixel is divided for filters, as many as the bound on
 * their number allows, and steps for those that are solved. */
constexpr int kMaxFilters = 1 << 15;
constexpr int kMaxParts = 32;
constexpr int kMinParts = 4;
constexpr int kSteps = 8;
constexpr int kFewSteps = 4;
constexpr int kManySurroundings = 16;

constexpr std::int32_t kUnknown = -1;

/* A window is taken to look this rough at least. */
constexpr float kLeastRough = 0.01f;

/* Fraction of a pixel, -0.5 to 0.5. */
double
node_at (int node, int steps)
{
  return double (node) / steps - 0.5;
}

/* The nodes of a half of a pixel, and by how much each counts at a fraction:
 * Lagrange's polynomial through them. */
struct Between {
  int first;
  std::vector<float> parts;

  Between (double at, int steps) : first (at < 0.0 ? 0 : steps / 2)
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

Surroundings::Surroundings (const Schedule &schedule, int reach)
    : period_ (schedule.tile ().period_x ()),
      rows_ (schedule.tile ().period_y ())
{
  std::map<std::vector<int>, int> known;
  for (int y = 0; y < rows_; y++)
    for (int x = 0; x < period_; x++) {
      std::vector<int> elements;
      for (int j = -reach; j <= reach; j++)
        for (int i = -reach; i <= reach; i++)
          elements.push_back (schedule.element_at (x + i, y + j));
      const auto [at, made] = known.try_emplace (elements, count ());
      if (made)
        first_.push_back ({x, y});
      number_.push_back (at->second);
    }
}

FilterBank::FilterBank (const PixelView &view, const Schedule &schedule,
    const Matrix &elements, double correlation_length)
    : schedule_ (schedule), elements_ (elements), solver_ (view),
      surroundings_ (schedule, solver_.reach ()),
      space_ (solver_.reach (), correlation_length), parts_ (kMaxParts),
      steps_ (surroundings_.count () > kManySurroundings ? kFewSteps : kSteps)
{
  const int count = surroundings_.count ();
  while (parts_ > kMinParts && count * parts_ * parts_ > kMaxFilters)
    parts_ /= 2;
  filters_.assign (
      std::size_t (count) * std::size_t (parts_ * parts_), kUnknown);
  nodes_.resize (
      std::size_t (count) * std::size_t ((steps_ + 1) * (steps_ + 1)));
}

const Neighbourhood &
FilterBank::neighbourhood (int around)
{
  const Offset first = surroundings_.first (around);
  return neighbourhoods_
      .try_emplace (around, schedule_, elements_, first.x, first.y,
          solver_.reach (), space_)
      .first->second;
}

const std::vector<float> &
FilterBank::node (int around, int i, int j)
{
  std::vector<float> &weights =
      nodes_[std::size_t ((around * (steps_ + 1) + j) * (steps_ + 1) + i)];
  if (weights.empty ())
    weights = solver_.solve (neighbourhood (around), node_at (i, steps_),
        node_at (j, steps_), kNoises);
  return weights;
}

std::int32_t
FilterBank::filter (int around, double fx, double fy)
{
  const auto part_of = [this] (double f) {
    return std::clamp (int ((f + 0.5) * parts_), 0, parts_ - 1);
  };
  const int px = part_of (fx), py = part_of (fy);
  std::int32_t &known =
      filters_[std::size_t ((around * parts_ + py) * parts_ + px)];
  if (known == kUnknown) {
    const int size = solver_.taps () * row_length (solver_.taps ());
    known = std::int32_t (
        weights_.size () / (kNoises.size () * std::size_t (size)));
    append (around, px, py);
  }
  return known;
}

/* For the middle of a part. */
void
FilterBank::append (int around, int px, int py)
{
  const Between x ((px + 0.5) / parts_ - 0.5, steps_);
  const Between y ((py + 0.5) / parts_ - 0.5, steps_);
  const int taps = solver_.taps (), length = row_length (taps);
  const int rows = int (kNoises.size ()) * taps;
  const std::size_t first = weights_.size ();
  weights_.resize (first + std::size_t (rows * length));
  float rough = 0.0f;
  for (std::size_t j = 0; j < y.parts.size (); j++)
    for (std::size_t i = 0; i < x.parts.size (); i++) {
      const float part = x.parts[i] * y.parts[j];
      const auto &solved = node (around, x.first + int (i), y.first + int (j));
      const float *from = solved.data ();
      float *to = weights_.data () + first;
      for (int row = 0; row < rows; row++, from += taps, to += length)
        for (int k = 0; k < taps; k++)
          to[k] += part * from[k];
      rough += part * solved.back ();
    }
  smoothness_.push_back (1.0f / std::max (rough, kLeastRough));
}

} // namespace cexp
