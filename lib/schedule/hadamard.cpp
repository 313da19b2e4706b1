/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/hadamard.h"

#include <cstddef>

namespace codedexposure
{

namespace
{

SignMatrix
blank (int order)
{
  return {order, std::vector<std::int8_t> (std::size_t (order * order), 1)};
}

void
set (SignMatrix &matrix, int row, int column, int sign)
{
  matrix.signs[std::size_t (row * matrix.order + column)] = std::int8_t (sign);
}

bool
is_prime (int value)
{
  for (int d = 2; d * d <= value; d++)
    if (value % d == 0)
      return false;
  return value > 1;
}

/** Quadratic character of every residue of the prime @p q: 0, 1 or -1. */
std::vector<int>
quadratic_character (int q)
{
  std::vector<int> character (std::size_t (q), -1);
  character[0] = 0;
  for (int x = 1; x < q; x++)
    character[std::size_t (x * x % q)] = 1;
  return character;
}

/** I + S with the skew conference matrix S of order q + 1, q = 3 mod 4. */
SignMatrix
paley_one (int q)
{
  const std::vector<int> character = quadratic_character (q);
  SignMatrix matrix = blank (q + 1);
  for (int i = 0; i < q; i++) {
    set (matrix, i + 1, 0, -1);
    for (int j = 0; j < q; j++) {
      const int sign = character[std::size_t ((j - i + q) % q)];
      set (matrix, i + 1, j + 1, i == j ? 1 : sign);
    }
  }
  return matrix;
}

/** The symmetric conference matrix of order q + 1, q = 1 mod 4, with its zeros
 * and signs replaced by 2 x 2 blocks. */
SignMatrix
paley_two (int q)
{
  const std::vector<int> character = quadratic_character (q);
  SignMatrix matrix = blank (2 * (q + 1));
  for (int i = 0; i <= q; i++) {
    for (int j = 0; j <= q; j++) {
      const int sign =
          i == 0 || j == 0 ? 1 : character[std::size_t ((j - i + q) % q)];
      const int top_left = i == j ? 1 : sign;
      const int others = i == j ? -1 : sign;
      set (matrix, 2 * i, 2 * j, top_left);
      set (matrix, 2 * i, 2 * j + 1, others);
      set (matrix, 2 * i + 1, 2 * j, others);
      set (matrix, 2 * i + 1, 2 * j + 1, i == j ? -1 : -sign);
    }
  }
  return matrix;
}

SignMatrix
doubled (const SignMatrix &half)
{
  SignMatrix matrix = blank (2 * half.order);
  for (int i = 0; i < matrix.order; i++) {
    for (int j = 0; j < matrix.order; j++) {
      const bool minus = i >= half.order && j >= half.order;
      const int sign = half.at (i % half.order, j % half.order);
      set (matrix, i, j, minus ? -sign : sign);
    }
  }
  return matrix;
}

SignMatrix
normalised (SignMatrix matrix)
{
  for (int j = 0; j < matrix.order; j++)
    if (matrix.at (0, j) < 0)
      for (int i = 0; i < matrix.order; i++)
        set (matrix, i, j, -matrix.at (i, j));
  for (int i = 0; i < matrix.order; i++)
    if (matrix.at (i, 0) < 0)
      for (int j = 0; j < matrix.order; j++)
        set (matrix, i, j, -matrix.at (i, j));
  return matrix;
}

} // namespace

std::optional<SignMatrix>
hadamard_matrix (int order)
{
  if (order == 1 || order == 2)
    return order == 1 ? blank (1) : doubled (blank (1));
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

} // namespace codedexposure
