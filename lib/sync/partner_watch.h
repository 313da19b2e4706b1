/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Whether frames of two cameras, in both beams of the mirrors, are of one
 * exposure. */
#pragma once

#include <deque>
#include <optional>
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
 * that its frames would make with the three frames before, of each camera:
 * nothing needs to be known of the scene, of noise or of the cameras' gains.
 * Where nothing moves, no pair differs from another, and a wrong one does no
 * harm.
 *
 * After a frame alone, a camera's times may be others, and the right partner
 * may still have to come. The first three pairs are therefore also compared
 * with the last good one: a wrong pair is several times as uneven.
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
   * sizes. */
  Verdict take (const GreyView &on, const GreyView &off);
  /** Keeps a frame that has no partner, of the beam of the mirrors that are
   * @p off or on. */
  void take_alone (const GreyView &frame, bool off);
  /** The next pair has none before it. */
  void reset ()
  {
    before_on_.clear ();
    before_off_.clear ();
    usual_.reset ();
    new_pairs_ = 0;
  }

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

  Light read (const View &view, const GreyView &frame) const;
  static void keep (std::deque<Light> &before, Light light);
  double gain_of (const Pair &pair) const;
  double unevenness_of (const Pair &pair) const;
  double excess (const Pair &now, const Light &on, const Light &off) const;

  std::size_t size_;          ///< mirrors of a block
  std::vector<float> smooth_; ///< what a smooth scene can look like there
  double expected_ratio_;     ///< of the beams' light, of an even scene
  View on_, off_;
  std::deque<Light> before_on_, before_off_; // the last frames
  std::optional<double> usual_;              // unevenness of the last good pair
  int new_pairs_ = 0;                        // that follow frames alone
};

} // namespace codedexposure
