/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "calibrate/phase_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "calibrate/gratings.h"

namespace codedexposure
{

namespace
{

/* Standard deviations of chi-square above which a pixel is an outlier. */
constexpr double kOutlierSigmas = 6.0;

/* A pixel whose gratings have less contrast, relative to its dark and white, is
 * out of focus or sees something else. */
constexpr float kFaintSwing = 0.3f;

/* Errors of the model, rms, as a part of the swing from dark to light: in the
 * dark, where there is little noise, they dominate, as values cannot be
 * negative.
 */
constexpr float kModelError = 0.007f;

/* Distance of mirrors that contribute to a pixel. */
double
reach (double side, double variance)
{
  return 0.5 * side + 4.0 * std::sqrt (variance);
}

typedef GratingResponse::Value Value;

/* The mean of rounded values. Noise blurs the steps of rounding, but in the
 * dark there is little noise. */
class Rounding
{
public:
  Rounding (const NoiseModel &noise, int frames);

  /* Of values whose mean before rounding is @number. */
  float mean (float number) const
  {
    const float step = (number - kFirst) * kSteps;
    if (!(step >= 0.0f && step < float (means_.size ()) - 1.0f))
      return number;
    const std::size_t low = std::size_t (step);
    return means_[low] + (step - float (low)) * (means_[low + 1] - means_[low]);
  }

private:
  static constexpr int kSteps = 32; // per DN
  static constexpr float kFirst = -2.0f, kLast = 64.0f;
  /* Standard deviation of noise above which no steps remain; and the smallest
   * one that is assumed, as the model would have kinks with less. */
  static constexpr double kBlurred = 0.6, kSharp = 0.12;

  std::vector<float> means_;
};

/* A sawtooth as a sum of harmonics, each attenuated by the noise. @noise is
 * that of means of @frames values; its floor was estimated in the dark, where
 * rounding hides noise and does not add to it. */
Rounding::Rounding (const NoiseModel &noise, int frames)
{
  for (float number = kFirst; number < kLast; number += 1.0f / kSteps) {
    const double variance =
        frames * (noise.floor + noise.slope * std::max (0.0, double (number)));
    if (variance > kBlurred * kBlurred)
      break;
    double mean = double (number);
    double sign = -1.0;
    for (int h = 1; h <= 3; h++, sign = -sign) {
      const double frequency = 2.0 * std::numbers::pi * h;
      mean += sign * 2.0 / frequency * std::sin (frequency * double (number)) *
              std::exp (-0.5 * frequency * frequency *
                        std::max (variance, kSharp * kSharp));
    }
    means_.push_back (float (mean));
  }
}

/* Weighted sums over the phases of one pixel. */
struct Sums {
  float w = 0, l = 0, ll = 0;                  // of 1, light
  float d = 0, dl = 0, dd = 0;                 // slope
  float b = 0, bl = 0, bb = 0, bd = 0;         // blur
  float y = 0, yl = 0, yd = 0, yb = 0, yy = 0; // number

