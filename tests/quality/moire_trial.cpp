/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* One calibration on the simulated bench, and the bound of its accuracy. */
#include "moire_trial.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <utility>

#include "bench/sensor.h"
#include "calibrate/homography_fit.h"
#include "calibrate/response.h"

namespace codedexposure::quality
{

namespace
{

constexpr int kPeriod = 12;

Sensor
sensor_of (const MoireTrial &trial)
{
  Sensor sensor;
  sensor.full_well = kMoireWell;
  sensor.read_noise = kMoireRead;
  sensor.bits = 8;
  sensor.seed = trial.seed;
  return sensor;
}

Lens
lens_of (const MoireTrial &trial)
{
  return Lens (
      trial.alignment, trial.psf_sigma, kMoireSize.width, kMoireSize.height);
}

Image<std::uint8_t>
expose (Lens &lens, const Sensor &sensor, ImageView<const std::uint8_t> mirrors,
    std::uint64_t number)
{
  Image<float> light (mirrors.width, mirrors.height), seen = light;
  for (int y = 0; y < mirrors.height; y++)
    std::transform (mirrors.row (y), mirrors.row (y) + mirrors.width,
        light.view ().row (y), [] (std::uint8_t on) {
          return on != 0 ? float (kMoireLight / 255.0) : 0.0f;
        });
  lens.image (std::as_const (light).view (), seen.view ());
  Image<std::uint8_t> frame (mirrors.width, mirrors.height);
  sensor.read_out<std::uint8_t> (
      std::as_const (seen).view (), 1.0, number, frame.view ());
  return frame;
}

/* Information of a pixel on its position and on the blur, from the variances of
 * the scores of all phases orthogonal to 1 and light. */
HomographyFit::Observation
information_at (const GratingResponse &response, double place)
{
  double w = 0, l = 0, ll = 0, d = 0, dl = 0, dd = 0;
  double b = 0, bl = 0, bb = 0, bd = 0;
  for (int phase = 0; phase < response.period (); phase++) {
    const GratingResponse::Value v =
        response.at (response.entry (place + phase));
    const double light = double (v.light), slope = double (v.slope);
    const double blur = double (v.blur);
    const double electron = 255.0 / kMoireWell;
    const double variance = electron * kMoireLight * std::max (0.0, light) +
                            std::pow (electron * kMoireRead, 2) + 1.0 / 12.0;
    const double weight = kMoireLight * kMoireLight / variance;
    w += weight;
    l += weight * light;
    ll += weight * light * light;
    d += weight * slope;
    dl += weight * slope * light;
    dd += weight * slope * slope;
    b += weight * blur;
    bl += weight * blur * light;
    bb += weight * blur * blur;
    bd += weight * blur * slope;
  }
  const double inverse = 1.0 / (w * ll - l * l);
  const auto rest = [&] (double pq, double p, double pl, double q, double ql) {
    return pq - inverse * (p * (ll * q - l * ql) + pl * (w * ql - l * q));
  };
  return {0.0, rest (dd, d, dl, d, dl), 0.0, rest (bb, b, bl, b, bl),
      rest (bd, b, bl, d, dl)};
}

/* Normal equations of a run, every third pixel standing for nine. */
HomographyFit
expected_fit (const MoireTrial &trial, const Mapping &truth)
{
  const double side = 1.0 / trial.alignment.scale;
  const double margin = 0.5 * side + 4.0 * trial.psf_sigma * side;
  const GratingResponse response (kPeriod, side, trial.psf_sigma * side);
  constexpr int kFractions = 256;
  std::vector<HomographyFit::Observation> known;
  for (int i = 0; i < kFractions; i++) {
    auto seen = information_at (response, (i + 0.5) / kFractions);
    for (double *number :
        {&seen.information, &seen.extra_information, &seen.cross})
      *number *= 9.0;
    known.push_back (seen);
  }
  const auto at_place = [&] (double place) {
    return known[std::size_t ((place - std::floor (place)) * kFractions)];
  };
  const CentredFrame frame (kMoireSize);
  const Homography centred = truth.centred ();
  HomographyFit fit;
  for (int y = 1; y < kMoireSize.height; y += 3)
    for (int x = 1; x < kMoireSize.width; x += 3) {
      const double xi = (x - frame.cx) / frame.r;
      const double eta = (y - frame.cy) / frame.r;
      const Projected m = project (centred, xi, eta);
      if (m.x + 0.5 < margin || m.y + 0.5 < margin ||
          m.x > kMoireSize.width - 0.5 - margin ||
          m.y > kMoireSize.height - 0.5 - margin)
        continue;
      fit.add (xi, eta, m, at_place (m.x), at_place (m.y));
    }
  return fit;
}

/* Standard deviations of mirror_at () that the covariance makes. */
Position
sigma_at (const Mapping &mapping, double x, double y)
{
  const Mapping::Covariance &covariance = *mapping.covariance ();
  constexpr std::size_t n = Mapping::kParameters;
  const CentredFrame f (mapping.camera ());
  const double xi = (x - f.cx) / f.r;
  const double eta = (y - f.cy) / f.r;
  const Projected p = project (mapping.homography (), x, y);
  const auto sigma = [&] (double mirror, std::size_t first) {
    std::array<double, n> gradient = {};
    gradient[first] = xi / p.z;
    gradient[first + 1] = eta / p.z;
    gradient[first + 2] = 1.0 / p.z;
    gradient[6] = -mirror * xi / p.z;
    gradient[7] = -mirror * eta / p.z;
    double variance = 0.0;
    for (std::size_t i = 0; i < n; i++)
      for (std::size_t j = 0; j < n; j++)
        variance += gradient[i] * covariance[i * n + j] * gradient[j];
    return std::sqrt (std::max (0.0, variance));
  };
  return {sigma (p.x, 0), sigma (p.y, 3)};
}

Deviation
stated_by (const Mapping &mapping)
{
  const Pose sigma = mapping.pose_sigma ();
  Deviation stated = {0.0, sigma.shift_x, sigma.shift_y,
      sigma.rotation * std::numbers::pi / 180.0, sigma.magnification};
  double squares = 0.0, count = 0.0;
  for (int y = 8; y < kMoireSize.height; y += 16)
    for (int x = 8; x < kMoireSize.width; x += 16) {
      if (!mapping.covers (mapping.mirror_at (x, y)))
        continue;
      const Position s = sigma_at (mapping, x, y);
      squares += s.x * s.x + s.y * s.y;
      count += 2.0;
    }
  stated.field = std::sqrt (squares / count);
  return stated;
}

/* The bound as the deviations that a mapping of that covariance states. */
Deviation
bound_of (const HomographyFit &fit, std::size_t numbers, const Mapping &truth)
{
  const auto step = fit.solve (numbers, true);
  if (!step)
    return {};
  Mapping::Covariance covariance = {};
  for (std::size_t i = 0; i < Mapping::kParameters; i++)
    for (std::size_t j = 0; j < Mapping::kParameters; j++)
      covariance[i * Mapping::kParameters + j] =
          step->covariance (Eigen::Index (i), Eigen::Index (j));
  const auto mapping =
      Mapping::make ({kMoireSize, kMoireSize, truth.homography (), covariance});
  return mapping ? stated_by (*mapping) : Deviation{};
}

Mapping
affine_truth (const Alignment &alignment)
{
  return *Mapping::make ({kMoireSize, kMoireSize,
      camera_to_mirrors (alignment, kMoireSize.width, kMoireSize.height)});
}

Result<CalibrationResult>
calibrate (const MoireTrial &trial, double &seconds)
{
  const auto patterns = calibration_patterns (kMoireSize, kPeriod);
  auto run = Calibration::make (kMoireSize, kMoireSize, patterns);
  if (!run)
    return run.error ();
  Lens lens = lens_of (trial);
  const Sensor sensor = sensor_of (trial);
  Image<std::uint8_t> mirrors (kMoireSize.width, kMoireSize.height);
  std::uint64_t number = 0;
  for (const Pattern &pattern : patterns) {
    for (int y = 0; y < mirrors.height (); y++)
      for (int x = 0; x < mirrors.width (); x++)
        mirrors.at (x, y) = pattern.on (x, y);
    const auto frame =
        expose (lens, sensor, std::as_const (mirrors).view (), number++);
    if (const auto added = run->add (pattern, frame.view ()); !added)
      return added.error ();
  }
  const auto start = std::chrono::steady_clock::now ();
  auto result = run->solve ();
  seconds =
      std::chrono::duration<double> (std::chrono::steady_clock::now () - start)
          .count ();
  return result;
}

} // namespace

Deviation
deviation_of (const std::function<Position (double, double)> &mapped,
    const Alignment &truth, double *worst)
{
  double squares = 0.0, count = 0.0, most = 0.0;
  for (int y = 0; y < kMoireSize.height; y += 5)
    for (int x = 0; x < kMoireSize.width; x += 5) {
      const Position m = mapped (x, y);
      const Position t = mirror_seen (
          truth, kMoireSize.width, kMoireSize.height, {double (x), double (y)});
      if (!Mapping (kMoireSize).covers (t))
        continue;
      const double dx = m.x - t.x, dy = m.y - t.y;
      squares += dx * dx + dy * dy;
      count += 2.0;
      most = std::max (most, std::hypot (dx, dy));
    }
  if (worst != nullptr)
    *worst = most;
  Deviation error;
  error.field = std::sqrt (squares / count);
  return error;
}

MoireOutcome
run_moire (const MoireTrial &trial)
{
  MoireOutcome outcome;
  const auto result = calibrate (trial, outcome.seconds);
  if (!result) {
    outcome.failure = result.error ().message;
    return outcome;
  }
  const Mapping &mapping = result->mapping;
  outcome.error = deviation_of (
      [&] (double x, double y) { return mapping.mirror_at (x, y); },
      trial.alignment, &outcome.worst);
  const Pose pose = mapping.pose ();
  outcome.error.shift_x = pose.shift_x - trial.alignment.shift_x;
  outcome.error.shift_y = pose.shift_y - trial.alignment.shift_y;
  outcome.error.rotation =
      (pose.rotation - trial.alignment.rotation) * std::numbers::pi / 180.0;
  outcome.error.scale = pose.magnification - trial.alignment.scale;
  outcome.stated = stated_by (mapping);
  outcome.displaced = mapping.displacement ().has_value ();
  const Mapping truth = affine_truth (trial.alignment);
  const HomographyFit fit = expected_fit (trial, truth);
  outcome.bound = bound_of (fit, 8, truth);
  outcome.affine_bound = bound_of (fit, 6, truth);
  return outcome;
}

Image<std::uint8_t>
moire_frame (const MoireTrial &trial, ImageView<const std::uint8_t> mirrors,
    std::uint64_t number)
{
  Lens lens = lens_of (trial);
  return expose (lens, sensor_of (trial), mirrors, number);
}

} // namespace codedexposure::quality
