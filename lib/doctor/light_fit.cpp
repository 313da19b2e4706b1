/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/light_fit.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "base/statistics.h"
#include "doctor/line_search.h"
#include "estimate/least_squares.h"

namespace codedexposure
{

namespace
{

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/** Residuals of that many standard deviations, and of that part of a period,
 * are of frames that show something else. */
constexpr double kOutlier = 6.0, kOtherMask = 1.0 / 64.0;
/** Squares that a line must explain, in those of noise: there are many thousand
 * frequencies to choose from. */
constexpr double kSurprise = 80.0;
/** Jitter, in periods, that is larger leaves some frames whole of runs that the
 * exposure cuts. */
constexpr double kAlike = 1.0 / 256.0;
/** Exposures that differ by less, in periods, do not tell what leaks. */
constexpr double kLonger = 0.1;
constexpr double kTiny = 1e-12;                      // DN^2
constexpr int kLines = 2;                            // at most
constexpr double kSlowest = 0.15, kFastest = 1200.0; // Hz
/** Weaker lines are those of noise, as a part of the light. */
constexpr double kFaintest = 5e-4;

/** A number of a model that is fitted, and a step for its derivative: into the
 * runs that begin or end with the exposure. */
struct Unknown {
  double *at;
  double step;
};

/** The fit in progress. */
class Fit
{
public:
  Fit (std::span<const LightSample> samples, LightModel model)
      : samples_ (samples.begin (), samples.end ()), model_ (std::move (model)),
        weights_ (VectorXd::Ones (Index (samples.size ())))
  {
    const auto [first, last] =
        std::ranges::minmax (samples_, {}, &LightSample::time);
    epoch_ = 0.5 * (first.time + last.time);
    span_ = std::max (last.time - first.time, model_.period);
    std::map<std::tuple<double, double, int>, std::vector<Index>> runs;
    for (std::size_t i = 0; i < samples_.size (); i++) {
      LightSample &sample = samples_[i];
      sample.time -= epoch_;
      runs[{sample.from, sample.until, sample.exposure}].push_back (Index (i));
    }
    for (auto &[run, frames] : runs)
      runs_.push_back (std::move (frames));
    model_.lines.clear ();
    model_.drift = 0.0;
  }

  LightFit run ()
  {
    LightFit fit;
    match (model_);
    scan_window ();
    solve (true);
    find_leak ();
    weigh ();
    for (int line = 0; line < kLines; line++) {
      if (!add_line (line == 0 ? &fit.spectrum : nullptr))
        break;
      weigh ();
      scan_window ();
      solve (true);
      find_leak ();
    }
    weigh ();
    solve (true);
    remember (fit);
    return fit;
  }

private:
  std::vector<Unknown> unknowns (LightModel &model) const
  {
    std::vector<Unknown> all = {
        {&model.gain, 1e-3 * std::abs (model.gain) + 1e-9},
        {&model.drift, 1e-6}};
    for (double &offset : model.offsets)
      all.push_back ({&offset, 1e-3});
    all.push_back ({&model.start, 1e-6 * model.period});
    for (double &length : model.lengths)
      all.push_back ({&length, -1e-6 * model.period});
    for (LightLine &line : model.lines) {
      all.push_back ({&line.frequency, 1e-3 / span_});
      all.push_back ({&line.cosine, 1e-6});
      all.push_back ({&line.sine, 1e-6});
    }
    return all;
  }

  /** No exposure begins before its trigger: what seems to do ends a period
   * later. No light is less than none. */
  void obey (LightModel &model) const
  {
    model.start = std::max (model.start, 0.0);
    for (LightLine &line : model.lines)
      if (const double depth = line.depth (); depth > 1.0) {
        line.cosine /= depth;
        line.sine /= depth;
      }
  }

  double match (LightModel &model) const
  {
    return model.match (samples_, {weights_.data (), samples_.size ()});
  }

  /** Start and ends, one after the other, in finer and finer steps: light bends
   * where they pass an end of a run, and solve () may stop there. */
  void scan_window ()
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

  /** Mirrors that are off pass more light in a longer exposure; jitter hides by
   * how much. */
  void find_leak ()
  {
    if (model_.lengths.size () < 2)
      return;
    const double longer = model_.lengths[1] - model_.lengths[0];
    const double more = model_.offsets[1] - model_.offsets[0];
    if (longer > kLonger * model_.period && model_.gain > 0.0 &&
        jitter ().value < kAlike * model_.period)
      model_.leak = std::clamp (more / (model_.gain * longer), 0.0, 1.0);
  }

  VectorXd residuals (const LightModel &model) const
  {
    VectorXd r (Index (samples_.size ()));
    for (Index i = 0; i < r.size (); i++) {
      const LightSample &sample = samples_[std::size_t (i)];
      r[i] = weights_[i] * (sample.light - model.light (sample));
    }
    return r;
  }

