/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The linear filter of `fast`, of the model that fits around each pixel. */
#pragma once

#include <functional>
#include <vector>

#include "fuse/bands.h"
#include "fuse/models.h"
#include "fuse/partner_fit.h"
#include "fuse/predictions.h"
#include "fuse/static_pixels.h"

namespace codedexposure::fuse
{

/** Row @p y of every slot, of the frame's width, 255 for white. Threads may
 * call it for different rows at the same time. */
using RowSink = std::function<void (int y, const float *const *slots)>;

/** The sum of the filters of some models, with the preferences for them as
 * weights, where pixels are not static. */
class LinearFilter
{
public:
  /** @p plan  outlives this.
   *  @p fit   to partners, if there are any; likewise. */
  LinearFilter (
      const FilterPlan &plan, const Models &models, const PartnerFit *fit);

  void run (const CodedFrames &frames, const Predictions::Found &predicted,
      const StaticPixels::Found &still, const RowSink &sink, const Task &task);

private:
  using Banks = std::vector<FilterBank>; ///< of each model; groups are slots

  Banks make_filters (Neighbours neighbours) const;
  /** Of a thread. */
  struct Room;
  void share (const Predictions::Found &predicted,
      const StaticPixels::Found &still, int y, Room &to) const;
  void estimate (
      const Banks &filters, const CodedFrames &frames, int y, Room &to) const;

  const FilterPlan &plan_;
  Models models_;
  const PartnerFit *fit_;
  ForNeighbours<Banks> filters_;
};

} // namespace codedexposure::fuse
