/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Interpolation between the samples of a subframe. */
#pragma once

#include "base/image.h"
#include "schedule/schedule.h"

namespace codedexposure::quality
{

/**
 * Linear interpolation over the Delaunay triangles of an element's pixels.
 *
 * The simplest reconstruction that knows the true sample positions and favours
 * no tile. Only for tiles whose elements each lie on a lattice, as those of
 * raster groups, lattices and diamonds do.
 */
class Upsampler
{
public:
  /** @p centred: the samples stand at the centres of the cells instead of
   * their element's places; raster tiles only. */
  Upsampler (const Schedule &schedule, int element, bool centred);

  /** Value at coded pixel (@p x, @p y), which must be at least margin () away
   * from the border of the cells. */
  double at (ImageView<const float> subframe, int x, int y) const;

  /** Reach of the triangles, in pixels. */
  int margin () const { return margin_; }

private:
  Extent cell_;
  double origin_x_ = 0.0, origin_y_ = 0.0; // of some sample
  Offset a_, b_; // shortest vectors between samples, at no obtuse angle
  int margin_ = 0;
};

} // namespace codedexposure::quality
