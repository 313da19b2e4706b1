/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The line below a set of points, some of which lie close to it. */
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace codedexposure
{

/**
 * Estimates a straight line from points at independent distances above it, of
 * which the smallest are as likely as slightly larger ones: for example uniform
 * or exponential distances.
 *
 * Only lines below all points are possible, and a line is the likelier the
 * higher it is: exp (density x area below it), with the density of the points
 * just above the line. The mean of all possible lines with these weights is the
 * unbiased estimate of min mean square error (Pitman's, for the Poisson process
 * that the lowest points approach); their spread is its uncertainty. All of it
 * depends on the lower convex hull only, except for the density, which comes
 * from the points next to the line.
 *
 * Error and uncertainty fall with the number of points, not with the root of
 * it: n points, spread evenly and up to J above the line, leave 3.1 J / n (rms)
 * at its end. If the smallest distances are rarer than larger ones, the line is
 * too high and the uncertainty too small.
 */
class LowerEdge
{
public:
  struct Point {
    double x;
    double y;
  };
  struct Line {
    double slope = 0;
    double height = 0; ///< at x = 0
    double at (double x) const { return height + slope * x; }
  };
  struct Estimate {
    Line line;
    /** Standard deviation of its height at the last point; none for fewer than
     * kMinPoints points. */
    std::optional<double> deviation;
  };

  static constexpr std::size_t kMinPoints = 8;

  /** @p steepest  max slope of the line, up or down. */
  explicit LowerEdge (double steepest) : steepest_ (steepest) {}

  /** Forgets all points. */
  void clear ();
  /** Expects a slope within @p by of @p slope, unless the points clearly
   * contradict it. */
  void expect (double slope, double by);
  void expect_any ();
  /** @p point  to the right of all others. */
  void add (Point point);
  /** Replaces the last point by a lower one that is not further to the left. */
  void lower_last (Point point);
  /** Forgets the first @p count points. */
  void forget (std::size_t count);

  const std::vector<Point> &points () const { return points_; }
  /** Needs at least one point. */
  Estimate estimate () const;

private:
  void add_to_hull (Point point);
  double middle () const
  {
    return (points_.front ().x + points_.back ().x) / 2;
  }
  struct Range {
    double from;
    double to;
  };
  double height_below (double slope) const;
  double highest_slope (Range range) const;
  Range slopes () const;
  std::optional<double> density (const Line &highest) const;
  double last_slope (double from, double to, double min_height) const;

  double steepest_;
  std::optional<Range> expected_;
  std::vector<Point> points_;
  std::vector<Point> hull_;
  mutable std::vector<double> above_; // scratch of density ()
};

} // namespace codedexposure
