/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/phases.h"

#include <algorithm>
#include <cstdlib>
#include <functional>

#include "estimate/kriging.h"

namespace codedexposure::fuse
{

Phases::Phases (const Schedule &schedule)
    : schedule_ (schedule), period_ (schedule.tile ().period_x ())
{
  for (int y = 0; y < schedule.tile ().period_y (); y++) {
    Row found{-1, 0};
    for (int row = 0; row < rows () && found.row < 0; row++) {
      for (int shift = 0; shift < period_ && found.row < 0; shift++)
        if (is_shift (y, row_starts_[std::size_t (row)], shift))
          found = {row, shift};
    }
    if (found.row < 0) {
      found.row = rows ();
      row_starts_.push_back (y);
    }
    rows_.push_back (found);
  }
}

/* Whether everything seen from row @y equals what is seen from row @from,
 * @shift pixels to the right. */
bool
Phases::is_shift (int y, int from, int shift) const
{
  for (int dy = 0; dy < schedule_.tile ().period_y (); dy++)
    for (int x = 0; x < period_; x++)
      if (schedule_.element_at (x, y + dy) !=
          schedule_.element_at (x + shift, from + dy))
        return false;
  return true;
}

std::vector<int>
Phases::elements (int row, int x, std::span<const Tap> taps) const
{
  const int y = row_starts_[std::size_t (row)];
  std::vector<int> elements;
  for (const Tap &tap : taps)
    elements.push_back (schedule_.element_at (x + tap.x, y + tap.y));
  return elements;
}

std::vector<Tap>
taps_within (double radius, int frame)
{
  std::vector<Tap> taps;
  for (const Offset &at : disc (radius))
    taps.push_back ({at.x, at.y, frame});
  return taps;
}

namespace
{

/* The frames of taps as one exposure of several times as many slots. Elements
 * of later frames come after those of earlier ones. */
struct Exposure {
  int first, frames;
  int slots, elements; ///< of one frame
  std::vector<SlotShares> shares;

  Exposure (const Observation &observation, std::span<const Tap> taps)
      : slots (observation.slots ()),
        elements (int (observation.shares ().size ()))
  {
    const auto [low, high] =
        std::ranges::minmax (taps, std::less (), &Tap::frame);
    first = low.frame;
    frames = high.frame - low.frame + 1;
    for (int frame = 0; frame < frames; frame++)
      for (SlotShares element : observation.shares ()) {
        for (SlotShare &share : element)
          share.slot += frame * slots;
        shares.push_back (std::move (element));
      }
  }
  int element (const Tap &tap, int of_frame) const
  {
    return (tap.frame - first) * elements + of_frame;
  }
};

PhaseWeights
weights_of (const CodedCovariance &covariance, const Observation &observation,
    const Exposure &exposure, std::span<const Tap> taps,
    std::span<const int> elements, std::span<const double> noise)
{
  const std::size_t m = taps.size (), n = std::size_t (exposure.slots);
  const std::size_t middle =
      std::size_t (std::ranges::find (taps, Tap{0, 0, 0}) - taps.begin ());
  std::vector<Offset> places;
  std::vector<int> exposed;
  for (std::size_t i = 0; i < m; i++) {
    places.push_back ({taps[i].x, taps[i].y});
    exposed.push_back (exposure.element (taps[i], elements[i]));
  }
  KrigingSystem system = slot_equations (covariance, places, exposed, noise);
  /* Only the slots of the middle frame are sought. */
  const std::size_t before = std::size_t (-exposure.first) * n * m;
  system.targets.erase (system.targets.begin (),
      system.targets.begin () + std::ptrdiff_t (before));
  /* Ordinary kriging. As one target more, row `middle` of the inverse of the
   * bordered matrix: it holds the prediction of that pixel by all others,
   * scaled. */
  system.flat.assign (m, 1.0);
  system.flat_targets.assign (n, 1.0);
  system.flat_targets.push_back (0.0);
  system.targets.resize (n * m);
  system.targets.resize ((n + 1) * m);
  system.targets[n * m + middle] = 1.0;
  const std::vector<double> solved = solve_kriging (system);

  const auto residual = solved.begin () + std::ptrdiff_t (n * m);
  PhaseWeights weights;
  weights.slots.assign (solved.begin (), residual);
  for (std::size_t i = 0; i < m; i++)
    weights.residual.push_back (float (
        -residual[std::ptrdiff_t (i)] / residual[std::ptrdiff_t (middle)]));
  if (observation.exact () && observation.noise_free ()) {
    const int known = observation.shares (elements[middle])[0].slot;
    const auto slot = weights.slots.begin () + known * std::ptrdiff_t (m);
    std::fill_n (slot, m, 0.0f);
    slot[std::ptrdiff_t (middle)] = 1.0f;
  }
  return weights;
}

} // namespace

void
for_each_phase (const Phases &phases, const Observation &observation,
    const SceneClass &patch, std::span<const Tap> taps,
    std::span<const double> noise, const UseWeights &use)
{
  int radius = 0;
  for (const Tap &tap : taps)
    radius = std::max ({radius, std::abs (tap.x), std::abs (tap.y)});
  const Exposure exposure (observation, taps);
  const CodedCovariance covariance (
      patch, exposure.shares, exposure.slots * exposure.frames, 2 * radius);
  std::vector<double> noises;
  for (int frame = 0; frame < exposure.frames; frame++)
    noises.insert (noises.end (), noise.begin (), noise.end ());
  for (int row = 0; row < phases.rows (); row++)
    for (int x = 0; x < phases.period (); x++)
      use (row, x,
          weights_of (covariance, observation, exposure, taps,
              phases.elements (row, x, taps), noises));
}

} // namespace codedexposure::fuse