  void add (const Value &v, float rest, float weight)
  {
    const float wl = weight * v.light, wd = weight * v.slope;
    const float wb = weight * v.blur;
    w += weight;
    l += wl;
    ll += wl * v.light;
    d += wd;
    dl += wd * v.light;
    dd += wd * v.slope;
    b += wb;
    bl += wb * v.light;
    bb += wb * v.blur;
    bd += wb * v.slope;
    y += weight * rest;
    yl += wl * rest;
    yd += wd * rest;
    yb += wb * rest;
    yy += weight * rest * rest;
  }
  float inverse () const
  {
    const float determinant = w * ll - l * l;
    return determinant > 0.0f ? 1.0f / determinant : 0.0f;
  }
  /* Difference of the swing from the expected one. */
  float more_swing () const { return inverse () * (w * yl - l * y); }
  PixelFit fit (float swing) const;
};

/* Dark level and swing are free in each pixel: sums are orthogonal to both. */
PixelFit
Sums::fit (float swing) const
{
  const float scale = inverse ();
  /* Sum of products of two quantities, orthogonal to 1 and light. */
  const auto rest = [&] (float pq, float p, float pl, float q, float ql) {
    return pq - scale * (p * (ll * q - l * ql) + pl * (w * ql - l * q));
  };
  PixelFit found;
  found.swing = swing;
  found.score = swing * rest (yd, y, yl, d, dl);
  found.information = swing * swing * rest (dd, d, dl, d, dl);
  found.blur_score = swing * rest (yb, y, yl, b, bl);
  found.blur_information = swing * swing * rest (bb, b, bl, b, bl);
  found.cross = swing * swing * rest (bd, b, bl, d, dl);
  found.chi_square = rest (yy, y, yl, y, yl);
  if (found.information > 0.0f)
    found.chi_square -= found.score * found.score / found.information;
  return found;
}

struct PixelLight {
  float dark, swing;
};

/* Fits pixel @x of a row, as of rows_at (), to the frames of one axis. */
PixelFit
fit_pixel (const Image<float> &rows, int x, const GratingResponse &response,
    double mirror, PixelLight light, const NoiseModel &noise,
    const Rounding &rounding)
{
  const GratingResponse::Entry entry = response.entry (mirror);
  const float model_error = kModelError * light.swing;
  const float floor = float (noise.floor) + model_error * model_error;
  const float slope = float (noise.slope);
  Sums sums;
  for (int k = 0; k < response.period (); k++) {
    const Value v = response.at (entry, k);
    const float expected = light.dark + light.swing * v.light;
    const float variance = floor + slope * std::max (0.0f, expected);
    sums.add (v, rows.at (x, k) - rounding.mean (expected), 1.0f / variance);
  }
  return sums.fit (light.swing + sums.more_swing ());
}

/* Squared residuals by expected value. */
struct NoiseBins {
  static constexpr int kBins = 64;
  double width = 1.0;
  std::array<double, kBins> squares = {}, numbers = {}, counts = {};

  void add (double number, double square)
  {
    const int bin = std::clamp (int (number / width), 0, kBins - 1);
    squares[std::size_t (bin)] += square;
    numbers[std::size_t (bin)] += number;
    counts[std::size_t (bin)] += 1.0;
  }
  NoiseModel fit (NoiseModel start) const;
};

/* A line through the bins' variances, whose own variances are their squares. */
NoiseModel
NoiseBins::fit (NoiseModel model) const
{
  for (int round = 0; round < 4; round++) {
    double n = 0, nx = 0, nxx = 0, s = 0, sx = 0;
    for (std::size_t i = 0; i < kBins; i++) {
      if (counts[i] < 100.0)
        continue;
      const double at = numbers[i] / counts[i];
      const double variance = squares[i] / counts[i];
      const double expected = model.floor + model.slope * std::max (0.0, at);
      const double weight = counts[i] / (expected * expected);
      n += weight;
      nx += weight * at;
      nxx += weight * at * at;
      s += weight * variance;
      sx += weight * variance * at;
    }
    const double determinant = n * nxx - nx * nx;
    if (!(determinant > 0.0))
      return model;
    model.slope = std::max (0.0, (n * sx - nx * s) / determinant);
    model.floor = std::max (1e-3, (s - model.slope * nx) / n);
  }
  return model;
}

/* Adds the residuals of one pixel, whose level, swing and place are fitted.
 * Each is corrected for its own influence on the fit. */
void
find_noise (const Image<float> &rows, int x, const GratingResponse &response,
    double mirror, PixelLight light, const NoiseModel &noise, NoiseBins &bins)
{
  constexpr std::size_t kTerms = 3;
  const GratingResponse::Entry entry = response.entry (mirror);
  const std::size_t phases = std::size_t (response.period ());
  std::array<std::array<double, Pattern::kMaxPeriod>, kTerms> term;
  std::array<double, Pattern::kMaxPeriod> weight, rest, expected, freedom;
  for (std::size_t k = 0; k < phases; k++) {
    const Value v = response.at (entry, int (k));
    expected[k] = double (light.dark) + double (light.swing) * double (v.light);
    weight[k] = 1.0 / (noise.floor + noise.slope * std::max (0.0, expected[k]));
    rest[k] = double (rows.at (x, int (k))) - expected[k];
    term[0][k] = 1.0;
    term[1][k] = double (v.light);
    term[2][k] = double (v.slope);
    freedom[k] = 1.0;
  }
  /* Gram-Schmidt orthogonalisation with weighted products. */
  const auto product = [&] (const auto &a, const auto &b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < phases; k++)
      sum += weight[k] * a[k] * b[k];
    return sum;
  };
  for (std::size_t i = 0; i < kTerms; i++) {
    for (std::size_t j = 0; j < i; j++) {
      const double part = product (term[i], term[j]);
      for (std::size_t k = 0; k < phases; k++)
        term[i][k] -= part * term[j][k];
    }
    const double length = std::sqrt (product (term[i], term[i]));
    for (std::size_t k = 0; k < phases; k++)
      term[i][k] /= length;
    const double part = product (rest, term[i]);
    for (std::size_t k = 0; k < phases; k++) {
      rest[k] -= part * term[i][k];
      freedom[k] -= weight[k] * term[i][k] * term[i][k];
    }
  }
  for (std::size_t k = 0; k < phases; k++)
    if (freedom[k] > 0.2)
      bins.add (expected[k], rest[k] * rest[k] / freedom[k]);
}

/** Row @p y of the camera in each frame, one below the other, DN. */
Image<float>
rows_at (const PhaseStack &stack, int y)
{
  Image<float> rows (stack.frames[0].width, stack.period ());
  for (int k = 0; k < stack.period (); k++)
    std::transform (stack.frames[std::size_t (k)].row (y / stack.step),
        stack.frames[std::size_t (k)].row (y / stack.step) + rows.width (),
        rows.view ().row (k),
        [&stack] (std::uint16_t value) { return stack.unit * float (value); });
  return rows;
}

/* Constants of all pixels of a round. */
struct Conditions {
  GratingResponse x, y;
  double margin_x, margin_y; // of mirrors whose pixels see the edge
  float limit_x, limit_y;    // of chi-square; outliers have more

