/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How far the second camera, in the other beam of the mirrors, has moved since
 * both were calibrated. */
#pragma once

#include <optional>
#include <vector>

#include "base/geometry.h"
#include "base/image.h"
#include "schedule/schedule.h"
#include "sync/mirror_light.h"

namespace codedexposure
{

/**
 * Compares where the scene is in the frames of both cameras.
 *
 * Over one period of the masks, the mirrors of a coded frame send the light of
 * each slot at the first camera once, and at the second N - 1 times. Sums over
 * a period around each mirror are thus ordinary pictures of the same light,
 * without masks, in both frames: what lies between them is the error of the
 * mappings, and can be seen wherever the scene has texture, whether it moves or
 * not; fast motion (0.7 px a slot) makes errors of some hundredths of a mirror.
 * It is found in nine parts of the frame, so that a rotation is seen, too.
 */
class PartnerDrift
{
public:
  struct Shift {
    /** From where a mirror is seen by the first camera to where it is seen by
     * the second one, mirrors. Errors of more than a mirror are found to be
     * about one. */
    Position by;
    double uncertainty; ///< standard deviation along each axis, mirrors
    Position at;        ///< the middle of the part, mirrors
  };

  /** @p on: in the beam of the mirrors that are on. */
  PartnerDrift (
      const Schedule &schedule, const BeamCamera &on, const BeamCamera &off);

  /** Of the part where it is largest; none: there is no texture, or no place
   * where both cameras see a period. */
  std::optional<Shift> largest (const GreyView &on, const GreyView &off) const;

private:
  struct Part {
    Position middle;
    std::vector<Position> on, off; ///< places of its mirrors, row after row
  };

  Image<float> picture (const GreyView &frame,
      const std::vector<Position> &places, double white) const;
  std::optional<Shift> shift (
      const Image<float> &on, const Image<float> &off, Position middle) const;

  Extent part_;   ///< its mirrors
  Extent period_; ///< a window of this size holds each label once
  double white_on_, white_off_;
  std::vector<Part> parts_;
};

} // namespace codedexposure
