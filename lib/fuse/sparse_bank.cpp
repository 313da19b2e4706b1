/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/sparse_bank.h"

#include <numeric>

#include "fuse/filter_bank.h"

namespace codedexposure::fuse
{

SparseSources::SparseSources (std::array<int, 3> reach, const SplitField &frame)
    : reach_ (reach), margin_ (frame.margin ())
{
  for (int x = -margin_; x < frame.period () + margin_; x++)
    places_.push_back (frame.place (x));
  for (std::size_t f = 0; f < 3; f++) {
    first_[f] = rows_ * int (places_.size ());
    if (reach[f] >= 0)
      rows_ += 2 * reach[f] + 1;
  }
}

int
SparseSources::number (const Tap &tap) const
{
  const auto frame = std::size_t (tap.frame + 1);
  return first_[frame] + (tap.y + reach_[frame]) * int (places_.size ()) +
         tap.x + margin_;
}

std::span<const std::int32_t *const>
SparseSources::row (const SplitFrames &frames, int y,
    std::vector<const std::int32_t *> &sources) const
{
  sources.resize (std::size_t (rows_) * places_.size ());
  const std::int32_t **source = sources.data ();
  for (std::size_t f = 0; f < 3; f++)
    for (int dy = -reach_[f]; dy <= reach_[f]; dy++) {
      const std::int32_t *row = frames[f]->row (y + dy);
      for (const std::ptrdiff_t place : places_)
        *source++ = row + place;
    }
  return sources;
}

SparseBank::SparseBank (const Phases &phases, int outputs, float steps)
    : outputs_ (outputs), period_ (phases.period ()), steps_ (steps),
      filters_ (std::size_t (phases.rows () * phases.period () * outputs))
{
}

void
SparseBank::set (const SparseSources &sources, int row, int x, int output,
    std::span<const Tap> taps, std::span<const float> weights)
{
  const WholeWeights whole = round_weights (weights);
  const auto &values = whole.values;
  const auto half = [] (int value) {
    return std::uint32_t (std::uint16_t (value));
  };
  Filter &filter =
      filters_[std::size_t ((row * period_ + x) * outputs_ + output)];
  for (std::size_t t = 0; t < values.size (); t++) {
    if (values[t] == 0)
      continue;
    std::uint32_t pair = half (values[t]);
    const Tap right{taps[t].x + 1, taps[t].y, taps[t].frame};
    const int source = sources.number (taps[t]);
    if (t + 1 < values.size () && taps[t + 1] == right)
      pair |= half (values[++t]) << 16;
    filter.pairs.push_back ({source, std::int32_t (pair)});
  }
  filter.scale = 1.0f / (whole.unit * steps_);
  base_ = float (-FilterBank::kSmallest) *
          float (std::accumulate (values.begin (), values.end (), 0)) /
          (whole.unit * steps_);
}

SparseRow
SparseBank::row (const Phases &phases, int y, int column, int output,
    std::span<const std::int32_t *const> sources,
    std::span<const Run> runs) const
{
  const int x = (column + phases.shift (y)) % period_;
  const Filter &filter = filters_[std::size_t (
      (phases.row_of (y) * period_ + x) * outputs_ + output)];
  return {sources.data () + column, filter.pairs.data (),
      int (filter.pairs.size ()), filter.scale, base_, runs.data (),
      int (runs.size ())};
}

} // namespace codedexposure::fuse
