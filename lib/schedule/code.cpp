/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/code.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "schedule/hadamard.h"
#include "schedule/tile.h"

namespace cexp
{

namespace
{

using Bits = std::vector<std::uint8_t>;

Bits
sequential_bits (int n)
{
  Bits open (std::size_t (n * n));
  for (int e = 0; e < n; e++)
    open[std::size_t (e * n + e)] = 1;
  return open;
}

Bits
staircase_bits (int n)
{
  Bits open (std::size_t (n * n));
  for (int e = 0; e < n; e++)
    std::fill_n (open.begin () + e * n, e + 1, std::uint8_t (1));
  return open;
}

/** The S-matrix that remains of a normalised Hadamard matrix of order n + 1
 * without its first row and column: -1 is open. */
Bits
s_matrix_bits (const SignMatrix &hadamard, int n)
{
  Bits open;
  for (int e = 1; e <= n; e++)
    for (int s = 1; s <= n; s++)
      open.push_back (hadamard.at (e, s) < 0);
  return open;
}

/** (H + J) / 2: +1 is open. */
Bits
half_hadamard_bits (const SignMatrix &hadamard, int n)
{
  Bits open;
  for (int e = 0; e < n; e++)
    for (int s = 0; s < n; s++)
      open.push_back (hadamard.at (e, s) > 0);
  return open;
}

} // namespace

Code::Code (std::string name, int n, std::vector<std::uint8_t> open)
    : name_ (std::move (name)), n_ (n), open_ (std::move (open))
{
}

Result<Code>
Code::named (std::string_view name, int elements)
{
  const int n = elements;
  if (n < 2 || n > Tile::kMaxElements)
    return Error{"code '" + std::string (name) + "' for " + std::to_string (n) +
                 " elements: 2 to " + std::to_string (Tile::kMaxElements) +
                 " are possible"};
  if (name == "sequential")
    return Code ("sequential", n, sequential_bits (n));
  if (name == "staircase")
    return Code ("staircase", n, staircase_bits (n));
  if (name == "s-matrix") {
    if (const auto hadamard = hadamard_matrix (n + 1))
      return Code ("s-matrix", n, s_matrix_bits (*hadamard, n));
    if (const auto hadamard = hadamard_matrix (n))
      return Code ("s-matrix", n, half_hadamard_bits (*hadamard, n));
    return Error{"code 's-matrix' does not exist for " + std::to_string (n) +
                 " elements: it needs a Hadamard matrix of order n or n + 1, "
                 "a multiple of 4; take a tile of 3, 4, 7, 8, 11, 12, 15, 16, "
                 "... elements"};
  }
  return Error{"code '" + std::string (name.substr (0, 64)) +
               "' is none of sequential, staircase and s-matrix"};
}

Result<Code>
Code::from_rows (const std::vector<std::string> &rows)
{
  const std::size_t n = rows.size ();
  if (n < 2 || n > std::size_t (Tile::kMaxElements))
    return Error{"code with " + std::to_string (n) + " rows: 2 to " +
                 std::to_string (Tile::kMaxElements) + " are possible"};

  Bits open;
  open.reserve (n * n);
  for (std::size_t e = 0; e < n; e++) {
    const std::string row = "row " + std::to_string (e) + " of the code";
    if (rows[e].size () != n)
      return Error{row + " has " + std::to_string (rows[e].size ()) +
                   " slots; a code of " + std::to_string (n) +
                   " elements has as many slots"};
    if (rows[e].find_first_not_of ("01") != std::string::npos)
      return Error{row + " is '" + rows[e].substr (0, 64) +
                   "'; only 0 (shut) and 1 (open) can stand in it"};
    if (rows[e].find ('1') == std::string::npos)
      return Error{row + " is never open; every element must see light in at "
                         "least one slot"};
    for (const char bit : rows[e])
      open.push_back (bit == '1');
  }
  return Code ("matrix", int (n), std::move (open));
}

std::vector<std::string>
Code::rows () const
{
  std::vector<std::string> rows;
  for (int e = 0; e < n_; e++) {
    std::string &row = rows.emplace_back ();
    for (int s = 0; s < n_; s++)
      row += open (e, s) ? '1' : '0';
  }
  return rows;
}

int
Code::open_slots (int element) const
{
  const auto row = open_.begin () + element * n_;
  return std::accumulate (row, row + n_, 0);
}

int
Code::max_open_slots () const
{
  int most = 0;
  for (int e = 0; e < n_; e++)
    most = std::max (most, open_slots (e));
  return most;
}

bool
Code::one_hot () const
{
  for (int i = 0; i < n_; i++) {
    int in_slot = 0;
    for (int e = 0; e < n_; e++)
      in_slot += open (e, i);
    if (in_slot != 1 || open_slots (i) != 1)
      return false;
  }
  return true;
}

Result<std::vector<double>>
Code::inverse (double leak) const
{
  const std::size_t n = std::size_t (n_);
  std::vector<double> a (n * n), b (n * n);
  for (std::size_t i = 0; i < n * n; i++)
    a[i] = open_[i] != 0 ? 1.0 : leak;
  for (std::size_t i = 0; i < n; i++)
    b[i * n + i] = 1.0;

  /* Gauss-Jordan with partial pivoting. Determinants of binary matrices are
   * integers, so a pivot of a regular one never comes near the limit. */
  constexpr double kSingular = 1e-9;
  for (std::size_t c = 0; c < n; c++) {
    std::size_t pivot = c;
    for (std::size_t r = c + 1; r < n; r++)
      if (std::abs (a[r * n + c]) > std::abs (a[pivot * n + c]))
        pivot = r;
    if (std::abs (a[pivot * n + c]) < kSingular)
      return Error{"code '" + name_ + "' of " + std::to_string (n_) +
                   " elements cannot be inverted: its rows are not "
                   "independent, so the light of single slots cannot be "
                   "told; use rank, or a code such as sequential"};
    for (std::size_t k = 0; k < n; k++) {
      std::swap (a[pivot * n + k], a[c * n + k]);
      std::swap (b[pivot * n + k], b[c * n + k]);
    }
    const double scale = 1.0 / a[c * n + c];
    for (std::size_t k = 0; k < n; k++) {
      a[c * n + k] *= scale;
      b[c * n + k] *= scale;
    }
    for (std::size_t r = 0; r < n; r++) {
      const double factor = a[r * n + c];
      if (r == c || factor == 0.0)
        continue;
      for (std::size_t k = 0; k < n; k++) {
        a[r * n + k] -= factor * a[c * n + k];
        b[r * n + k] -= factor * b[c * n + k];
      }
    }
  }
  return b;
}

} // namespace cexp
