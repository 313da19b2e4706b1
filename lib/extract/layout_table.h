/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The sample grid in the form that kernels read. */
#pragma once

#include <cstdint>
#include <vector>

#include "extract/kernels.h"
#include "schedule/sample_grid.h"

namespace codedexposure
{

template <typename Pixel>
class LayoutTable
{
public:
  /** @p lanes  of the widest kernels that will read it. */
  LayoutTable (const SampleGrid &grid, int lanes);

  /** For a block that starts with cell (@p column, @p row); valid as long as
   * the table. */
  Layout<Pixel> from (int column, int row) const
  {
    return {places_.data (), n_, repeat_.width, repeat_.height,
        column % repeat_.width, row % repeat_.height, comb_.data (), identity_,
        elements_.data ()};
  }

private:
  int n_;
  Extent repeat_;
  bool identity_ = true;
  std::vector<std::uint8_t> places_;
  std::vector<std::uint8_t> elements_; ///< as far as Layout says
  std::vector<Pixel> comb_;
};

} // namespace codedexposure
