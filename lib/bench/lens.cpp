/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/lens.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <numbers>
#include <numeric>

namespace codedexposure
{

namespace
{

/* The Gaussian is cut here; 6e-5 of its light is beyond. */
constexpr double kReach = 4.0;

/* resample () blurs by this much at most, which removes what the pixels cannot
 * represent, and blur () adds the rest: the cost of a window grows with the
 * square of its reach, that of separable taps with the reach. */
constexpr double kResampleSigma = 0.75;

/* Windows are tabulated at these fractions of a mirror and interpolated. */
constexpr int kFractions = 256;

/* What the smallest scale and kResampleSigma need. */
constexpr int kMaxWindow = 16;

/* Second integral of a Gaussian of standard deviation @sigma. */
double
ramp (double x, double sigma)
{
  if (sigma <= 0.0)
    return std::max (x, 0.0);
  const double z = x / sigma;
  const double below = 0.5 * std::erfc (-z / std::numbers::sqrt2);
  const double density =
      std::exp (-0.5 * z * z) * std::numbers::inv_sqrtpi / std::numbers::sqrt2;
  return x * below + sigma * density;
}

/* Light that a pixel gets from a mirror of unit brightness and a side of @side
 * pixels, @distance pixels away along one axis: the integral of box * box *
 * Gaussian. */
double
response (double distance, double side, double sigma)
{
  const double outer = 0.5 * (side + 1.0);
  const double inner = 0.5 * std::abs (side - 1.0);
  return std::max (
      0.0, ramp (distance + outer, sigma) - ramp (distance + inner, sigma) -
               ramp (distance - inner, sigma) + ramp (distance - outer, sigma));
}

/* @first and weights that add up to 1, without negligible ones at the ends. */
LensTaps
make_taps (int first, const std::vector<double> &weights)
{
  const auto matters = [] (double w) { return w > 1e-7; };
  const auto begin = std::find_if (weights.begin (), weights.end (), matters);
  const auto end =
      std::find_if (weights.rbegin (), weights.rend (), matters).base ();
  const double sum = std::accumulate (begin, end, 0.0);

  LensTaps taps = {first + int (begin - weights.begin ()), {}};
  std::transform (begin, end, std::back_inserter (taps.weights),
      [sum] (double w) { return float (w / sum); });
  return taps;
}

/* Mirrors of one pixel's side, @shift away. */
LensTaps
shifted_taps (double shift, double sigma)
{
  const double reach = 1.0 + kReach * sigma;
  const int first = int (std::floor (shift - reach));
  std::vector<double> weights;
  for (int i = first; i <= int (std::ceil (shift + reach)); i++)
    weights.push_back (response (i - shift, 1.0, sigma));
  return make_taps (first, weights);
}

/* A Gaussian between pixels. */
LensTaps
gaussian_taps (double sigma)
{
  if (sigma <= 0.0)
    return {};
  const int reach = int (std::ceil (kReach * sigma));
  std::vector<double> weights;
  for (int i = -reach; i <= reach; i++)
    weights.push_back (std::exp (-0.5 * i * i / (sigma * sigma)));
  return make_taps (-reach, weights);
}

} // namespace

Homography
camera_to_mirrors (const Alignment &alignment, int width, int height)
{
  const double turn = alignment.rotation * std::numbers::pi / 180.0;
  const double c = std::cos (turn) / alignment.scale;
  const double s = std::sin (turn) / alignment.scale;
  const double cx = 0.5 * (width - 1);
  const double cy = 0.5 * (height - 1);
  return {c, -s, cx + alignment.shift_x - c * cx + s * cy, s, c,
      cy + alignment.shift_y - s * cx - c * cy, 0.0, 0.0, 1.0};
}

Position
mirror_seen (const Alignment &alignment, int width, int height, Position pixel)
{
  const double cx = 0.5 * (width - 1);
  const double cy = 0.5 * (height - 1);
  const double dx = pixel.x - cx, dy = pixel.y - cy;
  const double out = 1.0 + alignment.distortion * (dx * dx + dy * dy) /
                               std::max (1.0, cx * cx + cy * cy);
  const double qx = out * dx, qy = out * dy;
  /* A blur brings in light from far beyond a small frame, where a tilted plane
   * of mirrors may end at its horizon. */
  constexpr double kHorizon = 0.05;
  const double z =
      std::max (kHorizon, 1.0 + alignment.tilt_x * qx / std::max (1.0, cx) +
                              alignment.tilt_y * qy / std::max (1.0, cy));
  const Homography m = camera_to_mirrors (alignment, width, height);
  return {cx + alignment.shift_x + (m[0] * qx + m[1] * qy) / z,
      cy + alignment.shift_y + (m[3] * qx + m[4] * qy) / z};
}

namespace
{

/* The alignment of a mapping that only shifts, which needs no resampling; none
 * for others. */
std::optional<Alignment>
shift_of (const Mapping &mapping, Offset first)
{
  const Homography &h = mapping.homography ();
  const Homography shift = {1, 0, h[2], 0, 1, h[5], 0, 0, 1};
  if (mapping.displacement () || h != shift)
    return std::nullopt;
  return Alignment{.shift_x = h[2] - first.x, .shift_y = h[5] - first.y};
}

} // namespace

Lens::Lens (const Alignment &asked, double psf_sigma, int width, int height,
    const std::optional<Mapping> &mapping, Offset first)
    : alignment_ (asked), width_ (width), height_ (height), first_ (first)
{
  if (const auto shift = mapping ? shift_of (*mapping, first) : std::nullopt)
    alignment_ = *shift;
  else if ((mapping_ = mapping))
    alignment_ = {.scale = mapping->pose ().magnification};
  const Alignment &alignment = alignment_;
  to_mirrors_ = camera_to_mirrors (alignment, width, height);
  if (!mapping_ && alignment.rotation == 0.0 && alignment.scale == 1.0 &&
      alignment.affine ()) {
    horizontal_ = shifted_taps (alignment.shift_x, psf_sigma);
    vertical_ = shifted_taps (alignment.shift_y, psf_sigma);
    ideal_ = horizontal_.identity () && vertical_.identity ();
  } else {
    const double sigma = std::min (psf_sigma, kResampleSigma);
    make_windows (alignment.scale, sigma);
    horizontal_ = vertical_ =
        gaussian_taps (std::sqrt (psf_sigma * psf_sigma - sigma * sigma));
  }
  if (horizontal_.identity () && vertical_.identity ())
    return;
  if (taps_ > 0) {
    margin_ = int (horizontal_.weights.size ()) / 2;
    wide_ = Image<float> (width + 2 * margin_, height + 2 * margin_);
  }
  between_ = Image<float> (width, height + 2 * margin_);
  padded_.resize (std::size_t (width) + horizontal_.weights.size () - 1);
}

void
Lens::make_windows (double scale, double sigma)
{
  const double reach = (0.5 * (scale + 1.0) + kReach * sigma) / scale;
  taps_ = 4 * int (std::ceil (std::ceil (reach) / 2.0));
  for (int f = 0; f <= kFractions; f++) {
    std::array<double, kMaxWindow> weights;
    double sum = 0.0;
    for (int i = 0; i < taps_; i++) {
      const double mirrors = i - (taps_ / 2 - 1) - double (f) / kFractions;
      weights[std::size_t (i)] = response (mirrors * scale, scale, sigma);
      sum += weights[std::size_t (i)];
    }
    for (int i = 0; i < taps_; i++)
      windows_.push_back (float (weights[std::size_t (i)] / sum));
  }
}

void
Lens::image (ImageView<const float> mirrors, ImageView<float> camera)
{
  if (ideal_) {
    for (int y = 0; y < camera.height; y++)
      std::copy_n (mirrors.row (y), camera.width, camera.row (y));
  } else if (taps_ == 0) {
    blur (mirrors, camera, 0);
  } else if (margin_ == 0) {
    resample (mirrors, camera);
  } else {
    resample (mirrors, wide_.view ());
    blur (wide_.view (), camera, margin_);
  }
}

void
Lens::resample (ImageView<const float> mirrors, ImageView<float> camera) const
{
  switch (taps_) {
  case 4:
    return resample<4> (mirrors, camera);
  case 8:
    return resample<8> (mirrors, camera);
  case 12:
    return resample<12> (mirrors, camera);
  default:
    return resample<kMaxWindow> (mirrors, camera);
  }
}

namespace
{

/* A mirror position along one axis: where the window of a pixel begins, and
 * the weights in it. */
template <int kTaps>
struct Place {
  int first;
  std::array<float, kTaps> weights;