  /** The model as it is, or, if it @p moves, at the minimum. */
  Minimum solve (bool moves)
  {
    LightModel moved = model_;
    const std::vector<Unknown> all = unknowns (moved);
    VectorXd start (Index (all.size ())), steps (start.size ());
    for (Index i = 0; i < start.size (); i++) {
      start[i] = *all[std::size_t (i)].at;
      steps[i] = all[std::size_t (i)].step;
    }
    const Residuals residuals_at = [&] (const VectorXd &numbers) {
      for (Index i = 0; i < numbers.size (); i++)
        *all[std::size_t (i)].at = numbers[i];
      obey (moved);
      return residuals (moved);
    };
    if (!moves)
      return evaluate (residuals_at, start, steps);
    const Minimum found = minimise (residuals_at, start, steps);
    residuals_at (found.numbers);
    model_ = std::move (moved);
    return found;
  }

  double used () const { return double ((weights_.array () > 0.0).count ()); }

  /** Whether the light of @p sample depends on when the exposure begins. */
  bool is_cut (const LightSample &sample) const
  {
    const double step = 1e-7 * model_.period;
    LightModel later = model_;
    later.start += step;
    const double change = later.light (sample) - model_.light (sample);
    return std::abs (change) > 0.9 * model_.gain * step;
  }

  /** Frames of a run that scatter more than usual, or whose common error may be
   * larger, have less weight. Jitter scatters all runs that the exposure cuts
   * alike, and the few frames of one tell it badly. A frame that differs from
   * the others of its run by far, such as one of another mask, has none. */
  void weigh ()
  {
    weights_.setOnes ();
    const VectorXd r = residuals (model_);
    std::vector<double> middles, spreads, all, cut;
    for (const auto &run : runs_) {
      std::vector<double> values, aside;
      for (const Index i : run)
        values.push_back (r[i]);
      middles.push_back (median (values));
      for (const double value : values)
        aside.push_back (1.4826 * std::abs (value - middles.back ()));
      all.insert (all.end (), aside.begin (), aside.end ());
      if (is_cut (samples_[std::size_t (run.front ())]))
        cut.insert (cut.end (), aside.begin (), aside.end ());
      spreads.push_back (median (aside));
    }
    const double usual = std::max (median (all), 1e-9);
    double of_cut = cut.empty () ? 0.0 : median (cut);
    if (of_cut > kAlike * model_.period * model_.gain)
      of_cut = 0.0;
    const double far = kOtherMask * model_.period * model_.gain;
    for (std::size_t k = 0; k < runs_.size (); k++)
      for (const Index i : runs_[k]) {
        const LightSample &sample = samples_[std::size_t (i)];
        const double spread =
            std::max ({usual, spreads[k], is_cut (sample) ? of_cut : 0.0});
        const double doubt =
            sample.doubt * std::sqrt (double (runs_[k].size ()));
        weights_[i] =
            std::abs (r[i] - middles[k]) <= std::max (kOutlier * spread, far)
                ? usual / std::hypot (spread, doubt)
                : 0.0;
      }
  }

  /** Of what the frames of each run have in common, and of each frame. */
  struct Squares {
    double common = 0.0, single = 0.0;
    double shared = 0.0; // what rounding may add to the first
  };

  Squares squares_of (const VectorXd &residual) const
  {
    Squares squares;
    for (const auto &run : runs_) {
      double frames = 0.0, rest = 0.0, doubt = 0.0;
      for (const Index i : run) {
        frames += weights_[i] > 0.0;
        rest += weights_[i] > 0.0 ? residual[i] : 0.0;
        doubt += weights_[i] * samples_[std::size_t (i)].doubt;
      }
      squares.common += rest * rest / std::max (1.0, frames);
      squares.shared += doubt * doubt / std::max (1.0, frames);
    }
    squares.single = residual.squaredNorm () - squares.common;
    return squares;
  }

  /** The next line, if it explains more than noise would. */
  bool add_line (std::vector<Position> *spectrum)
  {
    LineSearch search;
    for (std::size_t i = 0; i < samples_.size (); i++) {
      const double weight = weights_[Index (i)], time = samples_[i].time;
      if (weight > 0.0) {
        const auto add = [&] (double part, double from, double until) {
          search.lit.push_back (
              {int (i), part * weight, time + from, time + until});
        };
        each_lit_time (model_, samples_[i],
            [&] (double from, double until) { add (1.0, from, until); });
        if (model_.leak > 0.0)
          add (model_.leak, model_.start,
              model_.start +
                  model_.lengths[std::size_t (samples_[i].exposure)]);
      }
    }
    const Minimum before = solve (false);
    search.residual = before.residuals / model_.gain;
    search.others = before.slopes;
    const LightLine line = search.strongest (kSlowest, kFastest, spectrum);
    missed_ = line.depth ();
    /* Two lines that are closer cannot be told from one line. */
    const auto is_near = [&] (const LightLine &other) {
      return std::abs (other.frequency - line.frequency) * span_ < 1.0;
    };
    if (line.depth () < kFaintest ||
        std::ranges::any_of (model_.lines, is_near))
      return false;

    const LightModel without = model_;
    const Squares least = squares_of (before.residuals);
    model_.lines.push_back (line);
    const Squares after = squares_of (solve (true).residuals);
    const double parameters = double (before.numbers.size () + 3);
    const double all = double (runs_.size ());
    const double runs = std::max (1.0, all - parameters);
    const double frames = std::max (1.0, used () - all);
    const double surprise =
        (least.common - after.common) /
            (std::max (after.common / runs, after.shared / all) + kTiny) +
        (least.single - after.single) / (after.single / frames + kTiny);
    if (surprise > kSurprise)
      return true;
    model_ = without;
    return false;
  }

