/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/light_fit.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include <Eigen/Core>

#include "doctor/line_search.h"
#include "doctor/solve.h"

namespace codedexposure
{

namespace
{

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTurn = 2.0 * std::numbers::pi;
/** Residuals of that many standard deviations, and of that part of a period,
 * are of frames that show something else. */
constexpr double kOutlier = 6.0, kOtherMask = 1.0 / 64.0;
/** Squares that a line must explain, in those of noise: there are many thousand
 * frequencies to choose from. */
constexpr double kSurprise = 80.0;
constexpr double kTiny = 1e-12; // DN^2

/** Frames of one run share what is wrong with it. */
using Run = std::tuple<double, double, int>;

Run
run_of (const LightSample &sample)
{
  return {sample.from, sample.until, sample.exposure};
}

double
median (std::vector<double> values)
{
  const auto middle = values.begin () + std::ptrdiff_t (values.size () / 2);
  std::ranges::nth_element (values, middle);
  return *middle;
}

/** The parameters of a model as a vector. */
class Parameters
{
public:
  Parameters (const LightModel &model, const LightQuestion &question)
      : window_ (question.window), exposures_ (Index (model.lengths.size ())),
        lines_ (Index (model.lines.size ()))
  {
  }

  Index gain () const { return 0; }
  Index drift () const { return 1; }
  Index offset (Index exposure) const { return 2 + exposure; }
  Index start () const { return 2 + exposures_; }
  Index length (Index exposure) const { return start () + 1 + exposure; }
  /** Frequency, cosine, sine. */
  Index line (Index i) const
  {
    return 2 + exposures_ + (window_ ? 1 + exposures_ : 0) + 3 * i;
  }
  Index count () const { return line (lines_); }
  bool window () const { return window_; }

  VectorXd from (const LightModel &model) const
  {
    VectorXd x (count ());
    x[gain ()] = model.gain;
    x[drift ()] = model.drift;
    for (Index e = 0; e < exposures_; e++) {
      x[offset (e)] = model.offsets[std::size_t (e)];
      if (window_)
        x[length (e)] = model.lengths[std::size_t (e)];
    }
    if (window_)
      x[start ()] = model.start;
    for (Index i = 0; i < lines_; i++) {
      const LightLine &one = model.lines[std::size_t (i)];
      x.segment (line (i), 3) << one.frequency, one.cosine, one.sine;
    }
    return x;
  }

  void to (const VectorXd &x, LightModel &model) const
  {
    model.gain = x[gain ()];
    model.drift = x[drift ()];
    for (Index e = 0; e < exposures_; e++) {
      model.offsets[std::size_t (e)] = x[offset (e)];
      if (window_)
        model.lengths[std::size_t (e)] = x[length (e)];
    }
    if (window_)
      model.start = x[start ()];
    for (Index i = 0; i < lines_; i++)
      model.lines[std::size_t (i)] = {
          x[line (i)], x[line (i) + 1], x[line (i) + 2]};
  }

  /** A step for a derivative: into the runs that begin or end with the
   * exposure. */
  double step (Index i, const LightModel &model, double span) const
  {
    if (i == gain ())
      return 1e-3 * std::abs (model.gain) + 1e-9;
    if (i == drift ())
      return 1e-6;
    if (i < start ())
      return 1e-3;
    if (i < line (0))
      return (i == start () ? 1e-6 : -1e-6) * model.period;
    return (i - line (0)) % 3 == 0 ? 1e-3 / span : 1e-6;
  }

private:
  bool window_;
  Index exposures_, lines_;
};

/** The fit in progress. */
class Fit
{
public:
  Fit (std::span<const LightSample> samples, LightModel model,
      const LightQuestion &question)
      : samples_ (samples.begin (), samples.end ()), model_ (std::move (model)),
        question_ (question),
        weights_ (VectorXd::Ones (Index (samples.size ())))
  {
    double first = samples_.front ().time, last = first;
    for (const LightSample &sample : samples_) {
      first = std::min (first, sample.time);
      last = std::max (last, sample.time);
    }
    epoch_ = 0.5 * (first + last);
    for (LightSample &sample : samples_)
      sample.time -= epoch_;
    span_ = std::max (last - first, model_.period);
    model_.lines.clear ();
    model_.drift = 0.0;
    model_.offsets.assign (model_.lengths.size (), 0.0);
  }

