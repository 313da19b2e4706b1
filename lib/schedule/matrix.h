/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Small square matrices. */
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace codedexposure
{

/** Square and row-major. */
using Matrix = std::vector<double>;

/** The inverse of @p a, n x n, by Gauss-Jordan with partial pivoting; none
 * where a pivot vanishes. */
std::optional<Matrix> inverted (Matrix a, std::size_t n);

} // namespace codedexposure
