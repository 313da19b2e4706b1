/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/filter_bank.h"

namespace codedexposure::fuse
{

FilterBank::FilterBank (
    const Phases &phases, std::vector<Offset> taps, int outputs)
    : taps_ (std::move (taps)), outputs_ (outputs), period_ (phases.period ()),
      width_ (period_ + Field::kSlack - 1),
      weights_ (std::size_t (phases.rows ()) * taps_.size () *
                std::size_t (outputs) * std::size_t (width_))
{
}

void
FilterBank::set (int row, int x, int output, std::span<const float> weights)
{
  for (std::size_t t = 0; t < taps_.size (); t++) {
    const std::size_t line =
        (std::size_t (row) * taps_.size () + t) * std::size_t (outputs_) +
        std::size_t (output);
    float *to = weights_.data () + line * std::size_t (width_);
    for (int i = x; i < width_; i += period_)
      to[i] = weights[t];
  }
}

void
FilterBank::set_all (int row, int x, std::span<const float> weights)
{
  for (int k = 0; k < outputs_; k++)
    set (row, x, k,
        weights.subspan (std::size_t (k) * taps_.size (), taps_.size ()));
}

FilterRow
FilterBank::row (const Phases &phases, const Field &source, int y,
    std::span<const std::ptrdiff_t> offsets) const
{
  const std::size_t start = std::size_t (phases.row_of (y)) * taps_.size () *
                            std::size_t (outputs_) * std::size_t (width_);
  return {source.row (y), source.width (), offsets.data (), int (taps_.size ()),
      weights_.data () + start, width_, outputs_, period_, phases.shift (y)};
}

std::vector<std::ptrdiff_t>
FilterBank::offsets (const Field &field) const
{
  std::vector<std::ptrdiff_t> offsets;
  for (const Offset &tap : taps_)
    offsets.push_back (tap.y * field.stride () + tap.x);
  return offsets;
}

} // namespace codedexposure::fuse
