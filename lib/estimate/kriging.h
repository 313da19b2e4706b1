/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The best linear estimate of what was not measured from what was, by their
 * covariances (kriging, or Wiener filtering). */
#pragma once

#include <span>
#include <vector>

#include "estimate/covariance.h"

namespace codedexposure
{

/**
 * The equations for weights of m taps that estimate several targets with the
 * least mean squared error. All covariances have the same unit; all numbers are
 * finite.
 */
struct KrigingSystem {
  /** Of the taps with each other, without noise, m x m, row by row. Only the
   * upper triangle is read. */
  std::vector<double> covariance;
  std::vector<double> noise; ///< variance of each tap's noise
  /** Covariances of the taps with each target, target after target. */
  std::vector<double> targets;
  /** Ordinary kriging, where the mean of the scene is not known: what each tap
   * and each target is in flat light. Empty: simple kriging, where values are
   * differences from a known mean. */
  std::vector<double> flat = {};
  std::vector<double> flat_targets = {};
};

/**
 * Weights of the taps, target after target. With C the covariance of the taps
 * with its noise, c theirs with a target and f the taps in flat light:
 *
 *   simple:    w = C^-1 c
 *   ordinary:  w = C^-1 (c + lambda f) such that f w is the target in flat
 *              light, so that flat light is kept
 *
 * Where rounding leaves C without a Cholesky factor, all taps get more noise,
 * at first 1e-12 of their mean variance and then ten times as much at a time,
 * until it has one.
 */
std::vector<double> solve_kriging (const KrigingSystem &system);

/** The equations of some taps, without targets. */
KrigingSystem equations_of (
    const KrigingSystem &system, std::span<const int> taps);

/** Taps that are used together, by their numbers; no second one if it is
 * negative. */
struct TapPair {
  int first, second;
};

/**
 * Kriging with few taps. Pairs of taps are added one by one, each time the one
 * that lowers the expected squared error of a target most, until it is close
 * enough to the error with all taps; one at least. As the pairs are known, the
 * weights are those of solve_kriging () for their taps; all others are 0.
 */
class SparseKriging
{
public:
  /** Of @p system, only the equations of taps are used. */
  SparseKriging (KrigingSystem system, std::vector<TapPair> pairs);

  /** Weights of the taps for a target.
   * @p target    its covariances with the taps.
   * @p flat      what it is in flat light; not for simple kriging.
   * @p variance  its own one.
   * @p excess    squared error that is accepted beyond that with all taps, as
   *              a part of it. */
  std::vector<double> solve (std::span<const double> target, double flat,
      double variance, double excess) const;

private:
  struct Search;

  KrigingSystem system_;
  std::vector<TapPair> pairs_;
  double flat_variance_;       ///< of the unknown mean
  std::vector<double> matrix_; ///< of the taps, noise and mean included
};

/** Simple kriging of the light of each slot at (0, 0).
 *  @p taps      places of coded pixels.
 *  @p elements  of each tap.
 *  @p noise     variance of each element in units of the scene's variance. */
KrigingSystem slot_equations (const CodedCovariance &covariance,
    std::span<const Offset> taps, std::span<const int> elements,
    std::span<const double> noise);

/** The places within @p radius px, row by row. */
std::vector<Offset> disc (double radius);

} // namespace codedexposure
