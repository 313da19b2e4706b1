/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/view.h"

#include <cmath>
#include <numbers>

#include "base/statistics.h"
#include "base/try.h"
#include "estimate/least_squares.h"

namespace codedexposure
{

namespace
{

constexpr int kFrames = 3;
constexpr double kFewPixels = 500;

/* A number in 0..1 for each row, spread evenly over those of any region. */
double
threshold (int y)
{
  const double turns = y * std::numbers::phi;
  return turns - std::floor (turns);
}

/* Mirrors of a row are on from its left end up to a place, or all of them:
 * controllers take minutes for masks that cannot be compressed. */
StillMask
ramp (bool along_x, Extent mirrors)
{
  return {.name = along_x ? "ramp in x" : "ramp in y",
      .on = [along_x, mirrors] (int x, int y) {
        const double part =
            along_x ? (x + 0.5) / mirrors.width : (y + 0.5) / mirrors.height;
        return threshold (y) < part;
      }};
}

/* A plane through the part of the light that pixels get. */
Result<Eigen::Vector3d>
plane_of (const Image<float> &seen, const Image<float> &off,
    const Image<float> &on, ImageView<const std::uint8_t> good)
{
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero ();
  Eigen::Vector3d right = Eigen::Vector3d::Zero ();
  each_pixel (good, [&] (int x, int y) {
    if (good.at (x, y) == 0)
      return;
    const double light = double (on.at (x, y)) - double (off.at (x, y));
    const double part =
        (double (seen.at (x, y)) - double (off.at (x, y))) / light;
    const Eigen::Vector3d row (x, y, 1.0);
    normal += row * row.transpose ();
    right += part * row;
  });
  if (normal (2, 2) < kFewPixels)
    return Error{"fewer than " + std::to_string (int (kFewPixels)) +
                 " pixels see mirrors; check light, focus and alignment"};
  return Eigen::Vector3d (solve_normal (normal, right));
}

} // namespace

double
CoarseView::pixels_per_mirror () const
{
  return 1.0 / std::sqrt (std::max (1e-12, std::abs (area ())));
}

ViewOrientation
CoarseView::orientation () const
{
  const bool upright =
      std::abs (xx) + std::abs (yy) > std::abs (xy) + std::abs (yx);
  if (upright && area () > 0.0)
    return {.turned = xx > 0.0 ? 0 : 180};
  if (upright)
    return {.flipped_x = xx<0.0, .flipped_y = xx> 0.0};
  return {.flipped_x = area () < 0.0, .turned = yx > 0.0 ? 90 : 270};
}

Result<CoarseView>
look_where (Examination &examination, const Image<float> &off,
    const Image<float> &on, ImageView<const std::uint8_t> good, double part)
{
  const Extent mirrors = examination.rig.parts ().dmd.shown ();
  Eigen::Matrix<double, 3, 2> planes = Eigen::Matrix<double, 3, 2>::Zero ();
  for (const bool along_x : {true, false}) {
    ASSIGN_OR_RETURN (const Stack seen,
        look_at_light (examination, ramp (along_x, mirrors), 1, kFrames));
    ASSIGN_OR_RETURN (
        const Eigen::Vector3d plane, plane_of (seen.mean, off, on, good));
    planes.col (along_x ? 0 : 1) =
        plane * part * (along_x ? mirrors.width : mirrors.height);
  }
  return CoarseView{planes (0, 0), planes (1, 0), planes (2, 0) - 0.5,
      planes (0, 1), planes (1, 1), planes (2, 1) - 0.5};
}

} // namespace codedexposure
