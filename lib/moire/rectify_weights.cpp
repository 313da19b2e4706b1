/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "moire/rectify_weights.h"

#include <algorithm>
#include <cmath>

#include "moire/response.h"

namespace cexp
{

namespace
{

/* Shares below are none. */
constexpr double kLeastShare = 1e-4;

struct Share {
  std::size_t mirror;
  double part;
};

double
side_x (const PixelView &view)
{
  return std::hypot (view.slope[0], view.slope[1]);
}

double
side_y (const PixelView &view)
{
  return std::hypot (view.slope[2], view.slope[3]);
}

/* What the pixel @dx, @dy pixels from where the middle mirror is seen gets of
 * each mirror; parts add up to 1. */
std::vector<Share>
shares_of (
    const Neighbourhood &mirrors, const PixelView &view, double dx, double dy)
{
  const double at_x = view.slope[0] * dx + view.slope[1] * dy;
  const double at_y = view.slope[2] * dx + view.slope[3] * dy;
  const int reach = mirrors.reach ();
  const std::size_t side = std::size_t (2 * reach + 1);
  std::vector<double> across (side), down (side);
  for (std::size_t i = 0; i < side; i++) {
    const double mirror = double (i) - reach;
    across[i] =
        mirror_share (at_x - mirror, side_x (view), view.sigma * side_x (view));
    down[i] =
        mirror_share (at_y - mirror, side_y (view), view.sigma * side_y (view));
  }
  std::vector<Share> shares;
  double sum = 0.0;
  for (std::size_t j = 0; j < side; j++)
    for (std::size_t i = 0; i < side; i++)
      if (const double part = across[i] * down[j]; part > kLeastShare) {
        shares.push_back ({j * side + i, part});
        sum += part;
      }
  for (Share &share : shares)
    share.part /= sum;
  return shares;
}

/* Solves A x = b for two right sides at once, A symmetric and positive, n x n;
 * A is overwritten (Cholesky). */
void
solve_both (std::vector<double> &a, std::size_t n, std::vector<double> &b,
    std::vector<double> &c)
{
  for (std::size_t j = 0; j < n; j++) {
    for (std::size_t i = j; i < n; i++) {
      double sum = a[i * n + j];
      for (std::size_t k = 0; k < j; k++)
        sum -= a[i * n + k] * a[j * n + k];
      a[i * n + j] =
          i == j ? std::sqrt (std::max (sum, 1e-12)) : sum / a[j * n + j];
    }
  }
  for (std::vector<double> *x : {&b, &c}) {
    for (std::size_t i = 0; i < n; i++) {
      for (std::size_t k = 0; k < i; k++)
        (*x)[i] -= a[i * n + k] * (*x)[k];
      (*x)[i] /= a[i * n + i];
    }
    for (std::size_t i = n; i-- > 0;) {
      for (std::size_t k = i + 1; k < n; k++)
        (*x)[i] -= a[k * n + i] * (*x)[k];
      (*x)[i] /= a[i * n + i];
    }
  }
}

double
dot (const std::vector<double> &a, const std::vector<double> &b)
{
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size (); i++)
    sum += a[i] * b[i];
  return sum;
}

} // namespace

Matrix
element_covariance (const Schedule &schedule, double persistence)
{
  const std::size_t n = std::size_t (schedule.elements ());
  const std::size_t slots = std::size_t (schedule.slots ());
  const auto open = [&] (std::size_t element, std::size_t slot) {
    return schedule.code ().open (int (element), int (slot)) ? 1.0
                                                             : schedule.leak ();
  };
  std::vector<double> later (n * slots);
  for (std::size_t e = 0; e < n; e++)
    for (std::size_t s = 0; s < slots; s++)
      for (std::size_t t = 0; t < slots; t++)
        later[e * slots + s] +=
            open (e, t) * std::pow (persistence, std::abs (int (s) - int (t)));
  Matrix covariance (n * n);
  for (std::size_t e = 0; e < n; e++)
    for (std::size_t f = 0; f < n; f++)
      for (std::size_t s = 0; s < slots; s++)
        covariance[e * n + f] += later[e * slots + s] * open (f, s);
  return covariance;
}