  bool sees_edge (Position m, Extent mirrors) const
  {
    return m.x < margin_x - 0.5 || m.x > mirrors.width - 0.5 - margin_x ||
           m.y < margin_y - 0.5 || m.y > mirrors.height - 0.5 - margin_y;
  }
};

Conditions
conditions_of (const PhaseFit &fit)
{
  const auto limit = [&fit] (int phases) {
    const double freedom = std::max (1, phases - 3);
    return float (fit.reduced_chi_square * freedom *
                  (1.0 + kOutlierSigmas * std::sqrt (2.0 / freedom)));
  };
  /* Of the pixel in the middle, in mirrors. */
  const auto slope = fit.mapping.slope_at (
      0.5 * (fit.camera.width - 1), 0.5 * (fit.camera.height - 1));
  const double side_x = std::hypot (slope[0], slope[1]);
  const double side_y = std::hypot (slope[2], slope[3]);
  return {{fit.x.period (), side_x, std::sqrt (fit.blur_x)},
      {fit.y.period (), side_y, std::sqrt (fit.blur_y)},
      reach (side_x, fit.blur_x), reach (side_y, fit.blur_y),
      limit (fit.x.period ()), limit (fit.y.period ())};
}

HomographyFit::Observation
observation (const PixelFit &f)
{
  return {double (f.score), double (f.information), double (f.blur_score),
      double (f.blur_information), double (f.cross)};
}

/* Sums over the pixels of a round. */
struct PhaseSums {
  HomographyFit fit;
  double squares = 0.0, freedom = 0.0; // of residuals
  double scores = 0.0, count = 0.0;    // squared, in units of their variance

