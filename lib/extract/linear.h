/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The sums of products of a decoder in the numbers in which they are computed:
 * read by the reference and by kernels. */
#pragma once

#include <vector>

namespace codedexposure
{

class Decoder;

/** The numbers that hold values, factors and sums. */
enum class Numbers { kShort, kInt, kDouble };

/** One summand of a slot's light: a factor times a value. */
struct LinearTerm {
  int value;     ///< number of an element
  double factor; ///< kDouble; otherwise whole + fraction is 2^shift times it
  int whole;
  float fraction; ///< kInt
  short high;     ///< kShort: the fraction times 2^(16 + down - up)
};

/**
 * The light of slot s is
 *
 *   kDouble:  floor (sum of factor * value + 1/2), in the order of the terms;
 *   others:   (sum of whole * value + sum of fraction * value) / 2^shift,
 *             rounded,
 *
 * clamped to 0..largest. The sum of all elements times @p common is part of
 * every slot: a code with leakage has nothing else from most of the elements.
 *
 * Fractions are not needed where all factors are multiples of 2^-shift; the
 * sums are exact then. kInt adds up floats, first that of common, then the
 * terms in their order. kShort adds up the upper halves of products of 16 bits,
 * values times 2^up by high, and divides by 2^down.
 */
struct Linear {
  Numbers numbers = Numbers::kDouble;
  int n = 0;
  int largest = 0;
  int shift = 0;
  int half = 0;       ///< added to the whole sums
  float start = 0.0f; ///< of the sums of fractions
  int up = 0, sum_up = 0;
  int down = 0;
  short high_start = 0;
  bool has_fractions = false;
  bool has_common = false;
  /** Slot k is element k less element k - 1, times a whole factor that is the
   * same for all. */
  bool is_staircase = false;
  /** Each slot is an element of its own, times a factor that is the same for
   * all, and the common sum. */
  bool is_one_hot = false;
  LinearTerm common = {};
  const LinearTerm *terms = nullptr; ///< of one slot after the other
  const int *ends = nullptr;         ///< of the terms of each slot

  /** The pixel of a slot. This is what kernels must equal. */
  int pixel (int slot, const int *values) const;
};

/** A Linear and its terms. */
class LinearPlan
{
public:
  /** @p white    largest value that the type of a pixel holds
   *  @p largest  largest significant one. */
  LinearPlan (const Decoder &decoder, int white, int largest);

  LinearPlan (const LinearPlan &) = delete;
  LinearPlan (LinearPlan &&) = default;
  LinearPlan &operator= (LinearPlan &&) = default;

  const Linear &linear () const { return linear_; }

private:
  void take_terms (const Decoder &decoder);
  void take_common ();
  void split_factors (int shift);
  bool has_steps () const;
  bool has_one_each () const;
  bool fits (double most, double limit, double white) const;
  bool take_high_products (double most);

  Linear linear_;
  std::vector<LinearTerm> terms_;
  std::vector<int> ends_;
};

} // namespace codedexposure
