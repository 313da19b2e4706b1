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

/** The inverse of @p a, n x n; none where it is singular, or so nearly that an
 * element of the product of both is off by more than 1e-6. */
std::optional<Matrix> inverted (const Matrix &a, std::size_t n);

} // namespace codedexposure