Neighbourhood::Neighbourhood (const Schedule &schedule, const Matrix &elements,
    int x, int y, int reach, double correlation_length)
    : reach_ (reach)
{
  const std::size_t side = std::size_t (2 * reach + 1);
  const std::size_t n = std::size_t (schedule.elements ());
  std::vector<std::size_t> element;
  for (int j = -reach; j <= reach; j++)
    for (int i = -reach; i <= reach; i++) {
      const int e = schedule.element_at (x + i, y + j);
      const int open = schedule.code ().open_slots (e);
      element.push_back (std::size_t (e));
      light_.push_back (open + schedule.leak () * (schedule.slots () - open));
    }
  covariance_.resize (element.size () * element.size ());
  for (std::size_t a = 0; a < element.size (); a++)
    for (std::size_t b = 0; b < element.size (); b++) {
      const double dx = double (a % side) - double (b % side);
      const double dy = double (a / side) - double (b / side);
      const double r =
          std::sqrt (3.0) * std::hypot (dx, dy) / correlation_length;
      covariance_[a * element.size () + b] =
          elements[element[a] * n + element[b]] * (1.0 + r) * std::exp (-r);
    }
}

double
own_share (const PixelView &view, double dx, double dy)
{
  return mirror_share (view.slope[0] * dx + view.slope[1] * dy, side_x (view),
             view.sigma * side_x (view)) *
         mirror_share (view.slope[2] * dx + view.slope[3] * dy, side_y (view),
             view.sigma * side_y (view));
}

int
needed_reach (const PixelView &view)
{
  const double pixels = 0.5 * view.taps + 0.5 + 2.5 * view.sigma;
  const double along_x = std::abs (view.slope[0]) + std::abs (view.slope[1]);
  const double along_y = std::abs (view.slope[2]) + std::abs (view.slope[3]);
  return int (std::ceil (pixels * std::max (along_x, along_y)));
}

void
solve_weights (const Neighbourhood &mirrors, const PixelView &view, double fx,
    double fy, double noise, std::span<float> weights)
{
  const std::size_t taps = std::size_t (view.taps);
  const std::size_t pixels = taps * taps;
  const std::size_t count = mirrors.count ();
  const std::size_t middle = count / 2;
  const double half = 0.5 * (view.taps - 1);

  std::vector<std::vector<Share>> shares;
  std::vector<double> with_mirrors (pixels * count);
  for (std::size_t p = 0; p < pixels; p++) {
    shares.push_back (shares_of (mirrors, view, double (p % taps) - half - fx,
        double (p / taps) - half - fy));
    for (std::size_t m = 0; m < count; m++)
      for (const Share &share : shares[p])
        with_mirrors[p * count + m] +=
            share.part * mirrors.covariance (share.mirror, m);
  }

  std::vector<double> matrix (pixels * pixels), wanted (pixels), flat (pixels);
  for (std::size_t p = 0; p < pixels; p++) {
    for (std::size_t q = 0; q < pixels; q++)
      for (const Share &share : shares[q])
        matrix[p * pixels + q] +=
            share.part * with_mirrors[p * count + share.mirror];
    matrix[p * pixels + p] +=
        noise * noise * mirrors.covariance (middle, middle);
    wanted[p] = with_mirrors[p * count + middle];
    for (const Share &share : shares[p])
      flat[p] += share.part * mirrors.light (share.mirror);
  }
  const std::vector<double> brightness = flat;
  solve_both (matrix, pixels, wanted, flat);
  const double factor = (mirrors.light (middle) - dot (brightness, wanted)) /
                        dot (brightness, flat);
  for (std::size_t p = 0; p < pixels; p++)
    weights[p] = float (wanted[p] + factor * flat[p]);
}

} // namespace cexp
