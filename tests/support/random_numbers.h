/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Numbers without order, the same at every run. */
#pragma once

#include <random>
#include <vector>

namespace cexp::test
{

/** @p count numbers from -100 to 100, in steps of 0.1. */
inline std::vector<float>
random_numbers (std::size_t count, unsigned seed)
{
  std::mt19937 engine (seed);
  std::vector<float> numbers (count);
  for (float &number : numbers)
    number = float (engine () % 2001) / 10.0f - 100.0f;
  return numbers;
}

} // namespace cexp::test
