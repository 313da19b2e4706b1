/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The binary matrix of the slots in which each element is on. */
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace codedexposure
{

/**
 * A square binary matrix: on (element, slot), n elements by n slots.
 *
 * Named forms:
 *   "sequential"  element e is on in slot e only (paper, Fig. 4b)
 *   "staircase"   element e is on in slots 0..e (paper, Fig. 8)
 *   "s-matrix"    Hadamard multiplexing: the S-matrix of order n where a
 *                 Hadamard matrix of order n + 1 can be built, else (H + J) / 2
 *                 of a Hadamard matrix of order n (Harwit & Sloane, Hadamard
 *                 Transform Optics, 1979)
 */
class Code
{
public:
  static Result<Code> named (std::string_view name, int elements);
  /** @p rows: n strings of n characters '0' or '1', one row an element. Every
   * element must be on in at least one slot. */
  static Result<Code> from_rows (const std::vector<std::string> &rows);

  /** The named form, or "matrix". */
  const std::string &name () const { return name_; }
  bool is_named () const { return name_ != "matrix"; }
  std::vector<std::string> rows () const;

  int elements () const { return n_; }
  int slots () const { return n_; }
  bool on (int element, int slot) const
  {
    return on_[std::size_t (element * n_ + slot)] != 0;
  }

  /** Light that an element lets through in a slot: 1 when it is on, else @p
   * leak, the off/on contrast of the mirrors. */
  double light (int element, int slot, double leak) const
  {
    return on (element, slot) ? 1.0 : leak;
  }

  /** Slots in which an element is on. */
  int on_slots (int element) const;
  /** The largest on_slots (): that element's exposure fills the range. */
  int max_on_slots () const;
  /** The code of the mirrors' other beam: on where this one is off. Error where
   * an element is on in every slot, and so never in that beam. */
  Result<Code> complement () const;
  /** The slots from @p first on, then those before it. */
  Code from_slot (int first) const;
  /** Every element is on in one slot, and in every slot one element is on. */
  bool one_hot () const;

  /**
   * The matrix that turns the light of the elements into the light of the
   * slots, row-major, n slots by n elements: the inverse of light ().
   * Error when the code cannot be inverted.
   */
  Result<std::vector<double>> inverse (double leak) const;

  bool operator== (const Code &) const = default;

private:
  /** @p on  of each element and slot. */
  Code (std::string name, int n, const std::function<bool (int, int)> &on);

  std::string name_;
  int n_;
  std::vector<std::uint8_t> on_;
};

} // namespace codedexposure
