/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Whether frames of two cameras, in both beams of the mirrors, are of one
 * exposure. */
#pragma once

#include <deque>
#include <vector>

#include "base/geometry.h"
#include "base/image.h"
#include "schedule/schedule.h"
#include "sync/mirror_light.h"

namespace codedexposure
{

/**
 * Determines from the pixels whether a coded frame and a frame of the other
 * beam are partners.
 *
 * Every mirror sends the light of each slot into one of the beams, so the sum
 * of partners shows no masks. The sum of frames of different exposures shows
 * them wherever the scene moved. Each pair is therefore compared with those
 * that its frames would make with the three frames before: nothing needs to be
 * known of the scene, of noise or of the cameras' gains. Where nothing moves,
 * no pair differs from another, and a wrong one does no harm.
 *
 * Only mirrors count on which pixels of both cameras lie, to a quarter of a
 * pixel; where a mapping leaves hardly any, no verdict is known.
 */
class PartnerWatch
{
public:
  enum class Verdict {
    unknown, ///< the first pair, or hardly anything moves
    good,    ///< both other pairs are clearly worse
    bad,     ///< another pair is clearly better
  };

  using Camera = BeamCamera;

  /** @p on: in the beam of the mirrors that are on. */
  PartnerWatch (const Schedule &schedule, const Camera &on, const Camera &off);

  /** Compares, and keeps both for the next pair. The views have the cameras'
   * sizes; for 8 and 16 bits. */
  template <typename Pixel, typename OtherPixel>
  Verdict take (ImageView<const Pixel> on, ImageView<const OtherPixel> off);
  /** The next pair has none before it. */
  void reset () { before_.clear (); }

private:
  struct View {
    std::vector<Position> places = {}; ///< of mirrors, block after block
    double black, white;
  };
  struct Light {
    /* Without what is smooth in the block; not a number in blocks that have a
     * saturated pixel. */
    std::vector<float> levels = {};
    double sum = 0.0; ///< above black
  };
  struct Pair {
    Light on = {}, off = {};
  };

  template <typename Pixel>
  Light read (const View &view, ImageView<const Pixel> frame) const;
  double excess (const Pair &now, const Light &on, const Light &off) const;

  std::size_t size_;          ///< mirrors of a block
  std::vector<float> smooth_; ///< what a smooth scene can look like there
  double expected_ratio_;     ///< of the beams' light, of an even scene
  View on_, off_;
  std::deque<Pair> before_;
};

} // namespace codedexposure
