/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Accuracy of calibrations on the simulated bench: the tables of
 * docs/calibration.md. */
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <random>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "moire_rivals.h"
#include "moire_trial.h"

using namespace codedexposure;
using namespace codedexposure::quality;

namespace
{

/* Required accuracy of calibrations. */
constexpr double kOfBound = 1.3;
constexpr double kEverywhere = 2e-4;
constexpr double kDistorted = 5e-3;
constexpr double kWrongPeriod = 1.0;

enum class Kind { any, near, distorted };

struct Draw {
  std::mt19937_64 random;

  double between (double low, double high)
  {
    return std::uniform_real_distribution<double> (low, high) (random);
  }
  MoireTrial trial (Kind kind, std::uint64_t seed);
};

MoireTrial
Draw::trial (Kind kind, std::uint64_t seed)
{
  MoireTrial trial;
  trial.seed = seed;
  trial.alignment.shift_x = between (-40.0, 40.0);
  trial.alignment.shift_y = between (-40.0, 40.0);
  const double near = 5e-4;
  trial.alignment.rotation = kind == Kind::near
                                 ? between (-near, near) * 180.0 / M_PI
                                 : between (-2.0, 2.0);
  trial.alignment.scale = 1.0 + (kind == Kind::near ? between (-near, near)
                                                    : between (-0.02, 0.02));
  trial.psf_sigma = between (0.3, 1.0);
  if (kind == Kind::distorted)
    trial.alignment.distortion = 0.002;
  return trial;
}

/* Sums over the runs of one kind. */
struct Tally {
  int runs = 0, failures = 0, wrong_periods = 0, displaced = 0;
  double field = 0, rotation = 0, scale = 0; // squares of errors
  double bound_field = 0, bound_rotation = 0, bound_scale = 0;
  double affine_field = 0;
  double of_bound = 0, most_field = 0, worst = 0, seconds = 0;
  int stated = 0, within_1 = 0, within_2 = 0;

