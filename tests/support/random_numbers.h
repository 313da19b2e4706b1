/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Random numbers that are the same in every run. */
#pragma once

#include <random>
#include <vector>

namespace codedexposure::test
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

} // namespace codedexposure::test
