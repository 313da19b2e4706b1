/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "estimate/covariance.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <utility>

namespace codedexposure
{

namespace
{

/* The covariances of each element with each slot, element after element, where
 * slots that are d apart have between[slots - 1 - d]. */
void
set_with_slots (std::span<const SlotShares> shares,
    const std::vector<double> &between, std::size_t slots, double *to)
{
  for (const SlotShares &element : shares) {
    std::fill_n (to, slots, 0.0);
    for (const auto &[s, response] : element) {
      const double *from = between.data () + (slots - 1 - std::size_t (s));
      for (std::size_t slot = 0; slot < slots; slot++)
        to[slot] += response * from[slot];
    }
    to += slots;
  }
}

/* Places with the same key have the same covariances but for a factor: nothing
 * moves, or the same speeds are possible in all directions. */
std::pair<int, int>
key_of (const SceneClass &patch, int dx, int dy)
{
  if (!patch.moves ())
    return {0, 0};
  if (patch.directed ())
    return {dx, dy};
  if (patch.spread > 0.0)
    return {dx * dx + dy * dy, 0};
  return std::minmax ({std::abs (dx), std::abs (dy)});
}

} // namespace

CodedCovariance::CodedCovariance (const SceneClass &patch,
    std::span<const SlotShares> shares, int slots, int reach,
    const SlotTimes &times)
    : reach_ (reach), elements_ (shares.size ()), slots_ (std::size_t (slots))
{
  std::map<std::pair<int, int>, std::size_t> rows;
  const auto most = std::size_t (2 * reach + 1) * std::size_t (2 * reach + 1) *
                    elements_; // of rows
  coded_.reserve (most * elements_);
  targets_.reserve (most * slots_);
  for (int dy = -reach; dy <= reach; dy++)
    for (int dx = -reach; dx <= reach; dx++) {
      const auto [row, is_new] =
          rows.try_emplace (key_of (patch, dx, dy), rows.size ());
      const double in_space =
          patch.moves () ? 1.0 : scene_correlation (patch, dx, dy, 0.0);
      places_.push_back ({in_space, row->second});
      if (!is_new)
        continue;
      const Offset apart = patch.moves () ? Offset{dx, dy} : Offset{};
      const auto light = between_slots (patch, apart, times.light);
      add_row (shares, light,
          times.target.empty () ? light
                                : between_slots (patch, apart, times.target));
    }
}

/* Covariances of the light of a slot and of one d before it, at
 * [slots - 1 - d]. */
std::vector<double>
CodedCovariance::between_slots (const SceneClass &patch, Offset apart,
    const std::vector<TimeStep> &steps) const
{
  const int n = int (slots_);
  std::vector<double> between (2 * slots_ - 1);
  for (int d = patch.directed () ? 1 - n : 0; d < n; d++) {
    double &sum = between[std::size_t (n - 1 - d)];
    for (const auto &[later, part] : steps)
      sum += part * scene_correlation (patch, apart.x, apart.y, d + later);
    if (!patch.directed ())
      between[std::size_t (n - 1 + d)] = sum;
  }
  return between;
}

void
CodedCovariance::add_row (std::span<const SlotShares> shares,
    const std::vector<double> &light, const std::vector<double> &target)
{
  const std::size_t of_row = elements_ * slots_;
  targets_.resize (targets_.size () + of_row);
  set_with_slots (
      shares, target, slots_, targets_.data () + targets_.size () - of_row);
  std::vector<double> with_slots (of_row);
  set_with_slots (shares, light, slots_, with_slots.data ());
  coded_.resize (coded_.size () + elements_ * elements_);
  double *to = coded_.data () + coded_.size () - elements_ * elements_;
  for (std::size_t a = 0; a < elements_; a++)
    for (const SlotShares &other : shares) {
      double sum = 0.0;
      for (const auto &[slot, response] : other)
        sum += response * with_slots[a * slots_ + std::size_t (slot)];
      *to++ = sum;
    }
}

} // namespace codedexposure
