/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "stats/matern.h"

#include <cstddef>
#include <vector>

namespace cexp
{

/* From a table: the Bessel function takes its time. */
double
matern_1 (double r)
{
  constexpr int kSteps = 256, kReach = 24;
  static const std::vector<double> table = [] {
    std::vector<double> values = {1.0};
    for (int i = 1; i <= kSteps * kReach + 1; i++)
      values.push_back (
          double (i) / kSteps * std::cyl_bessel_k (1.0, double (i) / kSteps));
    return values;
  }();
  if (r >= kReach)
    return 0.0;
  const auto at = std::size_t (r * kSteps);
  const double part = r * kSteps - double (at);
  return table[at] + part * (table[at + 1] - table[at]);
}

} // namespace cexp
