/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Covariances of coded pixels, from a scene's and the responses of elements. */
#pragma once

#include <span>
#include <vector>

#include "estimate/observation.h"
#include "estimate/scene_model.h"

namespace codedexposure
{

/** A difference of two times in slots, and the part of all differences that
 * has this value. */
struct TimeStep {
  double slots;
  double part;
};

/** When light is collected. The default takes the scene at one moment of each
 * slot. */
struct SlotTimes {
  /** Times of one slot's light less times of another's, both relative to the
   * middle of their slot. */
  std::vector<TimeStep> light = {{0.0, 1.0}};
  /** Times of a slot's light less times for which an estimate stands. Empty:
   * as `light`. */
  std::vector<TimeStep> target = {};
};

/** Covariances of coded pixels with each other and with the light of slots
 * under one class of patches, in units of the scene's variance. */
class CodedCovariance
{
public:
  /** @p shares  responses of each element to @p slots slots.
   *  @p reach   largest distance along an axis, px. */
  CodedCovariance (const SceneClass &patch, std::span<const SlotShares> shares,
      int slots, int reach, const SlotTimes &times = {});

  /** Coded pixels of elements @p a and @p b, the one of a at @p apart from that
   * of b. */
  double coded (Offset apart, int a, int b) const
  {
    const Place &place = places_[place_of (apart)];
    return place.in_space *
           coded_[place.row * elements_ * elements_ +
                  std::size_t (a) * elements_ + std::size_t (b)];
  }
  /** A coded pixel of element @p a at @p apart from a point in @p slot. */
  double target (Offset apart, int a, int slot) const
  {
    const Place &place = places_[place_of (apart)];
    return place.in_space *
           targets_[(place.row * elements_ + std::size_t (a)) * slots_ +
                    std::size_t (slot)];
  }
  int slots () const { return int (slots_); }

private:
  /** Where nothing moves, covariances are products of a part in space and one
   * in time, the same at all places. */
  struct Place {
    double in_space;
    std::size_t row;
  };
  std::size_t place_of (Offset apart) const
  {
    return std::size_t (
        (apart.y + reach_) * (2 * reach_ + 1) + apart.x + reach_);
  }
  std::vector<double> between_slots (const SceneClass &patch, Offset apart,
      const std::vector<TimeStep> &steps) const;
  void add_row (std::span<const SlotShares> shares,
      const std::vector<double> &light, const std::vector<double> &target);

  int reach_;
  std::size_t elements_, slots_;
  std::vector<Place> places_;
  std::vector<double> coded_, targets_;
};

} // namespace codedexposure