  void add (const PixelFit &f, int phases)
  {
    squares += double (f.chi_square);
    freedom += phases - 3;
    scores += double (f.score * f.score / f.information);
    count += 1.0;
  }
};

/* Largest distance between two mappings in a frame's corners. */
double
largest_step (const Homography &a, const Homography &b)
{
  double longest = 0.0;
  for (const double xi : {-1.0, 1.0})
    for (const double eta : {-1.0, 1.0}) {
      const Projected p = project (a, xi, eta);
      const Projected q = project (b, xi, eta);
      longest = std::max (longest, std::hypot (p.x - q.x, p.y - q.y));
    }
  return longest;
}

/* The change of the blur is limited to a factor, as the model is not linear. */
double
moved (double blur, double change)
{
  return std::clamp (blur + change, std::max (1e-3, 0.4 * blur), 2.5 * blur);
}

/* Sums over all usable pixels of the rows that the frames have. */
PhaseSums
sum_up (PhaseFit &p)
{
  const Conditions at = conditions_of (p);
  const CentredFrame frame (p.camera);
  const Homography centred = p.mapping.centred ();
  const Rounding rounding (p.noise, p.frames);
  PhaseSums sums;
  for (int y = 0; y < p.camera.height; y += p.x.step) {
    const Image<float> rows_x = rows_at (p.x, y), rows_y = rows_at (p.y, y);
    for (int x = 0; x < p.camera.width; x++) {
      const Position m = p.mapping.mirror_at (x, y);
      if (p.usable.at (x, y) == 0 || at.sees_edge (m, p.mirrors))
        continue;
      const float low = p.dark.at (x, y);
      const PixelLight light = {low, p.white.at (x, y) - low};
      const auto fx =
          fit_pixel (rows_x, x, at.x, m.x, light, p.noise, rounding);
      const auto fy =
          fit_pixel (rows_y, x, at.y, m.y, light, p.noise, rounding);
      if (std::min (fx.swing, fy.swing) < kFaintSwing * light.swing) {
        p.faint.at (x, y) = 1;
      } else if (fx.chi_square > at.limit_x || fy.chi_square > at.limit_y) {
        p.outlier.at (x, y) = 1;
      } else {
        sums.add (fx, p.x.period ());
        sums.add (fy, p.y.period ());
        const double xi = (x - frame.cx) / frame.r;
        const double eta = (y - frame.cy) / frame.r;
        const Projected seen = project (centred, xi, eta);
        sums.fit.add (xi, eta, seen, observation (fx), observation (fy));
        p.block_at (p.blocks_x, x, y).add (fx.score, fx.information);
        p.block_at (p.blocks_y, x, y).add (fy.score, fy.information);
      }
    }
  }
  return sums;
}

} // namespace

PhaseFit::Block &
PhaseFit::block_at (std::vector<Block> &blocks, int px, int py) const
{
  return blocks[std::size_t (
      py / block_size * blocks_across () + px / block_size)];
}

std::optional<double>
PhaseFit::round (int numbers)
{
  const auto blocks = std::size_t (blocks_across () * blocks_down ());
  blocks_x.assign (blocks, {});
  blocks_y.assign (blocks, {});
  outlier = faint = Image<std::uint8_t> (camera.width, camera.height);
  const PhaseSums sums = sum_up (*this);
  if (sums.freedom <= 0.0)
    return std::nullopt;
  reduced_chi_square = sums.squares / sums.freedom;
  noise_ratio = sums.scores / sums.count;
  const auto step = sums.fit.solve (numbers, true);
  if (!step)
    return std::nullopt;

  blur_x = moved (blur_x, step->change[HomographyFit::kExtra]);
  blur_y = moved (blur_y, step->change[HomographyFit::kExtra + 1]);
  if (numbers == 0)
    return 0.0;
  constexpr int kParameters = Mapping::kParameters;
  Eigen::Map<Eigen::Matrix<double, kParameters, kParameters>> (
      covariance.data ()) =
      noise_ratio * step->covariance.topLeftCorner<kParameters, kParameters> ();
  const Homography before = mapping.centred ();
  Homography next = before;
  for (int i = 0; i < numbers; i++)
    next[std::size_t (i)] += step->change[i];
  auto made = Mapping::from_centred (camera, mirrors, next);
  if (!made)
    return std::nullopt;
  mapping = std::move (*made);
  return largest_step (before, next);
}

void
PhaseFit::estimate_noise ()
{
  const Conditions at = conditions_of (*this);
  NoiseBins bins;
  float brightest = 1.0f;
  for (int py = 0; py < camera.height; py += 8)
    for (int px = 0; px < camera.width; px++)
      brightest = std::max (brightest, white.at (px, py));
  bins.width = double (brightest) / NoiseBins::kBins;

  for (int py = 0; py < camera.height; py += std::lcm (4, x.step))
    for (const bool along_y : {false, true}) {
      const Image<float> rows = rows_at (along_y ? y : x, py);
      for (int px = 0; px < camera.width; px++) {
        if (usable.at (px, py) == 0 || outlier.at (px, py) != 0 ||
            faint.at (px, py) != 0)
          continue;
        const Position m = mapping.mirror_at (px, py);
        if (at.sees_edge (m, mirrors))
          continue;
        const float low = dark.at (px, py);
        find_noise (rows, px, along_y ? at.y : at.x, along_y ? m.y : m.x,
            {low, white.at (px, py) - low}, noise, bins);
      }
    }
  noise = bins.fit (noise);
}

} // namespace codedexposure
