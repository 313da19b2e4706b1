/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/dct.h"

#include <cmath>
#include <numbers>

namespace codedexposure::fuse
{

std::vector<float>
dct_matrix (int length)
{
  std::vector<float> matrix;
  for (int k = 0; k < length; k++) {
    const double scale = std::sqrt ((k == 0 ? 1.0 : 2.0) / length);
    for (int i = 0; i < length; i++)
      matrix.push_back (
          float (scale *
                 std::cos (std::numbers::pi * (2 * i + 1) * k / (2 * length))));
  }
  return matrix;
}

static DctTable
make_table ()
{
  const std::vector<float> matrix = dct_matrix (kBlock);
  DctTable table;
  for (int k = 0; k < kBlock; k++)
    for (int i = 0; i < kBlock / 2; i++)
      table.at[k][i] = matrix[std::size_t (k * kBlock + i)];
  return table;
}

const DctTable kDct = make_table ();

} // namespace codedexposure::fuse
