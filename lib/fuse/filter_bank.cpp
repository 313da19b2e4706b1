/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/filter_bank.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace codedexposure::fuse
{

namespace
{

/** Weights times @p unit, a power of two. */
struct WholeWeights {
  std::vector<int> values;
  float unit;
};

/* The largest unit with which no weight and no sum of products overflows. */
float
unit_of (std::span<const float> weights)
{
  double sum = 0.0, largest = 0.0;
  for (const float weight : weights) {
    sum += std::abs (weight);
    largest = std::max (largest, std::abs (double (weight)));
  }
  const double most = 65535.0 - double (weights.size ());
  float unit = 1.0f;
  while (unit < 16384.0f && 2.0 * unit * largest < FilterBank::kLargest &&
         2.0 * unit * sum < most)
    unit *= 2.0f;
  return unit;
}

/* Rounded to 16 bits such that the sum stays: up where most is left, down
 * elsewhere. */
WholeWeights
round_weights (std::span<const float> weights)
{
  WholeWeights whole{{}, unit_of (weights)};
  std::vector<float> rest;
  double sum = 0.0;
  for (const float weight : weights) {
    const float scaled = weight * whole.unit;
    whole.values.push_back (int (std::floor (scaled)));
    rest.push_back (scaled - std::floor (scaled));
    sum += weight;
  }
  const double total = std::round (sum) * double (whole.unit);
  const auto missing = std::clamp<std::ptrdiff_t> (
      std::ptrdiff_t (total) -
          std::accumulate (whole.values.begin (), whole.values.end (), 0),
      0, std::ptrdiff_t (weights.size ()));
  std::vector<std::size_t> order (weights.size ());
  std::iota (order.begin (), order.end (), std::size_t (0));
  std::ranges::nth_element (
      order, order.begin () + missing, [&] (std::size_t a, std::size_t b) {
        return rest[a] != rest[b] ? rest[a] > rest[b] : a < b;
      });
  for (std::ptrdiff_t i = 0; i < missing; i++)
    whole.values[order[std::size_t (i)]]++;
  return whole;
}

} // namespace

TapSources::TapSources (const SplitField &frame, int neighbour)
    : reach_{neighbour, frame.margin (), neighbour, int (kPartnerRadius)},
      margin_ (frame.margin ()), period_ (frame.period ()),
      width_ (frame.width ())
{
  for (int x = -margin_; x < period_ + margin_; x++)
    places_.push_back (frame.place (x));
  for (std::size_t f = 0; f < reach_.size (); f++) {
    first_[f] = rows_ * int (places_.size ());
    rows_ += 2 * reach_[f] + 1;
  }
}

int
TapSources::number (const Tap &tap) const
{
  const auto frame = std::size_t (tap.frame + 1);
  return first_[frame] + (tap.y + reach_[frame]) * int (places_.size ()) +
         tap.x + margin_;
}

std::span<const std::int32_t *const>
TapSources::row (const CodedFrames &frames, int y,
    std::vector<const std::int32_t *> &sources) const
{
  const std::array<const CodedLight *, 4> all{frames.before, frames.now,
      frames.after, frames.has_partner () ? &frames.now->partner : nullptr};
  static_assert (kPartner == all.size () - 2);
  sources.resize (std::size_t (rows_) * places_.size ());
  for (std::size_t f = 0; f < all.size (); f++) {
    if (!all[f])
      continue;
    const std::int32_t **source = sources.data () + first_[f];
    for (int dy = -reach_[f]; dy <= reach_[f]; dy++) {
      const std::int32_t *row = all[f]->pairs.row (y + dy);
      for (const std::ptrdiff_t place : places_)
        *source++ = row + place;
    }
  }
  return sources;
}

FilterBank::FilterBank (const FilterPlan &plan, int groups)
    : plan_ (&plan), groups_ (groups),
      filters_ (
          std::size_t (plan.phases.rows () * plan.phases.period () * groups))
{
}

void
FilterBank::set (int row, int x, int group, std::span<const Tap> taps,
    std::span<const float> weights)
{
  Filter &filter = filters_[place (row * plan_->phases.period () + x, group)];
  std::vector<WholeWeights> outputs;
  for (std::size_t at = 0; at < weights.size (); at += taps.size ()) {
    const auto &[values, unit] = outputs.emplace_back (
        round_weights (weights.subspan (at, taps.size ())));
    filter.scales.push_back (1.0f / (unit * plan_->steps));
    base_ = float (-kSmallest) *
            float (std::accumulate (values.begin (), values.end (), 0)) /
            (unit * plan_->steps);
  }
  const auto used = [&] (std::size_t t) {
    return std::ranges::any_of (outputs,
        [t] (const WholeWeights &output) { return output.values[t] != 0; });
  };
  for (std::size_t t = 0; t < taps.size (); t++) {
    if (!used (t))
      continue;
    const Tap right{taps[t].x + 1, taps[t].y, taps[t].frame};
    const bool two = t + 1 < taps.size () && taps[t + 1] == right;
    filter.count++;
    filter.pairs.push_back (plan_->sources.number (taps[t]));
    for (const auto &[values, unit] : outputs) {
      const auto half = [] (int value) {
        return std::uint32_t (std::uint16_t (value));
      };
      filter.pairs.push_back (std::int32_t (
          half (values[t]) | (two ? half (values[t + 1]) << 16 : 0u)));
    }
    t += two;
  }
}

FilterRow
FilterBank::row (int phase, int column, int group,
    std::span<const std::int32_t *const> sources,
    std::span<const Run> runs) const
{
  const Filter &filter = filters_[place (phase, group)];
  return {sources.data () + column, filter.pairs.data (), filter.count,
      int (filter.scales.size ()), filter.scales.data (), base_, runs.data (),
      int (runs.size ())};
}

} // namespace codedexposure::fuse
