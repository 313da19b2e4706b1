/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/line_search.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <numbers>

#include "estimate/least_squares.h"

namespace codedexposure
{

namespace
{

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTurn = 2.0 * std::numbers::pi;
/** Frequencies in the width of a line. */
constexpr double kDensity = 3.0;
/** Peaks of the quick search that are fitted beside all else. */
constexpr std::size_t kPeaks = 40;

/** A frequency and how much of the squared residual it explains. */
struct Peak {
  double frequency = 0.0, power = 0.0;
};

/** cos t and sin t with weights, by least squares: the amplitudes, and the part
 * of the squares that they explain. */
struct Amplitudes {
  double cosine = 0.0, sine = 0.0, power = 0.0;
};

Amplitudes
solve (double cc, double cs, double ss, double rc, double rs)
{
  const double det = cc * ss - cs * cs;
  if (!(det > 1e-9 * cc * ss))
    return {};
  const double a = (rc * ss - rs * cs) / det, b = (rs * cc - rc * cs) / det;
  return {a, b, a * rc + b * rs};
}

/** Frequencies that are looked at together. */
constexpr int kLanes = 4;
using Lanes = Eigen::Array<double, kLanes, 1>;

/** The turns of one time, at kLanes frequencies. */
struct Turns {
  Lanes cosine = Lanes::Zero (), sine = Lanes::Zero ();

  void turn (std::complex<double> by)
  {
    const Lanes was = cosine;
    cosine = was * by.real () - sine * by.imag ();
    sine = was * by.imag () + sine * by.real ();
  }

  void add (double weight, const Turns &middle, const Lanes &half)
  {
    const Lanes light = weight * half;
    cosine += light * middle.cosine;
    sine += light * middle.sine;
  }
};

/** Sums over the samples of the light of a line and of the residual. */
struct Sums {
  Lanes cc = Lanes::Zero (), cs = cc, ss = cc, rc = cc, rs = cc;

  void add (const Turns &light, double residual)
  {
    cc += light.cosine * light.cosine;
    cs += light.cosine * light.sine;
    ss += light.sine * light.sine;
    rc += residual * light.cosine;
    rs += residual * light.sine;
  }
};

/** Light of a line in each sample, at growing frequencies. */
class Comb
{
public:
  Comb (const LineSearch &search, double frequency, double step)
      : lit_ (search.lit)
  {
    std::map<double, std::size_t> halves; // of the lengths, which are few
    const auto begin = [&] (double time) {
      const Lanes angles =
          kTurn * time * (frequency + step * Lanes::LinSpaced (0, kLanes - 1));
      turns_.push_back ({angles.cos (), angles.sin ()});
      steps_.push_back (std::polar (1.0, kTurn * kLanes * step * time));
    };
    for (const LitTime &time : lit_) {
      begin (0.5 * (time.from + time.until));
      const double half = 0.5 * (time.until - time.from);
      const auto [known, fresh] = halves.try_emplace (half, halves.size ());
      half_of_.push_back (lit_.size () + known->second);
    }
    std::vector<double> times (halves.size ());
    for (const auto &[half, place] : halves)
      times[place] = half;
    std::ranges::for_each (times, begin);
  }

  /** Of a line of unit depth, but for a factor of each frequency. */
  Sums sums (const VectorXd &residual) const
  {
    Sums sums;
    for (std::size_t i = 0; i < lit_.size ();) {
      const int sample = lit_[i].sample;
      Turns light;
      for (; i < lit_.size () && lit_[i].sample == sample; i++)
        light.add (lit_[i].weight, turns_[i], turns_[half_of_[i]].sine);
      sums.add (light, residual[sample]);
    }
    return sums;
  }

  void next ()
  {
    for (std::size_t i = 0; i < turns_.size (); i++)
      turns_[i].turn (steps_[i]);
  }

private:
  const std::vector<LitTime> &lit_;
  std::vector<std::size_t> half_of_; // place of half the length of each
  /* Of the middle of each time, then of half the lengths; and by how much they
   * turn from one kLanes frequencies to the next. */
  std::vector<Turns> turns_;
  std::vector<std::complex<double>> steps_;
};

/** The residual without what other parameters explain. */
class WithoutOthers
{
public:
  explicit WithoutOthers (const LineSearch &search)
      : search_ (search), residual_ (search.residual),
        basis_ (basis_of (search.others.colwise ().normalized ()))
  {
    residual_ -= basis_ * (basis_.transpose () * residual_);
  }

