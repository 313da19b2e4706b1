/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What two cameras, in both beams of the mirrors, saw of a whole exposure. */
#pragma once

#include <cstdint>

#include "base/image.h"
#include "schedule/schedule.h"

namespace codedexposure
{

/** Pixel values of both cameras and of their sum, DN. */
struct BeamLevels {
  double on_white;        ///< saturated from here on, less the black level
  double off_black = 0.0; ///< without light
  double off_white;       ///< saturated from here on
  double sum_white;       ///< of the sum, from 0
};

/**
 * Adds the light of both beams: each mirror sends that of every moment into one
 * of them, so that the sum is the picture of an ordinary exposure, whatever the
 * masks were, and with light that leaks from one beam into the other.
 */
class BeamSum
{
public:
  /**
   * @p schedule: of the first camera, whose complement the second one sees.
   * @p ratio: light of a pixel of the second camera, where that of the first is
   * 1 and mirrors are on for half of the time; 0: measured in each pair, as
   * that for which both saw a scene of the same mean.
   * @p seen: 0 for mirrors that a camera does not see, which are black in the
   * sum and tell nothing of the ratio; empty: both see all.
   */
  BeamSum (const Schedule &schedule, Extent mirrors, double ratio,
      Image<std::uint8_t> seen = {});

  /**
   * Both frames have a pixel a mirror; @p on is without its black level. Of
   * @p sum, the rows and columns are those of the first pixels. The lightest
   * pixel that saturates neither camera becomes white; those that are saturated
   * in either are as well. Returns the ratio.
   */
  template <typename Pixel>
  double add (ImageView<const Pixel> on, ImageView<const Pixel> off,
      const BeamLevels &levels, ImageView<Pixel> sum) const;

private:
  double share_; ///< of the light that the first camera gets
  double ratio_;
  Image<std::uint8_t> seen_;
};

} // namespace codedexposure
