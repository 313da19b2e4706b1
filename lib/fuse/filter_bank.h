/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Filters of every phase, in the layout of the kernels. */
#pragma once

#include <span>
#include <vector>

#include "fuse/field.h"
#include "fuse/kernels.h"
#include "fuse/phases.h"

namespace codedexposure::fuse
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
  /** The kernels' input for row @p y of @p source, whose margin is as large as
   * the taps' radius; @p offsets from offsets () of a field of its size. */
  FilterRow row (const Phases &phases, const Field &source, int y,
      std::span<const std::ptrdiff_t> offsets) const;
  /** Offsets of the taps in @p field. */
  std::vector<std::ptrdiff_t> offsets (const Field &field) const;

private:
  std::vector<Offset> taps_;
  int outputs_;
  int period_;
  int width_;
  std::vector<float> weights_;
};

} // namespace codedexposure::fuse
