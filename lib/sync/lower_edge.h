/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The line that points lie above, some of them closely. */
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace codedexposure
{

/**
 * Estimates a straight line from points that lie above it by amounts that are
 * independent of each other, and of which the smallest are as likely as those a
 * little larger: uniform or exponential ones, say.
 *
 * Only lines below all points are possible, and of these one is the likelier
 * the higher it is: exp (density x area below it), with the density of the
 * points right above the line. The mean of all possible lines, so weighed, is
 * the estimate of the least mean square error that there is (Pitman's, for the
 * Poisson process which the lowest points tend to), without a bias; their
 * spread is its uncertainty. All depends on the lower convex hull alone, but
 * for the density, which the points next to the line tell.
 *
 * Error and uncertainty fall with the number of points, not with its root: n
 * points, spread evenly and up to J above the line, leave 3.1 J / n (rms) at
 * its end. Where the smallest amounts are rarer than larger ones, the line
 * comes out too high, and the uncertainty too small.
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
    /** Standard deviation of its height at the last point; none from fewer than
     * kFewest points. */
    std::optional<double> deviation;
  };

  static constexpr std::size_t kFewest = 8;

  /** @p steepest  slope, up or down, that the line can have. */
  explicit LowerEdge (double steepest) : steepest_ (steepest) {}

  /** Forgets all points. */
  void clear ();
  /** Slopes are by no more than @p by away from @p slope, unless the points
   * speak clearly against it. */
  void expect (double slope, double by);
  void expect_any ();
  /** @p point  to the right of all others. */
  void add (Point point);
  /** Puts @p point, lower and not further to the left, in the last one's place.
   */
  void lower_last (Point point);
  /** Forgets the first @p count points. */
  void forget (std::size_t count);

  const std::vector<Point> &points () const { return points_; }
  /** There has to be a point. */
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
  double last_slope (double from, double to, double least_height) const;

  double steepest_;
  std::optional<Range> expected_;
  std::vector<Point> points_;
  std::vector<Point> hull_;
  mutable std::vector<double> above_; // scratch of density ()
};

} // namespace codedexposure
