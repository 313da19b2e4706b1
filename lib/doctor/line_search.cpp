/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/line_search.h"

#include <algorithm>
#include <cmath>
#include <complex>
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

/** Light of a line of unit depth in each sample, at growing frequencies. */
class Comb
{
public:
  Comb (const LineSearch &search, double frequency, double step)
      : lit_ (search.lit), frequency_ (frequency), step_ (step),
        phasors_ (2 * lit_.size ()), turns_ (phasors_.size ())
  {
    for (Index i = 0; i < phasors_.size (); i++) {
      const LitTime &time = lit_[std::size_t (i / 2)];
      const double edge = i % 2 == 0 ? time.from : time.until;
      phasors_[i] = std::polar (1.0, kTurn * frequency * edge);
      turns_[i] = std::polar (1.0, kTurn * step * edge);
    }
  }

  double frequency () const { return frequency_; }

  void fill (VectorXd &cosine, VectorXd &sine) const
  {
    cosine.setZero ();
    sine.setZero ();
    const double turn = 1.0 / (kTurn * frequency_);
    for (Index i = 0; i < phasors_.size (); i += 2) {
      const LitTime &time = lit_[std::size_t (i / 2)];
      const std::complex<double> light =
          turn * time.weight * (phasors_[i + 1] - phasors_[i]);
      cosine[time.sample] += light.imag ();
      sine[time.sample] -= light.real ();
    }
  }

  void next ()
  {
    frequency_ += step_;
    phasors_ *= turns_;
  }

private:
  const std::vector<LitTime> &lit_;
  double frequency_, step_;
  Eigen::ArrayXcd phasors_, turns_; // of both ends of each time, and of a step
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
    VectorXd cosine (residual_.size ()), sine (residual_.size ());
    Comb (search_, frequency, 0.0).fill (cosine, sine);
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
  VectorXd cosine (residual.size ()), sine (residual.size ());
  for (Comb comb (search, slowest, step); comb.frequency () <= fastest;
       comb.next ()) {
    comb.fill (cosine, sine);
    const Amplitudes found = solve (cosine.squaredNorm (), cosine.dot (sine),
        sine.squaredNorm (), cosine.dot (residual), sine.dot (residual));
    if (spectrum)
      add_to_spectrum (*spectrum, slowest, fastest, comb.frequency (),
          found.power / std::max (1e-30, residual.squaredNorm ()));
    if (last.power > before.power && last.power >= found.power)
      peaks.push_back (last);
    before = last;
    last = {comb.frequency (), found.power};
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
