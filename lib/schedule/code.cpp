/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/code.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>

#include "base/text.h"
#include "schedule/hadamard.h"
#include "schedule/matrix.h"
#include "schedule/tile.h"

namespace codedexposure
{

namespace
{

using Bits = std::vector<std::uint8_t>;

Bits
sequential_bits (int n)
{
  Bits on (std::size_t (n * n));
  for (int e = 0; e < n; e++)
    on[std::size_t (e * n + e)] = 1;
  return on;
}

Bits
staircase_bits (int n)
{
  Bits on (std::size_t (n * n));
  for (int e = 0; e < n; e++)
    std::fill_n (on.begin () + e * n, e + 1, std::uint8_t (1));
  return on;
}

/** What a normalised Hadamard matrix of order n + 1 leaves without its first
 * row and column, -1 being on, or (H + J) / 2 of one of order n; none where
 * there is neither. */
std::optional<Bits>
s_matrix_bits (int n)
{
  Bits on;
  on.reserve (std::size_t (n * n));
  if (const auto hadamard = hadamard_matrix (n + 1)) {
    for (int e = 1; e <= n; e++)
      for (int s = 1; s <= n; s++)
        on.push_back (hadamard->at (e, s) < 0);
    return on;
  }
  if (const auto hadamard = hadamard_matrix (n)) {
    std::transform (hadamard->signs.begin (), hadamard->signs.end (),
        std::back_inserter (on),
        [] (std::int8_t sign) { return std::uint8_t (sign > 0); });
    return on;
  }
  return std::nullopt;
}

/** Names the nearest numbers of elements that have an S-matrix; 2 and 256
 * do. */
Error
no_s_matrix (int n)
{
  const auto nearest = [n] (int step) {
    int other = n + step;
    while (!s_matrix_bits (other))
      other += step;
    return std::to_string (other);
  };
  return {"code 's-matrix' cannot be built for " + std::to_string (n) +
          " elements, only where a Hadamard matrix of order n or n + 1 is "
          "known; the nearest are " +
          nearest (-1) + " and " + nearest (1)};
}

/** What an inverse may be off from one, at any element, to be of use. */
constexpr double kMaxResidual = 1e-6;

/** The largest element of a b - 1. */
double
worst_residual (const Matrix &a, const Matrix &b, std::size_t n)
{
  double worst = 0.0;
  std::vector<double> row (n);
  for (std::size_t r = 0; r < n; r++) {
    std::fill (row.begin (), row.end (), 0.0);
    row[r] = -1.0;
    for (std::size_t k = 0; k < n; k++)
      for (std::size_t c = 0; c < n; c++)
        row[c] += a[r * n + k] * b[k * n + c];
    for (const double element : row)
      worst = std::max (worst, std::abs (element));
  }
  return worst;
}

} // namespace

Code::Code (std::string name, int n, std::vector<std::uint8_t> on)
    : name_ (std::move (name)), n_ (n), on_ (std::move (on))
{
}

Result<Code>
Code::named (std::string_view name, int elements)
try {
  const int n = elements;
  if (n < 2 || n > Tile::kMaxElements)
    return Error{"code " + in_quotes (name) + " for " + std::to_string (n) +
                 " elements: 2 to " + std::to_string (Tile::kMaxElements) +
                 " are possible"};
  if (name == "sequential")
    return Code ("sequential", n, sequential_bits (n));
  if (name == "staircase")
    return Code ("staircase", n, staircase_bits (n));
  if (name == "s-matrix") {
    if (auto on = s_matrix_bits (n))
      return Code ("s-matrix", n, *std::move (on));
    return no_s_matrix (n);
  }
  return Error{"code " + in_quotes (name) +
               " is none of sequential, staircase and s-matrix"};
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

Result<Code>
Code::from_rows (const std::vector<std::string> &rows)
try {
  const std::size_t n = rows.size ();
  if (n < 2 || n > std::size_t (Tile::kMaxElements))
    return Error{"code with " + std::to_string (n) + " rows: 2 to " +
                 std::to_string (Tile::kMaxElements) + " are possible"};

  Bits on;
  on.reserve (n * n);
  for (std::size_t e = 0; e < n; e++) {
    const std::string row = "row " + std::to_string (e) + " of the code";
    if (rows[e].size () != n)
      return Error{row + " has " + std::to_string (rows[e].size ()) +
                   " slots; a code of " + std::to_string (n) +
                   " elements has as many slots"};
    if (rows[e].find_first_not_of ("01") != std::string::npos)
      return Error{row + " is " + in_quotes (rows[e]) +
                   "; only 0 (off) and 1 (on) can stand in it"};
    if (rows[e].find ('1') == std::string::npos)
      return Error{row + " is never on; every element must see light in at "
                         "least one slot"};
    for (const char bit : rows[e])
      on.push_back (bit == '1');
  }
  return Code ("matrix", int (n), std::move (on));
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

std::vector<std::string>
Code::rows () const
{
  std::vector<std::string> rows;
  for (int e = 0; e < n_; e++) {
    std::string &row = rows.emplace_back ();
    for (int s = 0; s < n_; s++)
      row += on (e, s) ? '1' : '0';
  }
  return rows;
}

int
Code::on_slots (int element) const
{
  const auto row = on_.begin () + element * n_;
  return std::accumulate (row, row + n_, 0);
}

int
Code::max_on_slots () const
{
  int most = 0;
  for (int e = 0; e < n_; e++)
    most = std::max (most, on_slots (e));
  return most;
}

bool
Code::one_hot () const
{
  for (int i = 0; i < n_; i++) {
    int in_slot = 0;
    for (int e = 0; e < n_; e++)
      in_slot += on (e, i);
    if (in_slot != 1 || on_slots (i) != 1)
      return false;
  }
  return true;
}

Result<std::vector<double>>
Code::inverse (double leak) const
{
  const std::size_t n = std::size_t (n_);
  Matrix light;
  light.reserve (n * n);
  for (int e = 0; e < n_; e++)
    for (int s = 0; s < n_; s++)
      light.push_back (this->light (e, s, leak));
  auto inverse = inverted (light, n);
  if (!inverse || worst_residual (light, *inverse, n) > kMaxResidual)
    return Error{"code '" + name_ + "' of " + std::to_string (n_) +
                 " elements cannot be inverted at a leak of " +
                 real_text (leak) +
                 ": its rows are not independent, or nearly so, and the light "
                 "of single slots cannot be told; use rank, or a code such as "
                 "sequential"};
  return *std::move (inverse);
}

} // namespace codedexposure
