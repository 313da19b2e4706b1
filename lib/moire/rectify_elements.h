/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Which mirror is open when; for the sources of lib/moire only. */
#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "schedule/matrix.h"
#include "schedule/schedule.h"

namespace cexp
{

/**
 * The elements of all parts of a schedule under one set of numbers: those that
 * are open at the same times have the same one, whatever their part.
 */
class Elements
{
public:
  /** Of an array of @p mirrors, and a scene that correlates with itself a slot
   * of the fastest part later by @p persistence. */
  Elements (const Schedule &schedule, Extent mirrors, double persistence);

  /** The background, which is the whole array, then the regions. */
  int parts () const { return int (parts_.size ()); }
  const Rect &rect (int part) const { return get (part).rect; }
  const Tile &tile (int part) const { return get (part).schedule.tile (); }

  /** Of mirror (@p x, @p y); beyond the array, tiles go on as at its border. */
  int at (int x, int y) const { return at (part_at (x, y), x, y); }
  /** The same if @p part were all there is. */
  int at (int part, int x, int y) const;

  /** Mean light in a flat scene, in slots. */
  double light (int element) const { return light_[std::size_t (element)]; }
  /** Of the brightest element. */
  double most_light () const;
  /** Covariance of the light of two elements at one place. */
  double covariance (int e, int f) const
  {
    return covariances_.empty ()
               ? covariance_of (e, f)
               : covariances_[std::size_t (e) * open_.size () +
                              std::size_t (f)];
  }

private:
  using Openness = std::vector<double>; // in each slot: 1, or the leak
  struct Part {
    Schedule schedule;
    Rect rect;
    std::vector<int> numbers; // of the part's own elements
  };

  const Part &get (int part) const { return parts_[std::size_t (part)]; }
  int part_at (int x, int y) const;
  void add_part (const Schedule &whole, int region, const Rect &rect);
  double covariance_of (int e, int f) const;

  std::vector<Part> parts_;
  std::map<Openness, int> known_;
  std::vector<Openness> open_, later_; // later: what goes with a slot's light
  std::vector<double> light_;
  Matrix covariances_; // empty where they are too many
};

} // namespace cexp
