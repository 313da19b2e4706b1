/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The binary matrix that says in which slots each element is open. */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace cexp
{

/**
 * A square binary matrix: open (element, slot), n elements by n slots.
 *
 * Named forms:
 *   "sequential"  element e is open in slot e only (paper, Fig. 4b)
 *   "staircase"   element e is open in slots 0..e (paper, Fig. 8)
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
   * element must be open in at least one slot. */
  static Result<Code> from_rows (const std::vector<std::string> &rows);

  /** The named form, or "matrix". */
  const std::string &name () const { return name_; }
  bool is_named () const { return name_ != "matrix"; }
  std::vector<std::string> rows () const;

  int elements () const { return n_; }
  int slots () const { return n_; }
  bool open (int element, int slot) const
  {
    return open_[std::size_t (element * n_ + slot)] != 0;
  }

  /** Slots in which an element is open. */
  int open_slots (int element) const;
  /** The largest open_slots (): that element's exposure fills the range. */
  int max_open_slots () const;
  /** Every element is open in one slot, and every slot opens one element. */
  bool one_hot () const;

  /**
   * The matrix that turns the light of the elements into the light of the
   * slots, row-major, n slots by n elements: the inverse of C + leak (1 - C).
   * @p leak  off/on contrast of the mirrors, 0 <= leak < 1.
   * Error when the code cannot be inverted.
   */
  Result<std::vector<double>> inverse (double leak) const;

  bool operator== (const Code &) const = default;

private:
  Code (std::string name, int n, std::vector<std::uint8_t> open);

  std::string name_;
  int n_;
  std::vector<std::uint8_t> open_;
};

} // namespace cexp
