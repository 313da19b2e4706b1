/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "sync/lower_edge.h"

#include <algorithm>
#include <cmath>

namespace codedexposure
{

namespace
{

/* Number of slopes to average over. */
constexpr int kSlopes = 64;
/* Log likelihood below the maximum from which lines are ignored. */
constexpr double kNegligible = 20;
/* Log likelihood below the maximum at which an expected slope is dropped. */
constexpr double kIncredible = 10;
/* Smallest distance between points that counts. */
constexpr double kGrain = 1;

} // namespace

void
LowerEdge::clear ()
{
  points_.clear ();
  hull_.clear ();
}

void
LowerEdge::expect (double slope, double by)
{
  expected_ = Range{
      std::max (slope - by, -steepest_), std::min (slope + by, steepest_)};
}

void
LowerEdge::expect_any ()
{
  expected_.reset ();
}

void
LowerEdge::add_to_hull (Point point)
{
  const auto is_above = [&] (const Point &a, const Point &b) {
    return (b.y - a.y) * (point.x - a.x) >= (point.y - a.y) * (b.x - a.x);
  };
  while (
      hull_.size () > 1 && is_above (hull_[hull_.size () - 2], hull_.back ()))
    hull_.pop_back ();
  hull_.push_back (point);
}

void
LowerEdge::add (Point point)
{
  points_.push_back (point);
  add_to_hull (point);
}

void
LowerEdge::lower_last (Point point)
{
  points_.back () = point;
  add_to_hull (point);
}

void
LowerEdge::forget (std::size_t count)
{
  points_.erase (points_.begin (), points_.begin () + std::ptrdiff_t (count));
  hull_.clear ();
  for (const Point &point : points_)
    add_to_hull (point);
}

/* Height, in the middle of the points, of the highest line of that slope below
 * all of them: it touches the hull where edges become steeper. */
double
LowerEdge::height_below (double slope) const
{
  const auto touched = std::partition_point (
      hull_.begin (), hull_.end () - 1, [slope] (const Point &point) {
        const Point &next = *(&point + 1);
        return next.y - point.y < slope * (next.x - point.x);
      });
  return touched->y + slope * (middle () - touched->x);
}

/* Slope of the line that is highest in the middle: an edge of the hull. */
double
LowerEdge::highest_slope (Range range) const
{
  if (hull_.size () < 2)
    return (range.from + range.to) / 2;
  const auto right = std::upper_bound (hull_.begin () + 1, hull_.end () - 1,
      middle (), [] (double x, const Point &p) { return x < p.x; });
  const auto left = right - 1;
  return std::clamp (
      (right->y - left->y) / (right->x - left->x), range.from, range.to);
}

/* Possible slopes of lines. */
LowerEdge::Range
LowerEdge::slopes () const
{
  const Range all{-steepest_, steepest_};
  if (!expected_)
    return all;
  const double any = highest_slope (all);
  const double highest = height_below (any);
  const auto density = this->density ({any, highest - any * middle ()});
  const double loss = highest - height_below (highest_slope (*expected_));
  return density && *density * loss > kIncredible ? all : *expected_;
}

/* Points just above the line, per unit of height. Only the lowest sixteenth
 * counts, or more if that is few: further up, any density is possible. Two are
 * subtracted for the line itself, which touches them. */
std::optional<double>
LowerEdge::density (const Line &highest) const
{
  constexpr std::ptrdiff_t kTouching = 2;
  constexpr std::ptrdiff_t kEnough = 16;
  if (points_.size () < kMinPoints)
    return std::nullopt;
  above_.clear ();
  for (const Point &point : points_)
    above_.push_back (point.y - highest.at (point.x));
  const auto all = std::ptrdiff_t (points_.size ());
  const std::ptrdiff_t counted =
      std::max ({kTouching + 1, std::min (kEnough, all / 4), all / 16});
  const auto last = above_.begin () + counted;
  std::nth_element (above_.begin (), last, above_.end ());
  return double (counted + 1 - kTouching) / std::max (*last, kGrain);
}

/* The last slope from @p from towards @p to whose line is as high. */
double
LowerEdge::last_slope (double from, double to, double min_height) const
{
  constexpr int kHalvings = 40;
  if (height_below (to) >= min_height)
    return to;
  for (int k = 0; k < kHalvings; k++) {
    const double half = (from + to) / 2;
    (height_below (half) >= min_height ? from : to) = half;
  }
  return from;
}

LowerEdge::Estimate
LowerEdge::estimate () const
{
  const Range range = slopes ();
  const double best = highest_slope (range);
  const double highest = height_below (best);
  const Line top{best, highest - best * middle ()};
  const auto density = this->density (top);
  if (!density)
    return {top, {}};

  const double lowest = highest - kNegligible / *density;
  const double first = last_slope (best, range.from, lowest);
  const double step = (last_slope (best, range.to, lowest) - first) / kSlopes;
  const double arm = points_.back ().x - middle ();
  double weights = 0, slopes = 0, heights = 0, ends = 0, squares = 0;
  for (int k = 0; k < kSlopes; k++) {
    const double slope = first + (k + 0.5) * step;
    const double height = height_below (slope);
    const double weight = std::exp (*density * (height - highest));
    /* Relative to the top line, to keep precision. */
    const double end = height - highest + (slope - best) * arm;
    weights += weight;
    slopes += weight * slope;
    heights += weight * (height - highest);
    ends += weight * end;
    squares += weight * end * end;
  }
  const double mean_slope = slopes / weights;
  const double below = 1 / *density; // of all heights of one slope
  const double mean_height = highest + heights / weights - below;
  const double mean_end = ends / weights;
  const double spread = squares / weights - mean_end * mean_end;
  return {{mean_slope, mean_height - mean_slope * middle ()},
      std::sqrt (std::max (0.0, spread) + below * below)};
}

} // namespace codedexposure
