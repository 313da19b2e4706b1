/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Which mirror is on when; for this folder only. */
#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "estimate/observation.h"
#include "schedule/element_map.h"

namespace codedexposure
{

/**
 * The elements of all parts of a schedule under one set of numbers: those that
 * are on at the same times have the same one in every part.
 */
class Elements
{
public:
  /** Of an array of @p mirrors. */
  Elements (const Schedule &schedule, Extent mirrors);

  /** The background, which is the whole array, then the regions. */
  int parts () const { return map_.parts (); }
  const Rect &rect (int part) const { return rects_[std::size_t (part)]; }
  const Tile &tile (int part) const { return map_.part (part).tile (); }

  /** Of mirror (@p x, @p y); beyond the array, tiles continue. */
  int at (int x, int y) const { return at (part_at (x, y), x, y); }
  /** The same if the whole array were @p part. */
  int at (int part, int x, int y) const
  {
    return numbers_[std::size_t (map_.at (part, x, y))];
  }

  /** Mean light in a flat scene, in slots. */
  double light (int element) const { return light_[std::size_t (element)]; }
  /** Of the brightest element. */
  double most_light () const;
  /** Light that each element passes of each slot of the exposure. */
  const std::vector<SlotShares> &shares () const { return shares_; }
  int slots () const { return map_.schedule ().slots (); }
  /** Slots of the part with the most of them. */
  int most_slots () const;

private:
  int part_at (int x, int y) const;
  void number (int element);

  ElementMap map_;
  std::vector<Rect> rects_;                  // of the parts
  std::vector<int> numbers_;                 // of the map's elements
  std::map<std::vector<double>, int> known_; // by the light of each slot
  std::vector<SlotShares> shares_;
  std::vector<double> light_;
};

} // namespace codedexposure
