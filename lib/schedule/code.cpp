/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/code.h"

#include <algorithm>
#include <numeric>
#include <optional>

#include <Eigen/Core>

#include "base/text.h"
#include "schedule/matrix.h"
#include "schedule/tile.h"

namespace codedexposure
{

namespace
{

using Eigen::Index;
using Eigen::MatrixXi;

bool
is_prime (int value)
{
  for (int d = 2; d * d <= value; d++)
    if (value % d == 0)
      return false;
  return value > 1;
}

/** The quadratic characters, 0, 1 or -1, of column less row modulo the prime
 * @p q. */
MatrixXi
jacobsthal (int q)
{
  Eigen::VectorXi character = Eigen::VectorXi::Constant (q, -1);
  character[0] = 0;
  for (int x = 1; x < q; x++)
    character[x * x % q] = 1;
  return MatrixXi::NullaryExpr (q, q, [&] (Index row, Index column) {
    return character[(column - row + q) % q];
  });
}

/** I + S with the skew conference matrix S of order q + 1, q = 3 mod 4. */
MatrixXi
paley_one (int q)
{
  MatrixXi matrix = MatrixXi::Ones (q + 1, q + 1);
  matrix.col (0).tail (q).setConstant (-1);
  matrix.bottomRightCorner (q, q) = jacobsthal (q) + MatrixXi::Identity (q, q);
  return matrix;
}

/** The symmetric conference matrix of order q + 1, q = 1 mod 4, with its zeros
 * and signs replaced by 2 x 2 blocks. */
MatrixXi
paley_two (int q)
{
  const Eigen::Matrix2i zero{{1, -1}, {-1, -1}}, one{{1, 1}, {1, -1}};
  MatrixXi conference = MatrixXi::Ones (q + 1, q + 1);
  conference (0, 0) = 0;
  conference.bottomRightCorner (q, q) = jacobsthal (q);
  MatrixXi matrix (2 * q + 2, 2 * q + 2);
  for (int i = 0; i <= q; i++)
    for (int j = 0; j <= q; j++)
      matrix.block<2, 2> (2 * i, 2 * j) =
          i == j ? zero : Eigen::Matrix2i (conference (i, j) * one);
  return matrix;
}

/** Sylvester's construction. */
MatrixXi
doubled (const MatrixXi &half)
{
  MatrixXi matrix (2 * half.rows (), 2 * half.rows ());
  matrix << half, half, half, -half;
  return matrix;
}

/** With +1 in the first row and column. */
MatrixXi
normalised (const MatrixXi &matrix)
{
  const MatrixXi columns = matrix * matrix.row (0).asDiagonal ();
  return columns.col (0).asDiagonal () * columns;
}

/**
 * A Hadamard matrix of +1 and -1 of that order, H H^T = order I, normalised.
 * Built from Paley's two constructions over prime fields (R. E. A. C. Paley, On
 * orthogonal matrices, 1933) and Sylvester's doubling; none where these do not
 * reach.
 */
std::optional<MatrixXi>
hadamard_matrix (int order)
{
  if (order == 1)
    return MatrixXi::Ones (1, 1);
  if (order == 2)
    return doubled (MatrixXi::Ones (1, 1));
  if (order < 4 || order % 4 != 0)
    return std::nullopt;
  if (is_prime (order - 1))
    return normalised (paley_one (order - 1));
  if (const auto half = hadamard_matrix (order / 2))
    return normalised (doubled (*half));
  if (is_prime (order / 2 - 1) && (order / 2 - 1) % 4 == 1)
    return normalised (paley_two (order / 2 - 1));
  return std::nullopt;
}

/** Positive where an element is on: what a normalised Hadamard matrix of order
 * n + 1 leaves without its first row and column, with the signs changed, or
 * one of order n; none where there is neither. */
std::optional<MatrixXi>
s_matrix (int n)
{
  if (const auto hadamard = hadamard_matrix (n + 1))
    return -hadamard->bottomRightCorner (n, n);
  return hadamard_matrix (n);
}

/** Names the nearest numbers of elements that have an S-matrix; 2 and 256
 * do. */
Error
no_s_matrix (int n)
{
  const auto nearest = [n] (int step) {
    int other = n + step;
    while (!s_matrix (other))
      other += step;
    return std::to_string (other);
  };
  return {"code 's-matrix' cannot be built for " + std::to_string (n) +
          " elements, only where a Hadamard matrix of order n or n + 1 is "
          "known; the nearest are " +
          nearest (-1) + " and " + nearest (1)};
}

} // namespace

Code::Code (std::string name, int n, const std::function<bool (int, int)> &on)
    : name_ (std::move (name)), n_ (n)
{
  for (int e = 0; e < n; e++)
    for (int s = 0; s < n; s++)
      on_.push_back (on (e, s));
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
    return Code ("sequential", n, std::equal_to ());
  if (name == "staircase")
    return Code ("staircase", n, std::greater_equal ());
  if (name == "s-matrix") {
    const auto matrix = s_matrix (n);
    if (!matrix)
      return no_s_matrix (n);
    return Code ("s-matrix", n,
        [&matrix] (int e, int s) { return (*matrix) (e, s) > 0; });
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
  }
  return Code ("matrix", int (n), [&rows] (int e, int s) {
    return rows[std::size_t (e)][std::size_t (s)] == '1';
  });
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

Result<Code>
Code::complement () const
{
  for (int e = 0; e < n_; e++)
    if (on_slots (e) == n_)
      return Error{"element " + std::to_string (e) + " of code " +
                   in_quotes (name_) +
                   " is on in every slot, so that the beam of the mirrors that "
                   "are off never has its light; use sequential"};
  return Code ("matrix", n_, [this] (int e, int s) { return !on (e, s); });
}

Code
Code::from_slot (int first) const
{
  return Code ("matrix", n_,
      [this, first] (int e, int s) { return on (e, (s + first) % n_); });
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
  Matrix light;
  for (int e = 0; e < n_; e++)
    for (int s = 0; s < n_; s++)
      light.push_back (this->light (e, s, leak));
  auto inverse = inverted (light, std::size_t (n_));
  if (!inverse)
    return Error{
        "code '" + name_ + "' of " + std::to_string (n_) +
        " elements cannot be inverted at a leak of " + real_text (leak) +
        ": its rows are not independent, or nearly so, and the light "
        "of single slots cannot be solved for; use rank, or a code such as "
        "sequential"};
  return *std::move (inverse);
}

} // namespace codedexposure