  void remember (LightFit &fit)
  {
    const Minimum found = solve (false);
    const MatrixXd spread = covariance (found);
    /* In the order of unknowns (). */
    const auto exposures = Index (model_.lengths.size ());
    const auto known = [&] (double value, Index p) {
      return Measured{value, std::sqrt (spread (p, p))};
    };
    const auto edge = [&] (double value, Index p) {
      return known (value, 2 + exposures + p);
    };
    fit.model = model_;
    fit.epoch = epoch_;
    fit.drift = known (model_.drift, 1);
    fit.start = edge (model_.start, 0);
    for (Index e = 0; e < exposures; e++)
      fit.lengths.push_back (edge (model_.lengths[std::size_t (e)], 1 + e));
    Index p = found.numbers.size () - 3 * Index (model_.lines.size ());
    for (const LightLine &line : model_.lines) {
      const double depth = line.depth ();
      const Eigen::Vector2d part (line.cosine / depth, line.sine / depth);
      const double variance =
          part.dot (spread.block<2, 2> (p + 1, p + 1) * part);
      fit.lines.push_back (
          {known (line.frequency, p), {depth, std::sqrt (variance)}});
      p += 3;
    }
    std::ranges::sort (fit.lines, std::ranges::greater (),
        [] (const LightFit::Line &line) { return line.depth.value; });
    fit.faintest = std::clamp (missed_, kFaintest, 1.0);
    fit.jitter = jitter ();
  }

  /**
   * Of the parameters: from the scatter of single frames, or, where that is
   * more, from what the frames of each run have in common; and from rounding.
   */
  MatrixXd covariance (const Minimum &found) const
  {
    const Index count = found.numbers.size ();
    MatrixXd all =
        found.covariance *
        (found.squares () / std::max (1.0, used () - double (count)));
    MatrixXd common = MatrixXd::Zero (count, count), shared = common;
    double groups = 0.0;
    for (const auto &run : runs_) {
      VectorXd of_run = VectorXd::Zero (count), doubts = of_run;
      bool counts = false;
      for (const Index i : run) {
        const VectorXd pull =
            found.covariance * found.slopes.row (i).transpose ();
        of_run += pull * found.residuals[i];
        doubts += pull * weights_[i] * samples_[std::size_t (i)].doubt;
        counts |= weights_[i] > 0.0;
      }
      common += of_run * of_run.transpose ();
      shared += doubts * doubts.transpose ();
      groups += counts;
    }
    common *= groups / std::max (1.0, groups - double (count));
    for (Index p = 0; p < count; p++)
      if (common (p, p) > all (p, p)) {
        const double factor = std::sqrt (common (p, p) / all (p, p));
        all.row (p) *= factor;
        all.col (p) *= factor;
      }
    return all + shared;
  }

  /** Frames of runs that the exposure cuts scatter more if its start does. */
  Measured jitter () const
  {
    struct Variance {
      double free = 0.0, squares = 0.0;
      double value () const { return squares / free; }
      double variance () const { return 2.0 / free * value () * value (); }
    } cut, whole;
    for (const auto &run : runs_) {
      double frames = 0.0, sum = 0.0, squares = 0.0;
      bool cuts = false;
      for (const Index i : run) {
        const LightSample &sample = samples_[std::size_t (i)];
        const double seconds =
            (sample.light - model_.light (sample)) / model_.gain;
        if (weights_[i] == 0.0)
          continue;
        frames += 1.0;
        sum += seconds;
        squares += seconds * seconds;
        cuts = is_cut (sample);
      }
      Variance &of = cuts ? cut : whole;
      of.free += std::max (0.0, frames - 1.0);
      of.squares += squares - sum * sum / std::max (1.0, frames);
    }
    if (cut.free < 4.0 || whole.free < 4.0)
      return {};
    const double square = std::max (cut.value () - whole.value (), 0.0);
    const double doubt = std::sqrt (cut.variance () + whole.variance ());
    const double jitter = std::sqrt (square);
    return {jitter,
        std::min (std::sqrt (doubt), doubt / std::max (2.0 * jitter, 1e-12))};
  }

  std::vector<LightSample> samples_;
  /** Samples of each run: they share what is wrong with it. */
  std::vector<std::vector<Index>> runs_;
  LightModel model_;
  VectorXd weights_; // 0: left out
  double epoch_ = 0.0, span_ = 0.0;
  double missed_ = 0.0; // depth of the last line that was looked for
};

} // namespace

LightFit
fit_light (std::span<const LightSample> samples, const LightModel &guess)
{
  if (samples.empty ())
    return {.model = guess};
  return Fit (samples, guess).run ();
}

} // namespace codedexposure