  const VectorXd &residual () const { return residual_; }

  Amplitudes at (double frequency) const
  {
    VectorXd cosine = VectorXd::Zero (residual_.size ()), sine = cosine;
    const double turn = 1.0 / (kTurn * frequency);
    for (const LitTime &time : search_.lit) {
      const double from = time.from / turn, until = time.until / turn;
      const double part = turn * time.weight;
      cosine[time.sample] += part * (std::sin (until) - std::sin (from));
      sine[time.sample] -= part * (std::cos (until) - std::cos (from));
    }
    cosine -= basis_ * (basis_.transpose () * cosine);
    sine -= basis_ * (basis_.transpose () * sine);
    return solve (cosine.squaredNorm (), cosine.dot (sine), sine.squaredNorm (),
        cosine.dot (residual_), sine.dot (residual_));
  }

  /** The peak of at () within @p width of @p frequency. */
  Peak refine (double frequency, double width) const
  {
    Peak best{frequency, at (frequency).power};
    for (; width > 1e-4; width *= 0.5)
      for (const double aside :
          {best.frequency - width, best.frequency + width})
        if (const double power = at (aside).power; power > best.power)
          best = {aside, power};
    return best;
  }

private:
  const LineSearch &search_;
  VectorXd residual_;
  MatrixXd basis_;
};

void
add_to_spectrum (std::vector<Position> &spectrum, double slowest,
    double fastest, double frequency, double explained)
{
  const double part = (frequency - slowest) / (fastest - slowest);
  const auto stretch = std::size_t (std::clamp (
      int (part * LineSearch::kStretches), 0, LineSearch::kStretches - 1));
  Position &point = spectrum[stretch];
  if (explained >= point.y)
    point = {frequency, explained};
}

/** The peaks where other parameters are taken as known. */
std::vector<Peak>
quick_peaks (const LineSearch &search, const VectorXd &residual, double slowest,
    double fastest, double step, std::vector<Position> *spectrum)
{
  std::vector<Peak> peaks;
  Peak before, last;
  const double squares = std::max (1e-30, residual.squaredNorm ());
  const auto add = [&] (const Peak &found) {
    if (spectrum)
      add_to_spectrum (
          *spectrum, slowest, fastest, found.frequency, found.power / squares);
    if (last.power > before.power && last.power >= found.power)
      peaks.push_back (last);
    before = last;
    last = found;
  };
  Comb comb (search, slowest, step);
  const int count = int ((fastest - slowest) / step) + 1;
  for (int i = 0; i < count; i += kLanes, comb.next ()) {
    const Sums sums = comb.sums (residual);
    for (int k = 0; k < std::min (kLanes, count - i); k++)
      add ({slowest + (i + k) * step,
          solve (sums.cc[k], sums.cs[k], sums.ss[k], sums.rc[k], sums.rs[k])
              .power});
  }
  peaks.push_back (last);
  const std::size_t kept = std::min (peaks.size (), kPeaks);
  std::ranges::partial_sort (peaks, peaks.begin () + std::ptrdiff_t (kept),
      std::ranges::greater (), &Peak::power);
  peaks.resize (kept);
  return peaks;
}

} // namespace

LightLine
LineSearch::strongest (
    double slowest, double fastest, std::vector<Position> *spectrum) const
{
  if (lit.empty ())
    return {};
  const auto [first, last] =
      std::ranges::minmax_element (lit, {}, &LitTime::from);
  const double step =
      1.0 / (kDensity * std::max (last->from - first->from, 1.0));
  if (spectrum) {
    spectrum->assign (kStretches, {});
    for (int i = 0; i < kStretches; i++)
      (*spectrum)[std::size_t (i)].x =
          slowest + (i + 0.5) / kStretches * (fastest - slowest);
  }
  const WithoutOthers without_others (*this);
  Peak best;
  for (const Peak &peak : quick_peaks (*this, without_others.residual (),
           slowest, fastest, step, spectrum)) {
    const Peak found = without_others.refine (peak.frequency, step);
    if (found.power > best.power)
      best = found;
  }
  if (best.power <= 0.0)
    return {};
  const Amplitudes found = without_others.at (best.frequency);
  return {best.frequency, found.cosine, found.sine};
}

} // namespace codedexposure
