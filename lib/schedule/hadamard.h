/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Hadamard matrices, the source of multiplexing codes. */
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace codedexposure
{

/** A square matrix of +1 and -1. */
struct SignMatrix {
  int order = 0;
  std::vector<std::int8_t> signs;

  int at (int row, int column) const
  {
    return signs[std::size_t (row * order + column)];
  }
};

/**
 * A Hadamard matrix of that order, H H^T = order I, normalised: its first row
 * and column are +1. Built from Paley's two constructions over prime fields
 * (R. E. A. C. Paley, On orthogonal matrices, 1933) and Sylvester's doubling;
 * none where these do not reach.
 */
std::optional<SignMatrix> hadamard_matrix (int order);

} // namespace codedexposure
