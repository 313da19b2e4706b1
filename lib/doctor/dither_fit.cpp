/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include <algorithm>
#include <array>
#include <cmath>

#include "doctor/dither.h"
#include "doctor/rounding.h"
#include "estimate/least_squares.h"

namespace codedexposure
{

namespace
{

constexpr int kRounds = 4; // of weights
/* Black levels of pixels: standard deviations of a Gaussian, and their weights.
 * With a larger spread, these would not be dense enough. */
constexpr std::array kOffsets = {
    -2.4, -1.8, -1.2, -0.6, 0.0, 0.6, 1.2, 1.8, 2.4};
constexpr std::array kWeights = {
    0.0137, 0.0480, 0.1179, 0.2023, 0.2362, 0.2023, 0.1179, 0.0480, 0.0137};
constexpr double kMostSpread = 0.2; // DN
/* Light of a look is known to this part: from the response of the sensor, but
 * for flicker and the microseconds in which controllers count. */
constexpr double kLightError = 0.01;
/* What is left of errors of the model: DN of the black level, and part of the
 * shot noise of half a DN. */
constexpr double kBlackError = 0.001, kShotError = 0.008;

/* What is fitted; then the factor of light of each look. */
enum Number : Eigen::Index {
  kBlack,
  kOff,
  kVariance,
  kSpread,
  kPerGain, // variance of a DN of light
  kLooks
};
using Numbers = Eigen::VectorXd;

/** What groups are expected to show, and how well they show it. */
class Model
{
public:
  Model (
      const std::vector<DitherGroup> &groups, double part, const Measured &gain)
      : groups_ (groups), part_ (part), per_gain_ (1.0 / gain.value),
        per_gain_sigma_ (gain.sigma / (gain.value * gain.value)),
        expected_ (groups.size ())
  {
    for (const DitherGroup &group : groups)
      looks_ = std::max (looks_, group.look + 1);
  }

  Eigen::Index count () const { return kLooks + looks_; }
  double freedom () const
  {
    return double (2 * groups_.size () + 1) + looks_ - double (count ());
  }

  Numbers start (std::optional<double> off) const
  {
    /* Means over many groups are hardly rounded. */
    double dark[2] = {}, pixels[2] = {};
    for (const DitherGroup &group : groups_) {
      dark[group.longer] += (group.mean - group.light) * group.pixels;
      pixels[group.longer] += group.pixels;
    }
    const double shorter = dark[0] / std::max (1.0, pixels[0]);
    const double longer = dark[1] / std::max (1.0, pixels[1]);
    Numbers n = Numbers::Ones (count ());
    n[kOff] = off.value_or (std::max (0.0, (longer - shorter) / (1.0 - part_)));
    n[kBlack] = shorter - part_ * n[kOff];
    n[kVariance] = 0.01;
    n[kSpread] = 0.02;
    n[kPerGain] = per_gain_;
    return n;
  }

  /** Sets the errors of mean and variance from what @p n expects. */
  void weigh (const Numbers &n)
  {
    errors_.clear ();
    for (std::size_t g = 0; g < groups_.size (); g++) {
      const DitherGroup &group = groups_[g];
      const RoundedMoments &e = expected (g, n);
      const double values = group.pixels * group.frames;
      const double square = e.variance * e.variance;
      const double one = 1.0 / values; // a single value that differs
      const double of_variance =
          std::max (0.0, e.fourth - square) + 2.0 * square / (group.frames - 1);
      errors_.emplace_back (std::sqrt (std::max (group.spread / group.pixels,
                                           e.variance / values) +
                                       one * one),
          std::sqrt (of_variance / values + one * one));
    }
  }

  /** By their errors: means, variances, the gain, and light of looks. */
  Eigen::VectorXd residuals (const Numbers &n) const
  {
    Eigen::VectorXd rest (Eigen::Index (2 * groups_.size () + 1) + looks_);
    Eigen::Index i = 0;
    for (std::size_t g = 0; g < groups_.size (); g++) {
      const RoundedMoments &e = expected (g, n);
      rest[i++] = (groups_[g].mean - e.mean) / errors_[g].first;
      rest[i++] = (groups_[g].variance - e.variance) / errors_[g].second;
    }
    rest[i++] = (per_gain_ - n[kPerGain]) / per_gain_sigma_;
    for (int look = 0; look < looks_; look++)
      rest[i++] = (1.0 - n[kLooks + look]) / kLightError;
    return rest;
  }

private:
  /* What moments depend on: mean, sigma, third moment, spread. */
  using Causes = std::array<double, 4>;
  struct Expected {
    Causes causes;
    RoundedMoments moments;
  };

  /* Light of a look does nothing to the groups of others. */
  const RoundedMoments &expected (std::size_t group, const Numbers &n) const
  {
    const Causes causes = causes_of (groups_[group], n);
    auto &[last, before] = expected_[group];
    if (last.causes != causes) {
      std::swap (last, before);
      if (last.causes != causes)
        last = {causes, moments_of (causes)};
    }
    return last.moments;
  }

  Causes causes_of (const DitherGroup &group, const Numbers &n) const
  {
    const double light = n[kLooks + group.look] * group.light +
                         (group.longer ? 1.0 : part_) * group.field * n[kOff];
    const double shot = std::max (0.0, light) * n[kPerGain];
    return {n[kBlack] + light, std::sqrt (std::max (1e-6, n[kVariance] + shot)),
        shot * n[kPerGain], std::clamp (n[kSpread], 0.0, kMostSpread)};
  }

  static RoundedMoments moments_of (const Causes &causes)
  {
    const auto [mean, sigma, third, spread] = causes;
    RoundedMoments sum;
    for (std::size_t i = 0; i < kOffsets.size (); i++) {
      const RoundedMoments one =
          rounded_moments (mean + kOffsets[i] * spread, sigma, third);
      sum.mean += kWeights[i] * one.mean;
      sum.variance += kWeights[i] * one.variance;
      sum.fourth += kWeights[i] * one.fourth;
    }
    return sum;
  }

  const std::vector<DitherGroup> &groups_;
  double part_, per_gain_, per_gain_sigma_;
  int looks_ = 0;
  std::vector<std::pair<double, double>> errors_;
  mutable std::vector<std::array<Expected, 2>> expected_; // the last of each
};

} // namespace

std::optional<Dark>
fit_dither (const std::vector<DitherGroup> &groups, double part,
    const Measured &gain, std::optional<double> off)
{
  Model model (groups, part, gain);
  if (model.freedom () < 1.0 || !(gain.value > 0.0))
    return std::nullopt;
  Numbers n = model.start (off);
  const auto residuals = [&] (const Numbers &numbers) {
    return model.residuals (numbers);
  };
  Minimum found;
  for (int round = 0; round < kRounds; round++) {
    model.weigh (n);
    found = minimise (residuals, n, 1e-5 * n.cwiseAbs ().cwiseMax (0.02));
    n = found.numbers;
  }
  if (!n.allFinite () || !found.covariance.allFinite ())
    return std::nullopt;
  const Eigen::MatrixXd covariance =
      std::max (1.0, found.squares () / model.freedom ()) * found.covariance;
  const auto measured = [&] (Number i) {
    return Measured{n[i], std::sqrt (std::max (0.0, covariance (i, i)))};
  };
  const auto doubted = [] (const Measured &number, double more) {
    return Measured{number.value, std::hypot (number.sigma, more)};
  };
  return Dark{doubted (measured (kBlack), kBlackError),
      doubted (measured (kOff), kBlackError),
      doubted (measured (kVariance), kShotError * 0.5 / gain.value)};
}

} // namespace codedexposure
