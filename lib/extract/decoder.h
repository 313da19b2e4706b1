/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The arithmetic that turns the light of elements into the light of slots. */
#pragma once

#include <span>
#include <vector>

#include "base/result.h"
#include "schedule/sample_grid.h"
#include "schedule/schedule.h"

namespace codedexposure
{

/** One summand of a slot's light: factor times the value of an element. */
struct Term {
  int element;
  double factor;
  bool operator== (const Term &) const = default;
};

/** Linear interpolation along one axis in whole numbers: near times the sample
 * itself plus far times its neighbour @p step cells away. */
struct Lerp {
  int near = 1;
  int far = 0;
  int step = 0;
};

/**
 * How decode computes slot s of a cell:
 *
 *   light = sum of factor * value over terms (s), in double precision and in
 *           the order of the elements; pixel = floor (light + 1/2), clamped.
 *
 * The value of an element is its pixel, or, interpolated, the whole number
 *
 *   x.near (y.near p + y.far p_y) + x.far (y.near p_x + y.far p_xy),
 *
 * 4 n times the bilinear mean at the centre of the cell; p_x, p_y and p_xy are
 * the element's pixels in the neighbouring cells. At the edge of the frame the
 * missing neighbour is the sample itself: whole cells are repeated, so that
 * the code keeps its phase. The factors contain 1 / (4 n) then.
 */
class Decoder
{
public:
  /** @p gain  0: schedule.white_slots (). Error when the code
   * cannot be inverted. */
  static Result<Decoder> make (
      const Schedule &schedule, double gain, bool interpolate);

  double gain () const { return gain_; }
  bool interpolates () const { return interpolates_; }
  int slots () const { return int (starts_.size ()) - 1; }
  std::span<const Term> terms (int slot) const
  {
    const std::size_t first = starts_[std::size_t (slot)];
    return std::span (terms_).subspan (
        first, starts_[std::size_t (slot) + 1] - first);
  }
  /** Weights of an element that stands at @p offset of its cell. */
  Lerp lerp_x (Offset offset) const { return lerp (offset.x, cell_.width); }
  Lerp lerp_y (Offset offset) const { return lerp (offset.y, cell_.height); }

private:
  Decoder () = default;
  Lerp lerp (int position, int length) const;

  double gain_ = 1.0;
  bool interpolates_ = false;
  Extent cell_;
  std::vector<Term> terms_;
  std::vector<std::size_t> starts_;
};

} // namespace codedexposure
