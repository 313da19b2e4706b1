/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/filter_bank.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace codedexposure::fuse
{

namespace
{

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

} // namespace

/* Up where most is left, down elsewhere. */
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
  std::ranges::stable_sort (
      order, [&] (std::size_t a, std::size_t b) { return rest[a] > rest[b]; });
  for (std::ptrdiff_t i = 0; i < missing; i++)
    whole.values[order[std::size_t (i)]]++;
  return whole;
}

FilterBank::FilterBank (
    const Phases &phases, std::span<const Tap> taps, int outputs, float steps)
    : outputs_ (outputs), period_ (phases.period ()),
      width_ (period_ + Field::kSlack - 1), steps_ (steps)
{
  for (const Tap &tap : taps) {
    const Tap left{tap.x - 1, tap.y, tap.frame};
    if (!pairs_.empty () && pairs_.back () == left && !places_.back ().upper) {
      places_.push_back ({pairs_.size () - 1, true});
    } else {
      places_.push_back ({pairs_.size (), false});
      pairs_.push_back (tap);
    }
  }
  const std::size_t line = std::size_t (outputs) * std::size_t (width_);
  weights_.resize (std::size_t (phases.rows ()) * pairs_.size () * line);
  scales_.resize (std::size_t (phases.rows ()) * line);
}

void
FilterBank::set (int row, int x, int output, std::span<const float> weights)
{
  const WholeWeights whole = round_weights (weights);
  std::vector<std::int32_t> pairs (pairs_.size ());
  for (std::size_t t = 0; t < places_.size (); t++) {
    const auto [pair, upper] = places_[t];
    const auto half = std::uint16_t (whole.values[t]);
    pairs[pair] |= std::int32_t (std::uint32_t (half) << (upper ? 16 : 0));
  }
  const auto line_at = [&] (std::size_t line) {
    return (line * std::size_t (outputs_) + std::size_t (output)) *
           std::size_t (width_);
  };
  const auto repeat = [&] (auto *to, auto value) {
    for (int i = x; i < width_; i += period_)
      to[i] = value;
  };
  for (std::size_t p = 0; p < pairs.size (); p++)
    repeat (weights_.data () + line_at (std::size_t (row) * pairs.size () + p),
        pairs[p]);
  repeat (scales_.data () + line_at (std::size_t (row)),
      1.0f / (whole.unit * steps_));
  const int sum =
      std::accumulate (whole.values.begin (), whole.values.end (), 0);
  base_ = float (-kSmallest) * float (sum) / (whole.unit * steps_);
}

void
FilterBank::set_all (int row, int x, std::span<const float> weights)
{
  for (int k = 0; k < outputs_; k++)
    set (row, x, k,
        weights.subspan (std::size_t (k) * places_.size (), places_.size ()));
}

PairRow
FilterBank::row (const Phases &phases, const PairFrames &frames, int y,
    std::vector<const std::int32_t *> &sources) const
{
  sources.clear ();
  for (const Tap &pair : pairs_)
    sources.push_back (
        frames[std::size_t (pair.frame + 1)]->row (y + pair.y) + pair.x);
  const std::size_t row = std::size_t (phases.row_of (y)) *
                          std::size_t (outputs_) * std::size_t (width_);
  return {sources.data (), frames[1]->width (), int (pairs_.size ()),
      weights_.data () + row * pairs_.size (), scales_.data () + row, base_,
      width_, outputs_, period_, phases.shift (y)};
}

} // namespace codedexposure::fuse
