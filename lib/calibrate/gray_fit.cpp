/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "calibrate/gray_fit.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calibrate/homography_fit.h"

namespace codedexposure
{

namespace
{

/* Part of the usable pixels that must agree with a mapping. */
constexpr double kMajority = 0.5;

/* Pixels for which the fit is made, in each direction. */
constexpr int kSamples = 192;

struct Sample {
  double xi, eta, x, y;
};

std::vector<Sample>
decode (const GrayCode &gx, const GrayCode &gy,
    ImageView<const std::uint8_t> usable)
{
  const CentredFrame frame ({usable.width, usable.height});
  std::vector<Sample> samples;
  const int step_x = std::max (1, usable.width / kSamples);
  const int step_y = std::max (1, usable.height / kSamples);
  for (int y = step_y / 2; y < usable.height; y += step_y)
    for (int x = step_x / 2; x < usable.width; x += step_x)
      if (usable.at (x, y) != 0)
        samples.push_back ({(x - frame.cx) / frame.r, (y - frame.cy) / frame.r,
            gx.mirror_at (x, y), gy.mirror_at (x, y)});
  return samples;
}

} // namespace

double
GrayCode::mirror_at (int x, int y) const
{
  int stripe = bits.at (x, y);
  for (const int shift : {8, 4, 2, 1})
    stripe ^= stripe >> shift;
  return (stripe + 0.5) * width - 0.5;
}

Result<Homography>
fit_gray_codes (const GrayCode &gx, const GrayCode &gy,
    ImageView<const std::uint8_t> usable)
{
  const std::vector<Sample> samples = decode (gx, gy, usable);
  const Error lost{
      "the Gray codes give no mapping, as fewer than half of the pixels agree; "
      "check light and focus, and that each frame shows its own pattern"};
  if (samples.size () < 100)
    return lost;

  Homography h = {0, 0, 0, 0, 0, 0, 0, 0, 1};
  const double stripe = std::max (gx.width, gy.width);
  /* The limit for outliers shrinks to 1.5 stripes, as half a stripe is the
   * error of the code itself; the first mapping is affine, of all samples. */
  double limit = 1e9;
  std::size_t agree = 0;
  for (int round = 0; round <= 12; round++) {
    HomographyFit fit;
    double squares = 0.0;
    agree = 0;
    for (const Sample &s : samples) {
      const Projected at = project (h, s.xi, s.eta);
      const double dx = s.x - at.x, dy = s.y - at.y;
      if (std::abs (dx) > limit || std::abs (dy) > limit)
        continue;
      agree++;
      squares += dx * dx + dy * dy;
      fit.add (s.xi, s.eta, at, {dx, 1.0}, {dy, 1.0});
    }
    const auto step = fit.solve (round <= 4 ? 6 : 8, false);
    if (!step)
      return lost;
    Eigen::Map<Eigen::Vector<double, 8>> (h.data ()) += step->change.head<8> ();
    if (round > 0)
      limit =
          std::max (1.5 * stripe, 1.5 * std::sqrt (squares / double (agree)));
  }
  if (double (agree) < kMajority * double (samples.size ()) ||
      limit > 2.0 * stripe)
    return lost;
  return h;
}

} // namespace codedexposure
