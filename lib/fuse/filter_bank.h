/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Filters of every phase, laid out for the kernels. */
#pragma once

#include <span>
#include <vector>

#include "fuse/field.h"
#include "fuse/kernels.h"
#include "fuse/observation.h"

namespace cexp::fuse
{

/** For every pixel of a frame, @p outputs weighted sums over the same taps. */
class FilterBank
{
public:
  FilterBank (const Phases &phases, std::vector<Offset> taps, int outputs);

  /** Weights of the pixels at @p x of distinct row @p row of the phases. */
  void set (int row, int x, int output, std::span<const float> weights);
  /** Of all outputs, one after the other. */
  void set_all (int row, int x, std::span<const float> weights);
  /** How to filter row @p y of @p source, whose margin holds the taps;
   * @p offsets as offsets () gives them for a field of its size. */
  FilterRow row (const Phases &phases, const Field &source, int y,
      std::span<const std::ptrdiff_t> offsets) const;
  /** Where the taps lie in @p field. */
  std::vector<std::ptrdiff_t> offsets (const Field &field) const;

private:
  std::vector<Offset> taps_;
  int outputs_;
  int period_;
  int width_;
  std::vector<float> weights_;
};

} // namespace cexp::fuse
