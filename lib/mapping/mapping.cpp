/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "mapping/mapping.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include <Eigen/LU>

#include "base/text.h"
#include "base/try.h"

namespace codedexposure
{

namespace
{

using Square = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Eigen::Map<const Square>
matrix_of (const Homography &h)
{
  return Eigen::Map<const Square> (h.data ());
}

Homography
inverse_of (const Homography &h)
{
  Homography inverse;
  Eigen::Map<Square> (inverse.data ()) = matrix_of (h).inverse ();
  return inverse;
}

/* d mirror / d camera of the homography alone. */
std::array<double, 4>
slope_of (const Homography &h, double x, double y)
{
  const Projected p = project (h, x, y);
  return {(h[0] - p.x * h[6]) / p.z, (h[1] - p.x * h[7]) / p.z,
      (h[3] - p.y * h[6]) / p.z, (h[4] - p.y * h[7]) / p.z};
}

Error
bad_number (const std::string &what, double value, const std::string &rule)
{
  return Error{what + " is " + real_text (value) + "; " + rule};
}

Result<void>
check_size (const char *what, Extent size)
{
  if (std::min (size.width, size.height) >= 1 &&
      std::max (size.width, size.height) <= Mapping::kMaxSize)
    return {};
  return Error{std::string ("a mapping's ") + what + " of " + size_text (size) +
               " must be from 1x1 to " +
               size_text ({Mapping::kMaxSize, Mapping::kMaxSize})};
}

Result<void>
check_finite (const std::string &what, std::span<const double> numbers,
    double largest = std::numeric_limits<double>::max ())
{
  for (std::size_t i = 0; i < numbers.size (); i++)
    if (!(std::abs (numbers[i]) <= largest))
      return bad_number (what + "[" + std::to_string (i) + "]", numbers[i],
          std::isfinite (numbers[i])
              ? "it must be within -" + real_text (largest) + " and " +
                    real_text (largest)
              : "it must be finite");
  return {};
}

/* Scales @h so that Z is 1 at the centre of the frame. */
Result<void>
normalise (Homography &h, Extent camera)
{
  RETURN_IF_ERROR (check_finite ("homography", h));
  const CentredFrame frame (camera);
  const double z = h[6] * frame.cx + h[7] * frame.cy + h[8];
  /* What is right to the last digits stays as it is written. */
  if (std::abs (z - 1.0) > 1e-12)
    for (double &number : h)
      number /= z;
  if (z == 0.0 || !check_finite ("homography", h).ok ())
    return bad_number ("the homography's Z at the centre of the frame", z,
        "the horizon must lie outside of the frame");
  RETURN_IF_ERROR (
      check_finite ("with Z = 1 at the centre of the frame, homography", h,
          Mapping::kMaxNumber));
  for (const double x : {0.0, 2.0 * frame.cx})
    for (const double y : {0.0, 2.0 * frame.cy})
      if (const double corner = h[6] * x + h[7] * y + h[8]; !(corner > 1e-3))
        return bad_number ("the homography's Z in a corner of the frame, of "
                           "that at the centre,",
            corner, "the horizon must lie outside of the frame");
  const double determinant = matrix_of (h).determinant ();
  if (!(std::abs (determinant) > 1e-9))
    return bad_number ("the determinant of the homography", determinant,
        "it must have an inverse");
  return {};
}

Result<void>
check_displacement (const Displacement &grid)
{
  for (const auto &[what, count] :
      {std::pair ("columns", grid.columns), std::pair ("rows", grid.rows)})
    if (count < 2 || count > Mapping::kMaxNodes)
      return bad_number (std::string ("displacement.") + what, count,
          "it must be 2 to " + std::to_string (Mapping::kMaxNodes));
  const std::size_t nodes =
      std::size_t (grid.columns) * std::size_t (grid.rows);
  for (const auto &[what, numbers] : {std::pair ("displacement.x", &grid.x),
           std::pair ("displacement.y", &grid.y)}) {
    if (numbers->size () != nodes)
      return bad_number (std::string ("the count of ") + what,
          double (numbers->size ()),
          "it must be columns x rows = " + std::to_string (nodes));
    RETURN_IF_ERROR (check_finite (what, *numbers, Mapping::kMaxNumber));
  }
  return {};
}

Result<void>
check_covariance (const Mapping::Covariance &covariance)
{
  constexpr std::size_t n = Mapping::kParameters;
  RETURN_IF_ERROR (check_finite ("covariance", covariance));
  for (std::size_t i = 0; i < n; i++) {
    if (covariance[i * n + i] < 0.0)
      return bad_number ("variance " + std::to_string (i) + " of the mapping",
          covariance[i * n + i], "no variance is negative");
    for (std::size_t j = 0; j < i; j++)
      if (covariance[i * n + j] != covariance[j * n + i])
        return Error{"the covariance of a mapping must be symmetric; rows " +
                     std::to_string (j) + " and " + std::to_string (i) +
                     " are not"};
  }
  return {};
}

Homography
uncentred (const Homography &c, Extent camera)
{
  const CentredFrame f (camera);
  Homography h;
  for (std::size_t row = 0; row < 9; row += 3) {
    h[row] = c[row] / f.r;
    h[row + 1] = c[row + 1] / f.r;
    h[row + 2] = c[row + 2] - h[row] * f.cx - h[row + 1] * f.cy;
  }
  return h;
}

Pose
pose_of (const std::array<double, 4> &slope)
{
  Pose s;
  auto [xx, xy, yx, yy] = slope;
  s.flipped = xx * yy - xy * yx < 0.0;
  if (s.flipped) {
    xx = -xx;
    yx = -yx;
  }
  s.rotation = std::atan2 (yx - xy, xx + yy) * 180.0 / std::numbers::pi;
  s.magnification = 1.0 / std::sqrt (std::abs (xx * yy - xy * yx));
  /* Singular values: half of |similarity part| +- |the rest|. */
  const double alike = std::hypot (xx + yy, yx - xy);
  const double other = std::hypot (xx - yy, yx + xy);
  s.stretch = 2.0 * other / (alike - other);
  return s;
}

/* Standard deviation of @value (parameters) that @covariance makes. */
double
propagate (const Mapping::Covariance &covariance, const Homography &at,
    const std::function<double (const Homography &)> &value)
{
  constexpr int n = Mapping::kParameters;
  constexpr double step = 1e-4;
  Eigen::Vector<double, n> gradient;
  for (int i = 0; i < n; i++) {
    Homography up = at, down = at;
    up[std::size_t (i)] += step;
    down[std::size_t (i)] -= step;
    gradient[i] = (value (up) - value (down)) / (2.0 * step);
  }
  const Eigen::Map<const Eigen::Matrix<double, n, n>> matrix (
      covariance.data ());
  return std::sqrt (std::max (0.0, gradient.dot (matrix * gradient)));
}

} // namespace

Mapping::Mapping (Extent both) : parts_{both, both} {}

Result<Mapping>
Mapping::make (Parts parts)
try {
  for (const auto &[what, size] : {std::pair ("camera", parts.camera),
           std::pair ("mirrors", parts.mirrors)})
    RETURN_IF_ERROR (check_size (what, size));
  RETURN_IF_ERROR (normalise (parts.homography, parts.camera));
  if (!(parts.psf_sigma >= 0.0 && parts.psf_sigma <= kMaxPsfSigma))
    return bad_number ("psf_sigma", parts.psf_sigma,
        "it must be 0 to " + real_text (kMaxPsfSigma) + " pixels");
  if (parts.covariance)
    RETURN_IF_ERROR (check_covariance (*parts.covariance));
  if (parts.displacement)
    RETURN_IF_ERROR (check_displacement (*parts.displacement));
  return Mapping (std::move (parts));
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

Result<Mapping>
Mapping::from_centred (Extent camera, Extent mirrors, const Homography &centred)
try {
  return make ({camera, mirrors, uncentred (centred, camera)});
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

Position
Mapping::displaced (double x, double y) const
{
  const Displacement &d = *parts_.displacement;
  struct Node {
    int low;
    double part;
    Node (double at, int last, int nodes)
    {
      // Nowhere, as the horizon of the mirrors is seen, counts as 0.
      const double part_of_frame =
          std::min (std::max (0.0, at / std::max (1, last)), 1.0);
      const double node = part_of_frame * (nodes - 1);
      low = std::min (int (node), nodes - 2);
      part = node - low;
    }
  };
  const Node i (x, parts_.camera.width - 1, d.columns);
  const Node j (y, parts_.camera.height - 1, d.rows);
  const std::size_t at = std::size_t (j.low * d.columns + i.low);
  const auto blend = [&] (const std::vector<double> &v) {
    const std::size_t below = at + std::size_t (d.columns);
    const double top = v[at] + i.part * (v[at + 1] - v[at]);
    const double bottom = v[below] + i.part * (v[below + 1] - v[below]);
    return top + j.part * (bottom - top);
  };
  return {blend (d.x), blend (d.y)};
}

Position
Mapping::mirror_at (double x, double y) const
{
  const Projected p = project (parts_.homography, x, y);
  if (!parts_.displacement)
    return {p.x, p.y};
  const Position d = displaced (x, y);
  return {p.x + d.x, p.y + d.y};
}

Position
Mapping::camera_at (Position mirror) const
{
  const Homography back = inverse_of (parts_.homography);
  Position wanted = mirror;
  Projected p = project (back, wanted.x, wanted.y);
  /* The displacement changes little from pixel to pixel: a few rounds do. */
  for (int i = 0; parts_.displacement && i < 50; i++) {
    const Position d = displaced (p.x, p.y);
    wanted = {mirror.x - d.x, mirror.y - d.y};
    const Projected next = project (back, wanted.x, wanted.y);
    const double change = std::hypot (next.x - p.x, next.y - p.y);
    p = next;
    if (change < 1e-11)
      break;
  }
  return {p.x, p.y};
}

void
Mapping::camera_row (int y, std::span<Position> seen) const
{
  const Homography back = inverse_of (parts_.homography);
  double x = 0.0;
  if (!parts_.displacement) {
    for (Position &at : seen) {
      const Projected p = project (back, x++, y);
      at = {p.x, p.y};
    }
    return;
  }
  /* A mirror's displacement is nearly that of the one before. */
  const Position first = camera_at ({0.0, double (y)});
  Position d = displaced (first.x, first.y);
  for (Position &at : seen) {
    Projected p = project (back, x - d.x, y - d.y);
    for (int round = 0; round < 2; round++) {
      d = displaced (p.x, p.y);
      p = project (back, x - d.x, y - d.y);
    }
    at = {p.x, p.y};
    x++;
  }
}

std::array<double, 4>
Mapping::slope_at (double x, double y) const
{
  std::array<double, 4> slope = slope_of (parts_.homography, x, y);
  if (parts_.displacement) {
    const Position left = displaced (x - 0.5, y),
                   right = displaced (x + 0.5, y);
    const Position up = displaced (x, y - 0.5), down = displaced (x, y + 0.5);
    slope[0] += right.x - left.x;
    slope[1] += down.x - up.x;
    slope[2] += right.y - left.y;
    slope[3] += down.y - up.y;
  }
  return slope;
}

bool
Mapping::covers (Position mirror) const
{
  return mirror.x >= -0.5 && mirror.x < parts_.mirrors.width - 0.5 &&
         mirror.y >= -0.5 && mirror.y < parts_.mirrors.height - 0.5;
}

bool
Mapping::in_frame (Position place) const
{
  return place.x > -0.5 && place.x < parts_.camera.width - 0.5 &&
         place.y > -0.5 && place.y < parts_.camera.height - 0.5;
}

Homography
Mapping::centred () const
{
  const Homography &h = parts_.homography;
  const CentredFrame f (parts_.camera);
  Homography c;
  for (std::size_t row = 0; row < 9; row += 3) {
    c[row] = h[row] * f.r;
    c[row + 1] = h[row + 1] * f.r;
    c[row + 2] = h[row] * f.cx + h[row + 1] * f.cy + h[row + 2];
  }
  return c;
}

Pose
Mapping::pose () const
{
  const CentredFrame camera (parts_.camera), mirrors (parts_.mirrors);
  Pose s = pose_of (slope_of (parts_.homography, camera.cx, camera.cy));
  const Position centre = mirror_at (camera.cx, camera.cy);
  s.shift_x = centre.x - mirrors.cx;
  s.shift_y = centre.y - mirrors.cy;
  return s;
}

Pose
Mapping::pose_sigma () const
{
  Pose sigma;
  sigma.magnification = 0.0;
  if (!parts_.covariance)
    return sigma;
  const auto of = [this] (auto what) {
    return propagate (
        *parts_.covariance, centred (), [&] (const Homography &c) {
          const CentredFrame f (parts_.camera);
          const Homography h = uncentred (c, parts_.camera);
          return what (pose_of (slope_of (h, f.cx, f.cy)));
        });
  };
  sigma.shift_x = std::sqrt ((*parts_.covariance)[2 * kParameters + 2]);
  sigma.shift_y = std::sqrt ((*parts_.covariance)[5 * kParameters + 5]);
  /* 180 degrees are -180 degrees. */
  sigma.rotation = of ([about = pose ().rotation] (const Pose &s) {
    return std::remainder (s.rotation - about, 360.0);
  });
  sigma.magnification = of ([] (const Pose &s) { return s.magnification; });
  sigma.stretch = of ([] (const Pose &s) { return s.stretch; });
  return sigma;
}

bool
Mapping::one_to_one (double tolerance) const
{
  for (int y = 0; y < parts_.camera.height; y++)
    for (int x = 0; x < parts_.camera.width; x++) {
      const Position m = mirror_at (x, y);
      if (std::abs (m.x - std::round (m.x)) > tolerance ||
          std::abs (m.y - std::round (m.y)) > tolerance)
        return false;
    }
  /* Whole mirrors, and not every second one, nor two pixels to one. */
  const Pose s = pose ();
  return std::abs (s.magnification - 1.0) < 0.25;
}

} // namespace codedexposure