  void add (const MoireOutcome &outcome);
  bool print (const char *name, Kind kind) const;
};

void
Tally::add (const MoireOutcome &o)
{
  runs++;
  if (!o.failure.empty ()) {
    failures++;
    std::cerr << o.failure << '\n';
    return;
  }
  wrong_periods += o.worst > kWrongPeriod;
  displaced += o.displaced;
  field += o.error.field * o.error.field;
  rotation += o.error.rotation * o.error.rotation;
  scale += o.error.scale * o.error.scale;
  bound_field += o.bound.field * o.bound.field;
  bound_rotation += o.bound.rotation * o.bound.rotation;
  bound_scale += o.bound.scale * o.bound.scale;
  affine_field += o.affine_bound.field * o.affine_bound.field;
  of_bound += std::pow (o.error.field / o.bound.field, 2);
  most_field = std::max (most_field, o.error.field);
  worst = std::max (worst, o.worst);
  seconds += o.seconds;
  for (const auto &[error, sigma] :
      {std::pair (o.error.shift_x, o.stated.shift_x),
          std::pair (o.error.shift_y, o.stated.shift_y),
          std::pair (o.error.rotation, o.stated.rotation),
          std::pair (o.error.scale, o.stated.scale)}) {
    stated++;
    within_1 += std::abs (error) <= sigma;
    within_2 += std::abs (error) <= 2.0 * sigma;
  }
}

/* A share of @p n and its standard deviation agree with @p expected. */
bool
covers (int hits, int n, double expected)
{
  const double deviation = std::sqrt (expected * (1.0 - expected) / n);
  return double (hits) / n > expected - 3.0 * deviation;
}

/* False where a target is missed. */
bool
Tally::print (const char *name, Kind kind) const
{
  const double n = std::max (1, runs - failures);
  const auto rms = [n] (double squares) { return std::sqrt (squares / n); };
  const double ratio = rms (of_bound);
  std::printf ("%s: %d runs, %d failed, %d with a wrong period, %d with a "
               "displacement grid, %.2f s each\n",
      name, runs, failures, wrong_periods, displaced, seconds / n);
  std::printf ("  field    rms %.2e px  bound %.2e (affine %.2e)  each run of "
               "its bound %.2f\n"
               "           largest rms of a run %.2e px, largest error of a "
               "pixel %.2e px\n",
      rms (field), rms (bound_field), rms (affine_field), ratio, most_field,
      worst);
  std::printf ("  rotation rms %.2e rad bound %.2e  of it %.2f\n",
      rms (rotation), rms (bound_rotation),
      std::sqrt (rotation / bound_rotation));
  std::printf ("  scale    rms %.2e     bound %.2e  of it %.2f\n", rms (scale),
      rms (bound_scale), std::sqrt (scale / bound_scale));
  bool good = failures == 0 && wrong_periods == 0;
  if (kind != Kind::distorted) {
    std::printf (
        "  stated uncertainties: %.1f %% of errors within one, %.1f %% "
        "within two\n",
        100.0 * within_1 / stated, 100.0 * within_2 / stated);
    good = good && most_field <= kEverywhere &&
           covers (within_1, stated, 0.683) && covers (within_2, stated, 0.954);
  } else {
    good = good && most_field <= kDistorted;
  }
  /* Eight numbers each: a few runs scatter. */
  const double scatter = runs < 50 ? 1.0 + 2.0 / std::sqrt (16.0 * n) : 1.0;
  if (kind == Kind::any)
    good = good && ratio <= kOfBound * scatter;
  std::printf ("  %s\n", good ? "all targets are met" : "A TARGET IS MISSED");
  std::fflush (stdout);
  return good;
}

bool
run_kind (
    const char *name, Kind kind, int runs, std::uint64_t seed, bool chatty)
{
  Draw draw{std::mt19937_64 (seed + std::uint64_t (kind))};
  Tally tally;
  for (int i = 0; i < runs; i++) {
    const MoireTrial trial = draw.trial (kind, seed + 1000 * std::uint64_t (i));
    const MoireOutcome o = run_moire (trial);
    tally.add (o);
    if (chatty)
      std::printf ("  shift %7.2f %7.2f turn %6.3f scale %.4f blur %.2f: rms "
                   "%.2e of %.2e\n",
          trial.alignment.shift_x, trial.alignment.shift_y,
          trial.alignment.rotation, trial.alignment.scale, trial.psf_sigma,
          o.error.field, o.bound.field);
  }
  return runs == 0 || tally.print (name, kind);
}

} // namespace

int
main (int argc, char **argv)
{
  CLI::App app ("Accuracy of calibrations on the simulated bench");
  int any = 200, near = 50, distorted = 10, rivals = 5;
  std::uint64_t seed = 1;
  bool chatty = false;
  app.add_option ("--any", any, "alignments within 2 degrees, 2 %, 40 pixels");
  app.add_option ("--near", near, "alignments within 5e-4 of 1:1");
  app.add_option ("--distorted", distorted, "with 0.2 % of lens distortion");
  app.add_option ("--rivals", rivals, "runs of OpenCV's methods");
  app.add_option ("--seed", seed, "of the alignments and the noise");
  app.add_flag ("--each", chatty, "a line for each run");
  CLI11_PARSE (app, argc, argv);

  bool good = run_kind ("any alignment", Kind::any, any, seed, chatty);
  good = run_kind ("near 1:1", Kind::near, near, seed, chatty) && good;
  good = run_kind ("lens distortion of 0.2 %", Kind::distorted, distorted, seed,
             chatty) &&
         good;
  Draw draw{std::mt19937_64 (seed)};
  std::vector<MoireTrial> trials;
  for (int i = 0; i < rivals; i++)
    trials.push_back (draw.trial (Kind::any, seed + 1000 * std::uint64_t (i)));
  print_rivals (trials);
  return good ? 0 : 1;
}