  LightFit run ();

private:
  void obey (LightModel &model) const;
  double match (LightModel &model) const;
  void scan_window ();
  VectorXd residuals (const LightModel &model) const;
  MatrixXd jacobian () const;
  double used () const { return double ((weights_.array () > 0.0).count ()); }
  void descend ();
  void weigh ();
  /** Of what the frames of each run have in common, and of each frame. */
  struct Squares {
    double common = 0.0, single = 0.0, runs = 0.0;
    double shared = 0.0; // what rounding may add to the first
  };
  Squares squares_of (const VectorXd &residual) const;
  bool add_line (std::vector<Position> *spectrum);
  void remember (LightFit &fit) const;
  MatrixXd covariance (const MatrixXd &jacobian, const MatrixXd &inverse,
      const VectorXd &residual) const;
  Measured jitter () const;

  std::vector<LightSample> samples_;
  LightModel model_;
  LightQuestion question_;
  VectorXd weights_; // 0: left out
  double epoch_ = 0.0, span_ = 0.0;
  double missed_ = 0.0; // depth of the last line that was looked for
};

/** No exposure begins before its trigger; what seems to do ends a period
 * later. */
void
Fit::obey (LightModel &model) const
{
  if (question_.window)
    model.start = std::max (model.start, 0.0);
}

/** Squares that remain with the best gain and offsets, which it sets. */
double
Fit::match (LightModel &model) const
{
  model.gain = 1.0;
  std::ranges::fill (model.offsets, 0.0);
  struct Sums {
    double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  };
  std::vector<Sums> sums (model.offsets.size ());
  for (std::size_t i = 0; i < samples_.size (); i++) {
    if (weights_[Index (i)] == 0.0)
      continue;
    const LightSample &sample = samples_[i];
    const double x = model.light (sample), y = sample.light;
    Sums &sum = sums[std::size_t (sample.exposure)];
    sum.n += 1.0;
    sum.x += x;
    sum.y += y;
    sum.xx += x * x;
    sum.xy += x * y;
  }
  double xx = 0.0, xy = 0.0;
  for (const Sums &sum : sums) {
    const double n = std::max (sum.n, 1.0);
    xx += sum.xx - sum.x * sum.x / n;
    xy += sum.xy - sum.x * sum.y / n;
  }
  model.gain = xx > 0.0 && xy > 0.0 ? xy / xx : 1.0;
  for (std::size_t e = 0; e < sums.size (); e++)
    model.offsets[e] =
        (sums[e].y - model.gain * sums[e].x) / std::max (sums[e].n, 1.0);
  return residuals (model).squaredNorm ();
}

/** Start and ends, one after the other, in finer and finer steps: light bends
 * where they pass an end of a run, and descend () may stop there. */
void
Fit::scan_window ()
{
  constexpr int kSteps = 20;
  for (const double range : {0.04, 0.04, 0.01, 0.002}) {
    for (std::size_t edge = 0; edge <= model_.lengths.size (); edge++) {
      const LightModel from = model_;
      double least = match (model_);
      for (int step = -kSteps; step <= kSteps; step++) {
        const double aside = range * model_.period * step / kSteps;
        LightModel moved = from;
        if (edge > 0)
          moved.lengths[edge - 1] += aside;
        else
          moved.start += aside;
        for (double &length : moved.lengths)
          length -= edge > 0 ? 0.0 : aside; // ends stay
        obey (moved);
        const double squares = match (moved);
        if (squares < least) {
          least = squares;
          model_ = moved;
        }
      }
    }
  }
}

VectorXd
Fit::residuals (const LightModel &model) const
{
  VectorXd r (Index (samples_.size ()));
  for (Index i = 0; i < r.size (); i++) {
    const LightSample &sample = samples_[std::size_t (i)];
    r[i] = weights_[i] * (sample.light - model.light (sample));
  }
  return r;
}

MatrixXd
Fit::jacobian () const
{
  const Parameters parameters (model_, question_);
  const VectorXd x = parameters.from (model_);
  MatrixXd j (Index (samples_.size ()), x.size ());
  LightModel moved = model_;
  const VectorXd here = residuals (model_);
  for (Index p = 0; p < x.size (); p++) {
    const double step = parameters.step (p, model_, span_);
    VectorXd aside = x;
    aside[p] += step;
    parameters.to (aside, moved);
    j.col (p) = (here - residuals (moved)) / step;
  }
  return j;
}

/** Levenberg and Marquardt, with steps of the size of the columns. */
void
Fit::descend ()
{
  const Parameters parameters (model_, question_);
  double damping = 1e-6;
  VectorXd r = residuals (model_);
  for (int round = 0; round < 40; round++) {
    const MatrixXd j = jacobian ();
    MatrixXd normal = normal_of (j);
    const VectorXd slope = j.transpose () * r;
    const VectorXd diagonal = normal.diagonal ();
    const VectorXd x = parameters.from (model_);
    bool better = false;
    double gained = 0.0;
    while (!better && damping < 1e6) {
      MatrixXd damped = normal;
      damped.diagonal () += damping * diagonal;
      damped.diagonal ().array () += 1e-300;
      LightModel moved = model_;
      parameters.to (x + solve_normal (damped, slope), moved);
      obey (moved);
      const VectorXd after = residuals (moved);
      better = after.squaredNorm () < r.squaredNorm ();
      if (better) {
        gained = 1.0 - after.squaredNorm () / r.squaredNorm ();
        model_ = std::move (moved);
        r = after;
        damping = std::max (damping * 0.1, 1e-12);
      } else {
        damping *= 10.0;
      }
    }
    if (!better || gained < 1e-9)
      return;
  }
}

/** Frames of a run that scatter more than usual, or whose common error may be
 * larger, have less weight. A frame that differs from the others of its run by
 * far, such as one of another mask, has none. */
void
Fit::weigh ()
{
  weights_.setOnes ();
  const VectorXd r = residuals (model_);
  std::map<Run, std::vector<double>> runs;
  for (Index i = 0; i < r.size (); i++)
    runs[run_of (samples_[std::size_t (i)])].push_back (r[i]);
  struct Usual {
    double middle = 0.0, spread = 0.0, frames = 0.0;
  };
  std::map<Run, Usual> usual_of;
  std::vector<double> all;
  for (const auto &[run, values] : runs) {
    const double middle = median (values);
    std::vector<double> aside;
    for (const double value : values)
      aside.push_back (1.4826 * std::abs (value - middle));
    all.insert (all.end (), aside.begin (), aside.end ());
    usual_of[run] = {middle, median (aside), double (values.size ())};
  }
  const double usual = std::max (median (all), 1e-9);
  const double far = kOtherMask * model_.period * model_.gain;
  for (Index i = 0; i < r.size (); i++) {
    const LightSample &sample = samples_[std::size_t (i)];
    const Usual &run = usual_of[run_of (sample)];
    const double spread = std::max (usual, run.spread);
    const double aside = std::abs (r[i] - run.middle);
    weights_[i] =
        aside <= std::max (kOutlier * spread, far)
            ? usual / std::hypot (spread, sample.doubt * std::sqrt (run.frames))
            : 0.0;
  }
}

Fit::Squares
Fit::squares_of (const VectorXd &residual) const
{
  struct Sums {
    double frames = 0.0, residual = 0.0, doubt = 0.0;
  };
  std::map<Run, Sums> runs;
  for (Index i = 0; i < residual.size (); i++)
    if (weights_[i] > 0.0) {
      const LightSample &sample = samples_[std::size_t (i)];
      Sums &sums = runs[run_of (sample)];
      sums.frames += 1.0;
      sums.residual += residual[i];
      sums.doubt += weights_[i] * sample.doubt;
    }
  Squares squares;
  squares.runs = double (runs.size ());
  for (const auto &[run, sums] : runs) {
    squares.common += sums.residual * sums.residual / sums.frames;
    squares.shared += sums.doubt * sums.doubt / sums.frames;
  }
  squares.single = residual.squaredNorm () - squares.common;
  return squares;
}

/** The next line, if it explains more than noise would. */
bool
Fit::add_line (std::vector<Position> *spectrum)
{
  LineSearch search;
  for (std::size_t i = 0; i < samples_.size (); i++)
    for (int cycle = -1; cycle <= 2 && weights_[Index (i)] > 0.0; cycle++) {
      const LightSample &sample = samples_[i];
      const double length = model_.lengths[std::size_t (sample.exposure)];
      const double from =
          std::max (sample.from + cycle * model_.period, model_.start);
      const double until = std::min (
          sample.until + cycle * model_.period, model_.start + length);
      if (until > from)
        search.lit.push_back ({int (i), weights_[Index (i)], sample.time + from,
            sample.time + until});
    }
  const VectorXd before = residuals (model_);
  const VectorXd seconds = before / model_.gain;
  search.residual.assign (seconds.begin (), seconds.end ());
  const MatrixXd columns = jacobian ();
  for (Index p = 0; p < columns.cols (); p++)
    search.others.emplace_back (
        columns.col (p).begin (), columns.col (p).end ());
  const LightLine line =
      search.strongest (question_.slowest, question_.fastest, spectrum);
  missed_ = line.depth ();
  if (line.depth () < question_.faintest)
    return false;

  const LightModel without = model_;
  const Squares least = squares_of (before);
  model_.lines.push_back (line);
  descend ();
  const Squares after = squares_of (residuals (model_));
  const double parameters = double (columns.cols () + 3);
  const double runs = std::max (1.0, after.runs - parameters);
  const double frames = std::max (1.0, used () - after.runs);
  const double surprise =
      (least.common - after.common) /
          (std::max (after.common / runs, after.shared / after.runs) + kTiny) +
      (least.single - after.single) / (after.single / frames + kTiny);
  if (surprise > kSurprise && model_.lines.back ().depth () < 1.0)
    return true;
  model_ = without;
  return false;
}

/**
 * Of the parameters: from the scatter of single frames, or, where that is more,
 * from what the frames of each run have in common; and from rounding.
 */
MatrixXd
Fit::covariance (const MatrixXd &jacobian, const MatrixXd &inverse,
    const VectorXd &residual) const
{
  const double free = std::max (1.0, used () - double (jacobian.cols ()));
  const MatrixXd single = inverse * (residual.squaredNorm () / free);
  struct Pull {
    VectorXd common, shared;
  };
  std::map<Run, Pull> runs;
  for (Index i = 0; i < jacobian.rows (); i++) {
    const LightSample &sample = samples_[std::size_t (i)];
    Pull &run = runs[run_of (sample)];
    if (run.common.size () == 0)
      run.common = run.shared = VectorXd::Zero (jacobian.cols ());
    const VectorXd pull = inverse * jacobian.row (i).transpose ();
    run.common += pull * residual[i];
    run.shared += pull * weights_[i] * sample.doubt;
  }
  MatrixXd common = MatrixXd::Zero (inverse.rows (), inverse.cols ());
  MatrixXd shared = common;
  for (const auto &[key, run] : runs) {
    common += run.common * run.common.transpose ();
    shared += run.shared * run.shared.transpose ();
  }
  const double groups = double (runs.size ());
  common *= groups / std::max (1.0, groups - double (jacobian.cols ()));
  MatrixXd all = single;
  for (Index p = 0; p < all.rows (); p++)
    if (common (p, p) > single (p, p)) {
      const double factor = std::sqrt (common (p, p) / single (p, p));
      all.row (p) *= factor;
      all.col (p) *= factor;
    }
  return all + shared;
}

/** Frames of runs that the exposure cuts scatter more if its start does. */
Measured
Fit::jitter () const
{
  LightModel later = model_;
  later.start += 1e-7 * model_.period;
  struct Scatter {
    double frames = 0.0, sum = 0.0, squares = 0.0;
    bool cut = false;
  };
  std::map<Run, Scatter> runs;
  for (Index i = 0; i < weights_.size (); i++) {
    if (weights_[i] == 0.0)
      continue;
    const LightSample &sample = samples_[std::size_t (i)];
    const double light = model_.light (sample);
    const double seconds = (sample.light - light) / model_.gain;
    const double moved = (later.light (sample) - light) / model_.gain /
                         (later.start - model_.start);
    Scatter &run = runs[run_of (sample)];
    run.frames += 1.0;
    run.sum += seconds;
    run.squares += seconds * seconds;
    run.cut = std::abs (moved) > 0.9;
  }
  struct Variance {
    double free = 0.0, squares = 0.0;
    double value () const { return squares / free; }
    double variance () const { return 2.0 / free * value () * value (); }
  } cut, whole;
  for (const auto &[run, scatter] : runs) {
    Variance &sum = scatter.cut ? cut : whole;
    sum.free += scatter.frames - 1.0;
    sum.squares += scatter.squares - scatter.sum * scatter.sum / scatter.frames;
  }
  if (cut.free < 4.0 || whole.free < 4.0)
    return {};
  const double square = std::max (cut.value () - whole.value (), 0.0);
  const double doubt = std::sqrt (cut.variance () + whole.variance ());
  const double jitter = std::sqrt (square);
  return {jitter,
      std::min (std::sqrt (doubt), doubt / std::max (2.0 * jitter, 1e-12))};
}

void
Fit::remember (LightFit &fit) const
{
  const Parameters parameters (model_, question_);
  const VectorXd residual = residuals (model_);
  const MatrixXd j = jacobian ();
  const VectorXd scale = j.colwise ().norm ().cwiseMax (1e-300).cwiseInverse ();
  const MatrixXd even = j * scale.asDiagonal ();
  const MatrixXd inverse = scale.asDiagonal () *
                           pseudo_inverse_of (normal_of (even)) *
                           scale.asDiagonal ();
  const MatrixXd spread = covariance (j, inverse, residual);
  const auto sigma = [&] (Index p) { return std::sqrt (spread (p, p)); };

  fit.model = model_;
  fit.epoch = epoch_;
  fit.drift = {model_.drift, sigma (parameters.drift ())};
  fit.start = {model_.start, 0.0};
  if (question_.window)
    fit.start.sigma = sigma (parameters.start ());
  for (std::size_t e = 0; e < model_.lengths.size (); e++)
    fit.lengths.push_back ({model_.lengths[e],
        question_.window ? sigma (parameters.length (Index (e))) : 0.0});
  for (std::size_t i = 0; i < model_.lines.size (); i++) {
    const LightLine &line = model_.lines[i];
    const Index p = parameters.line (Index (i));
    const double depth = line.depth ();
    const double a = line.cosine / depth, b = line.sine / depth;
    const double variance = a * a * spread (p + 1, p + 1) +
                            2.0 * a * b * spread (p + 1, p + 2) +
                            b * b * spread (p + 2, p + 2);
    fit.lines.push_back (
        {{line.frequency, sigma (p)}, {depth, std::sqrt (variance)}});
  }
  std::ranges::sort (fit.lines, std::ranges::greater (),
      [] (const LightFit::Line &line) { return line.depth.value; });
  const double free = std::max (1.0, used () - double (j.cols ()));
  fit.residual = residual.norm () / std::sqrt (free) / model_.gain;
  fit.faintest = std::clamp (missed_, question_.faintest, 1.0);
  fit.rejected = int (double (samples_.size ()) - used ());
  if (question_.window)
    fit.jitter = jitter ();
}

LightFit
Fit::run ()
{
  LightFit fit;
  match (model_);
  if (question_.window)
    scan_window ();
  descend ();
  weigh ();
  for (int line = 0; line < question_.lines; line++) {
    if (!add_line (line == 0 ? &fit.spectrum : nullptr))
      break;
    weigh ();
    if (question_.window)
      scan_window ();
    descend ();
  }
  weigh ();
  descend ();
  remember (fit);
  return fit;
}

} // namespace

double
LightLine::depth () const
{
  return std::hypot (cosine, sine);
}

double
LightModel::light (const LightSample &sample) const
{
  const auto exposure = std::size_t (sample.exposure);
  const double end = start + lengths[exposure];
  double seconds = 0.0;
  for (int cycle = -1; cycle <= 2; cycle++) {
    const double from = std::max (sample.from + cycle * period, start);
    const double until = std::min (sample.until + cycle * period, end);
    if (until <= from)
      continue;
    const double half = 0.5 * (until - from);
    const double middle = sample.time + from + half;
    double even = 1.0 + drift * middle;
    for (const LightLine &line : lines) {
      const double turn = kTurn * line.frequency;
      const double damp =
          turn * half > 1e-9 ? std::sin (turn * half) / (turn * half) : 1.0;
      even += damp * (line.cosine * std::cos (turn * middle) +
                         line.sine * std::sin (turn * middle));
    }
    seconds += 2.0 * half * even;
  }
  return offsets[exposure] + gain * seconds;
}

LightFit
fit_light (std::span<const LightSample> samples, const LightModel &guess,
    const LightQuestion &question)
{
  if (samples.empty ())
    return {.model = guess};
  return Fit (samples, guess, question).run ();
}

} // namespace codedexposure
