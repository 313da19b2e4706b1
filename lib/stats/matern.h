/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How alike two points of a scene are, by their distance: Matern's
 * correlations. */
#pragma once

#include <cmath>

namespace cexp
{

/** Of order 3/2 at a distance of @p r lengths: (1 + r) e^-r. */
inline double
matern_3_2 (double r)
{
  return (1.0 + r) * std::exp (-r);
}

/** Of order 1: r K1 (r), to 1e-5. */
double matern_1 (double r);

} // namespace cexp
