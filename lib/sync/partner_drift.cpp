/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "sync/partner_drift.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "base/statistics.h"
#include "estimate/least_squares.h"

namespace codedexposure
{

namespace
{

constexpr float kNone = std::numeric_limits<float>::quiet_NaN ();
/* Parts of the frame along each axis, and mirrors of a part. */
constexpr int kParts = 3, kMostMirrors = 96;
/* Of a part; that of others says too little. */
constexpr double kMaxUncertainty = 0.05;
constexpr double kMinPlaces = 256.0;

/* The smallest window that holds each label of @tile equally often. */
Extent
window_of (const Tile &tile)
{
  std::vector<int> count (std::size_t (tile.elements ()), 0);
  for (int x = 0; x < tile.period_x (); x++)
    count[std::size_t (tile.label (x, 0))]++;
  const bool row_has_all =
      std::ranges::all_of (count, [&] (int n) { return n == count[0]; });
  return {tile.period_x (), row_has_all ? 1 : tile.period_y ()};
}

/* Of a window of @size around its middle; the ends of an even one count half.
 */
std::vector<float>
weights_of (int size)
{
  std::vector<float> weights (std::size_t (size / 2 * 2 + 1), 1.0f);
  if (size % 2 == 0)
    weights.front () = weights.back () = 0.5f;
  return weights;
}

} // namespace

PartnerDrift::PartnerDrift (
    const Schedule &schedule, const BeamCamera &on, const BeamCamera &off)
    : period_ (window_of (schedule.tile ())), white_on_ (on.white),
      white_off_ (off.white)
{
  const auto [width, height] = on.mirrors ();
  const int rows = height - schedule.pilot_rows ();
  part_ = {std::min (kMostMirrors, width / kParts),
      std::min (kMostMirrors, rows / kParts)};
  for (int i = 0; i < kParts * kParts; i++) {
    const int left =
        (2 * (i % kParts) + 1) * width / (2 * kParts) - part_.width / 2;
    const int top =
        (2 * (i / kParts) + 1) * rows / (2 * kParts) - part_.height / 2;
    Part part{{left + part_.width / 2.0, top + part_.height / 2.0}, {}, {}};
    bool is_seen = true;
    for (int y = top; y < top + part_.height; y++)
      for (int x = left; x < left + part_.width; x++) {
        part.on.push_back (on.place (x, y));
        part.off.push_back (off.place (x, y));
        is_seen = is_seen && on.contains (part.on.back ()) &&
                  off.contains (part.off.back ());
      }
    if (is_seen)
      parts_.push_back (std::move (part));
  }
}

/* Sums over a period around each mirror of a part; not a number where some of
 * it is saturated. */
Image<float>
PartnerDrift::picture (const GreyView &frame,
    const std::vector<Position> &places, double white) const
{
  const auto row = weights_of (period_.width);
  const auto column = weights_of (period_.height);
  const int wide = int (row.size ()) - 1, high = int (column.size ()) - 1;
  std::vector<float> levels;
  levels.reserve (places.size ());
  each_level (frame, places, [&] (double level) {
    levels.push_back (level < white ? float (level) : kNone);
  });
  const auto width = std::size_t (part_.width);
  const Extent inner{part_.width - wide, part_.height - high};
  if (inner.width < 1 || inner.height < 1)
    return {};
  Image<float> rows (inner.width, part_.height);
  each_pixel (rows, [&] (int x, int y) {
    float sum = 0.0f;
    for (std::size_t i = 0; i < row.size (); i++)
      sum += row[i] * levels[std::size_t (y) * width + std::size_t (x) + i];
    rows.at (x, y) = sum;
  });
  Image<float> sums (inner.width, inner.height);
  each_pixel (sums, [&] (int x, int y) {
    float sum = 0.0f;
    for (std::size_t j = 0; j < column.size (); j++)
      sum += column[j] * rows.at (x, y + int (j));
    sums.at (x, y) = sum;
  });
  return sums;
}

/* The picture of the second camera is that of the first, less its gradient
 * times the shift, times a factor, on another level. */
std::optional<PartnerDrift::Shift>
PartnerDrift::shift (
    const Image<float> &on, const Image<float> &off, Position middle) const
{
  enum { kOne, kFactor, kAlongX, kAlongY, kUnknowns };
  using Row = Eigen::Matrix<double, kUnknowns + 1, 1>;
  Eigen::Matrix<double, kUnknowns + 1, kUnknowns + 1> sums;
  sums.setZero ();
  for (int y = 1; y < on.height () - 1; y++)
    for (int x = 1; x < on.width () - 1; x++) {
      Row row;
      row << 1.0, on.at (x, y), (on.at (x + 1, y) - on.at (x - 1, y)) / 2.0,
          (on.at (x, y + 1) - on.at (x, y - 1)) / 2.0, off.at (x, y);
      if (row.allFinite ())
        sums += row * row.transpose ();
    }
  const double places = sums (kOne, kOne);
  if (places < kMinPlaces)
    return {};
  const Eigen::MatrixXd normal = sums.topLeftCorner<kUnknowns, kUnknowns> ();
  const Eigen::VectorXd seen = sums.col (kUnknowns).head<kUnknowns> ();
  const Eigen::VectorXd found = solve_normal (normal, seen);
  const Eigen::MatrixXd inverse = inverse_of (normal);
  const double rest = sums (kUnknowns, kUnknowns) - seen.dot (found);
  /* Neighbouring sums have pixels in common. */
  const double independent = places / (double (period_.width) * period_.height);
  const double uncertainty = std::sqrt (std::max (0.0, rest) / independent *
                                        std::max (inverse (kAlongX, kAlongX),
                                            inverse (kAlongY, kAlongY))) /
                             found[kFactor];
  if (!(found[kFactor] > 0.0 && uncertainty < kMaxUncertainty))
    return {};
  return Shift{
      {-found[kAlongX] / found[kFactor], -found[kAlongY] / found[kFactor]},
      uncertainty, middle};
}

std::optional<PartnerDrift::Shift>
PartnerDrift::largest (const GreyView &on, const GreyView &off) const
{
  std::optional<Shift> largest;
  const auto length = [] (const Shift &shift) {
    return std::hypot (shift.by.x, shift.by.y);
  };
  for (const Part &part : parts_) {
    const auto found = shift (picture (on, part.on, white_on_),
        picture (off, part.off, white_off_), part.middle);
    if (found && (!largest || length (*found) > length (*largest)))
      largest = found;
  }
  return largest;
}

} // namespace codedexposure
