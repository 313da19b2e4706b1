/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/linear.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <span>

#include "extract/decoder.h"

namespace codedexposure
{

namespace
{

/** Factors are multiples of 2^-kMostShift, or have fractions. */
constexpr int kMostShift = 8;
/** Larger whole factors are left to doubles. */
constexpr double kMostWhole = 1 << 30;
/** Part of the largest factor by which rounding changes others. */
constexpr double kRounding = 1e-12;

/** The factor of more than half of @p all elements and slots, or 0; others
 * that are no further than @p rounding from it are the same. */
double
common_factor (
    std::span<const LinearTerm> terms, std::size_t all, double rounding)
{
  std::vector<double> factors;
  for (const LinearTerm &term : terms)
    factors.push_back (term.factor);
  std::ranges::sort (factors);
  if (factors.size () <= all / 2)
    return 0.0;
  const double middle = factors[all / 2];
  const auto same = std::ranges::count_if (factors,
      [=] (double factor) { return std::abs (factor - middle) <= rounding; });
  return std::size_t (same) > all / 2 ? middle : 0.0;
}

/** The smallest shift that makes all factors whole; none if there is none. */
std::optional<int>
exact_shift (std::span<const LinearTerm> terms)
{
  for (int shift = 0; shift <= kMostShift; shift++)
    if (std::ranges::all_of (terms, [shift] (const LinearTerm &term) {
          const double factor = std::ldexp (term.factor, shift);
          return factor == std::floor (factor);
        }))
      return shift;
  return {};
}

} // namespace

int
Linear::pixel (int slot, const int *values) const
{
  const LinearTerm *term = terms + (slot > 0 ? ends[slot - 1] : 0);
  const LinearTerm *const end = terms + ends[slot];
  if (numbers == Numbers::kDouble) {
    double light = 0.0;
    for (; term < end; term++)
      light += term->factor * values[term->value];
    return int (std::clamp (std::floor (light + 0.5), 0.0, double (largest)));
  }
  std::int64_t light = half;
  float fractions = start;
  int high = high_start;
  const auto add = [&] (const LinearTerm &factor, int up_here, int value) {
    light += std::int64_t (factor.whole) * value;
    fractions += factor.fraction * float (value);
    if (numbers == Numbers::kShort)
      high += (value << up_here) * factor.high >> 16;
  };
  if (has_common)
    add (common, sum_up, std::accumulate (values, values + n, 0));
  for (; term < end; term++)
    add (*term, up, values[term->value]);
  if (has_fractions)
    light += numbers == Numbers::kShort
                 ? high >> down
                 : std::int64_t (std::nearbyint (fractions));
  return int (std::clamp<std::int64_t> (light >> shift, 0, largest));
}

LinearPlan::LinearPlan (const Decoder &decoder, int white, int largest)
{
  linear_.n = decoder.slots ();
  linear_.largest = largest;
  take_terms (decoder);
  const auto of_decoder = terms_;
  const auto its_ends = ends_;
  take_common ();
  /* Without leakage, an interpolated staircase has quarters. */
  split_factors (decoder.interpolates () ? 2 : 0);

  const double most =
      white * (decoder.interpolates () ? 4.0 * decoder.slots () : 1.0);
  constexpr double kShortest = std::numeric_limits<std::int16_t>::max ();
  constexpr double kLongest = std::numeric_limits<std::int32_t>::max ();
  linear_.is_staircase = !decoder.interpolates () && has_steps ();
  if (white <= std::numeric_limits<std::uint8_t>::max () &&
      fits (most, kShortest, white) && take_high_products (most)) {
    linear_.numbers = Numbers::kShort;
  } else if (fits (most, kLongest, white)) {
    linear_.numbers = Numbers::kInt;
  } else {
    terms_ = of_decoder;
    ends_ = its_ends;
    linear_.has_common = false;
  }
  linear_.is_one_hot = has_one_each ();
  linear_.terms = terms_.data ();
  linear_.ends = ends_.data ();
}

void
LinearPlan::take_terms (const Decoder &decoder)
{
  for (int s = 0; s < decoder.slots (); s++) {
    for (const Term &term : decoder.terms (s))
      terms_.push_back ({term.element, term.factor, 0, 0.0f, 0});
    ends_.push_back (int (terms_.size ()));
  }
}

/** What is left of the terms without the common factor. */
void
LinearPlan::take_common ()
{
  const std::size_t n = std::size_t (linear_.n);
  double rounding = 0.0;
  for (const LinearTerm &term : terms_)
    rounding = std::max (rounding, kRounding * std::abs (term.factor));
  const double common = common_factor (terms_, n * n, rounding);
  linear_.common = {linear_.n, common, 0, 0.0f, 0};
  linear_.has_common = common != 0.0;
  if (!linear_.has_common)
    return;
  std::vector<LinearTerm> others;
  std::size_t at = 0;
  for (int &end : ends_) {
    std::vector<double> factors (n);
    for (; at < std::size_t (end); at++)
      factors[std::size_t (terms_[at].value)] = terms_[at].factor;
    for (std::size_t e = 0; e < n; e++)
      if (std::abs (factors[e] - common) > rounding)
        others.push_back ({int (e), factors[e] - common, 0, 0.0f, 0});
    end = int (others.size ());
  }
  terms_ = std::move (others);
}

/** Splits factors into a whole number and a fraction of 2^-shift. @p shift is
 * for those that no shift makes whole. */
void
LinearPlan::split_factors (int shift)
{
  terms_.push_back (linear_.common);
  const auto exact = exact_shift (terms_);
  linear_.has_fractions = !exact;
  linear_.shift = exact.value_or (shift);
  for (LinearTerm &term : terms_) {
    const double scaled = std::ldexp (term.factor, linear_.shift);
    const double whole =
        std::clamp (std::round (scaled), -kMostWhole, kMostWhole);
    term.whole = int (whole);
    term.fraction = float (scaled - whole);
  }
  linear_.common = terms_.back ();
  terms_.pop_back ();
  if (linear_.has_fractions) {
    linear_.common.whole = 0;
    linear_.common.fraction =
        float (std::ldexp (linear_.common.factor, linear_.shift));
  }
  const float half = std::ldexp (0.5f, linear_.shift);
  linear_.half = linear_.has_fractions ? 0 : int (half);
  linear_.start = half - 0.5f;
}

/** Linear::is_staircase, for factors that kernels take. */
bool
LinearPlan::has_steps () const
{
  constexpr int kMostFactor = 256;
  const int factor = terms_.back ().whole;
  if (linear_.has_common || linear_.has_fractions || linear_.shift != 0 ||
      factor < 1 || factor > kMostFactor ||
      terms_.size () != 2 * ends_.size () - 1)
    return false;
  for (int s = 0; s < linear_.n; s++) {
    const LinearTerm &last = terms_[std::size_t (2 * s)];
    const bool has_step = last.value == s && last.whole == factor;
    const LinearTerm &less = terms_[std::size_t (s > 0 ? 2 * s - 1 : 0)];
    if (!has_step || (s > 0 && (less.value != s - 1 || less.whole != -factor)))
      return false;
  }
  return true;
}

/** Linear::is_one_hot. */
bool
LinearPlan::has_one_each () const
{
  if (!linear_.has_common || !linear_.has_fractions ||
      terms_.size () != ends_.size ())
    return false;
  std::vector<bool> seen (ends_.size ());
  for (std::size_t s = 0; s < ends_.size (); s++) {
    const LinearTerm &term = terms_[s], &first = terms_[0];
    const bool is_same = term.whole == first.whole &&
                         term.fraction == first.fraction &&
                         term.high == first.high;
    if (!is_same || ends_[s] != int (s + 1) || seen[std::size_t (term.value)])
      return false;
    seen[std::size_t (term.value)] = true;
  }
  return true;
}

/** Whether sums of products with values up to @p most fit into numbers up to
 * @p limit, and fractions are no more than corrections: they are sums of
 * floats. */
bool
LinearPlan::fits (double most, double limit, double white) const
{
  const double sum = most * linear_.n;
  const LinearTerm &common = linear_.common;
  const double common_fraction = std::abs (double (common.fraction)) * sum;
  if (linear_.has_common && sum > limit)
    return false;
  /* Others round as doubles do, at ties, too. */
  if (linear_.has_fractions && !linear_.has_common)
    return false;
  const LinearTerm *term = terms_.data ();
  for (const int end : ends_) {
    double up = std::max (common.whole, 0) * sum;
    double down = std::max (-common.whole, 0) * sum;
    double fractions = common_fraction;
    for (; term < terms_.data () + end; term++) {
      if (std::abs (term->whole) >= kMostWhole)
        return false;
      up += std::max (term->whole, 0) * most;
      down += std::max (-term->whole, 0) * most;
      fractions += std::abs (double (term->fraction)) * most;
    }
    const double corrections = fractions + linear_.start + linear_.half + 1.0;
    if (std::max (up, down) + corrections > limit || fractions > white)
      return false;
  }
  return most <= limit;
}

/** Scales fractions for products of 16 bits. Whether that is possible without
 * an error that could be seen. */
bool
LinearPlan::take_high_products (double most)
{
  constexpr double kLimit = 1 << 15;
  constexpr int kLeastDown = 7;
  if (!linear_.has_fractions)
    return true;
  const auto room = [] (double value) {
    return int (std::floor (std::log2 (kLimit / (value + 1.0))));
  };
  linear_.up = room (most);
  linear_.sum_up = linear_.has_common ? room (most * linear_.n) : 0;

  double largest_sum = 0.0, largest_fraction = 0.0, at_once = 0.0;
  const LinearTerm *term = terms_.data ();
  for (const int end : ends_) {
    const double common = std::abs (double (linear_.common.fraction));
    double sum = common * most * linear_.n;
    at_once = std::max (at_once, double (terms_.data () + end - term) + 1.0);
    largest_fraction =
        std::max (largest_fraction, std::ldexp (common, 16 - linear_.sum_up));
    for (; term < terms_.data () + end; term++) {
      const double fraction = std::abs (double (term->fraction));
      sum += fraction * most;
      largest_fraction =
          std::max (largest_fraction, std::ldexp (fraction, 16 - linear_.up));
    }
    largest_sum = std::max (largest_sum, sum);
  }
  const double half = linear_.start + 0.5;
  linear_.down =
      std::min ({room (largest_sum + half + 1.0), room (largest_fraction), 14});
  if (linear_.down + linear_.shift < kLeastDown || at_once > 8.0)
    return false;
  const auto scaled = [this] (double fraction, int up) {
    return short (std::round (std::ldexp (fraction, 16 + linear_.down - up)));
  };
  for (LinearTerm &each : terms_)
    each.high = scaled (each.fraction, linear_.up);
  linear_.common.high = scaled (linear_.common.fraction, linear_.sum_up);
  /* Upper halves are rounded down, by a half on average. */
  linear_.high_start = short (
      std::ldexp (half, linear_.down) + (linear_.has_common ? 1.0 : 0.5));
  return true;
}

} // namespace codedexposure