  Place (double position, const std::vector<float> &windows)
  {
    /* A floor that does not call the library. */
    const int towards_zero = int (position);
    const int below = towards_zero - (position < towards_zero);
    const double at = (position - below) * kFractions;
    const int fraction = int (at);
    const float *low = windows.data () + fraction * kTaps;
    const float *high = low + kTaps;
    const float between = float (at - fraction);
    first = below - (kTaps / 2 - 1);
    for (int i = 0; i < kTaps; i++)
      weights[std::size_t (i)] = low[i] + between * (high[i] - low[i]);
  }

  /* The part of the window that has mirrors, of @count. */
  int begin () const { return std::max (0, -first); }
  int end (int count) const { return std::min (kTaps, count - first); }
};

/* Spelled out: the compiler finds no vectors in the plain loops. */
typedef float Four __attribute__ ((vector_size (16)));

inline Four
load_four (const float *from)
{
  Four four;
  std::memcpy (&four, from, sizeof four);
  return four;
}

/* The window lies inside. */
template <int kTaps>
float
gather_inside (ImageView<const float> mirrors, const Place<kTaps> &x,
    const Place<kTaps> &y)
{
  std::array<Four, kTaps / 4> columns = {};
  for (int j = 0; j < kTaps; j++) {
    const float *row = mirrors.row (y.first + j) + x.first;
    for (int i = 0; i < kTaps / 4; i++)
      columns[std::size_t (i)] +=
          y.weights[std::size_t (j)] * load_four (row + 4 * i);
  }
  Four sum = {};
  for (int i = 0; i < kTaps / 4; i++)
    sum += load_four (x.weights.data () + 4 * i) * columns[std::size_t (i)];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

template <int kTaps>
float
gather_at_border (ImageView<const float> mirrors, const Place<kTaps> &x,
    const Place<kTaps> &y)
{
  float sum = 0.0f;
  for (int j = y.begin (); j < y.end (mirrors.height); j++) {
    const float *row = mirrors.row (y.first + j);
    for (int i = x.begin (); i < x.end (mirrors.width); i++)
      sum += y.weights[std::size_t (j)] * x.weights[std::size_t (i)] *
             row[x.first + i];
  }
  return sum;
}

} // namespace

/* Where a pixel looks, by the picture of the mirrors. Beyond the frame, a
 * mapping may have no place for it. */
Position
Lens::place_of (int x, int y) const
{
  constexpr double kNowhere = 1e6;
  if (!mapping_)
    return mirror_seen (alignment_, width_, height_, {double (x), double (y)});
  const auto [seen_x, seen_y] = mapping_->mirror_at (x, y);
  const Position place{seen_x - first_.x, seen_y - first_.y};
  if (std::abs (place.x) < kNowhere && std::abs (place.y) < kNowhere)
    return place;
  return {-kNowhere, -kNowhere};
}

/* @camera may reach beyond the frame by margin_ pixels on each side. */
template <int kTaps>
void
Lens::resample (ImageView<const float> mirrors, ImageView<float> camera) const
{
  const Homography &m = to_mirrors_;
  const bool affine = !mapping_ && alignment_.affine ();
  for (int row = 0; row < camera.height; row++) {
    const int py = row - margin_;
    float *out = camera.row (row);
    for (int px = -margin_; px < camera.width - margin_; px++) {
      const Position at = affine ? Position{m[0] * px + m[1] * py + m[2],
                                       m[3] * px + m[4] * py + m[5]}
                                 : place_of (px, py);
      const Place<kTaps> x (at.x, windows_);
      const Place<kTaps> y (at.y, windows_);
      const bool inside = x.first >= 0 && x.first + kTaps <= mirrors.width &&
                          y.first >= 0 && y.first + kTaps <= mirrors.height;
      *out++ = inside ? gather_inside (mirrors, x, y)
                      : gather_at_border (mirrors, x, y);
    }
  }
}

namespace
{

void
add_row (float weight, const float *in, int width, float *out)
{
  for (int x = 0; x < width; x++)
    out[x] += weight * in[x];
}

} // namespace

/* @from reaches beyond @to by @margin pixels on each side, and at the right and
 * the bottom perhaps more. */
void
Lens::blur (ImageView<const float> from, ImageView<float> to, int margin)
{
  if (between_.height () < from.height)
    between_ = Image<float> (width_, from.height);
  const int width = to.width;
  const int left = margin + horizontal_.first;
  for (int y = 0; y < from.height; y++) {
    /* padded_[x + i] is the neighbour of pixel x under tap i. */
    std::fill (padded_.begin (), padded_.end (), 0.0f);
    const int begin = std::clamp (left, 0, from.width);
    const int end =
        std::clamp (left + int (padded_.size ()), begin, from.width);
    std::copy (from.row (y) + begin, from.row (y) + end,
        padded_.data () + (begin - left));

    float *out = between_.view ().row (y);
    std::fill (out, out + width, 0.0f);
    for (std::size_t i = 0; i < horizontal_.weights.size (); i++)
      add_row (horizontal_.weights[i], padded_.data () + i, width, out);
  }
  for (int y = 0; y < to.height; y++) {
    float *out = to.row (y);
    std::fill (out, out + width, 0.0f);
    for (int i = 0; i < int (vertical_.weights.size ()); i++) {
      const int neighbour = y + margin + vertical_.first + i;
      if (neighbour >= 0 && neighbour < from.height)
        add_row (vertical_.weights[std::size_t (i)],
            between_.view ().row (neighbour), width, out);
    }
  }
}

} // namespace codedexposure
