/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/phases.h"

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <utility>

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

std::vector<Tap>
taps_around (double own, double neighbours, bool previous, bool next)
{
  std::vector<Tap> taps = taps_within (own);
  for (const int frame : {-1, 1})
    if (frame < 0 ? previous : next)
      std::ranges::copy (
          taps_within (neighbours, frame), std::back_inserter (taps));
  return taps;
}

namespace
{

/* The mean over targets of the expected squared error of ordinary kriging in
 * flat light, 1 - w c + lambda. The multiplier lambda is the same in all
 * equations of a target; it is taken from that of tap @middle. */
double
mean_variance (const KrigingSystem &system, std::size_t middle,
    std::span<const double> weights, std::size_t targets)
{
  const std::size_t m = system.noise.size ();
  const auto covariance = [&] (std::size_t i) {
    return system.covariance[std::min (i, middle) * m + std::max (i, middle)];
  };
  double sum = 0.0;
  for (std::size_t k = 0; k < targets; k++) {
    const double *w = weights.data () + k * m;
    const double *c = system.targets.data () + k * m;
    double variance = 1.0 - c[middle] + system.noise[middle] * w[middle];
    for (std::size_t i = 0; i < m; i++)
      variance += w[i] * (covariance (i) - c[i]);
    sum += variance;
  }
  return sum / double (targets);
}

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

std::size_t
middle_of (std::span<const Tap> taps)
{
  return std::size_t (std::ranges::find (taps, Tap{0, 0, 0}) - taps.begin ());
}

/* Simple kriging of the slots of the middle frame. */
KrigingSystem
equations (const CodedCovariance &covariance, const Exposure &exposure,
    std::span<const Tap> taps, std::span<const int> elements,
    std::span<const double> noise)
{
  const std::size_t m = taps.size (), n = std::size_t (exposure.slots);
  std::vector<Offset> places;
  std::vector<int> exposed;
  for (std::size_t i = 0; i < m; i++) {
    places.push_back ({taps[i].x, taps[i].y});
    exposed.push_back (exposure.element (taps[i], elements[i]));
  }
  KrigingSystem system = slot_equations (covariance, places, exposed, noise);
  const std::size_t before = std::size_t (-exposure.first) * n * m;
  system.targets.erase (system.targets.begin (),
      system.targets.begin () + std::ptrdiff_t (before));
  system.targets.resize (n * m);
  return system;
}

/* Without noise, a pixel of a one-hot code is known in its own slot. */
template <typename Weights>
void
keep_known (const Observation &observation, int element, std::size_t taps,
    std::size_t middle, Weights &weights)
{
  if (!observation.exact () || !observation.noise_free ())
    return;
  const int known = observation.shares (element)[0].slot;
  const auto slot = weights.begin () + known * std::ptrdiff_t (taps);
  std::fill_n (slot, taps, 0.0f);
  slot[std::ptrdiff_t (middle)] = 1.0f;
}

PhaseWeights
weights_of (KrigingSystem system, const Observation &observation,
    std::span<const Tap> taps, int element)
{
  const std::size_t m = taps.size (), n = system.targets.size () / m;
  const std::size_t middle = middle_of (taps);
  /* Ordinary kriging. As one target more, row `middle` of the inverse of the
   * bordered matrix: it holds the prediction of that pixel by all others,
   * scaled. */
  system.flat.assign (m, 1.0);
  system.flat_targets.assign (n, 1.0);
  system.flat_targets.push_back (0.0);
  system.targets.resize ((n + 1) * m);
  system.targets[n * m + middle] = 1.0;
  const std::vector<double> solved = solve_kriging (system);

  const auto residual = solved.begin () + std::ptrdiff_t (n * m);
  PhaseWeights weights;
  weights.slots.assign (solved.begin (), residual);
  for (std::size_t i = 0; i < m; i++)
    weights.residual.push_back (float (
        -residual[std::ptrdiff_t (i)] / residual[std::ptrdiff_t (middle)]));
  weights.predicted_variance = 1.0 / residual[std::ptrdiff_t (middle)];
  weights.slot_variance = mean_variance (system, middle, solved, n);
  keep_known (observation, element, m, middle, weights.slots);
  return weights;
}

/* Every tap with the one to its right. */
std::vector<TapPair>
pairs_of (std::span<const Tap> taps)
{
  std::vector<TapPair> pairs;
  for (std::size_t i = 0; i < taps.size (); i++) {
    const Tap right{taps[i].x + 1, taps[i].y, taps[i].frame};
    const bool next = i + 1 < taps.size () && taps[i + 1] == right;
    pairs.push_back ({int (i), next ? int (i + 1) : -1});
  }
  return pairs;
}

std::vector<float>
sparse_slots (KrigingSystem system, const Observation &observation,
    std::span<const Tap> taps, int element, double excess)
{
  constexpr double kScene = 1.0;
  const std::size_t m = taps.size ();
  const std::vector<double> targets = std::exchange (system.targets, {});
  system.flat.assign (m, 1.0);
  const SparseKriging kriging (std::move (system), pairs_of (taps));
  std::vector<float> weights;
  for (std::size_t at = 0; at < targets.size (); at += m) {
    const auto solved = kriging.solve (
        std::span (targets).subspan (at, m), 1.0, kScene, excess);
    weights.insert (weights.end (), solved.begin (), solved.end ());
  }
  keep_known (observation, element, m, middle_of (taps), weights);
  return weights;
}

/* The middle tap is sought, so it is not among the equations' taps. */
std::vector<float>
sparse_residual (
    const KrigingSystem &all, std::span<const Tap> taps, double excess)
{
  const std::size_t m = taps.size (), middle = middle_of (taps);
  const auto covariance = [&] (std::size_t a, std::size_t b) {
    return all.covariance[std::min (a, b) * m + std::max (a, b)];
  };
  KrigingSystem system;
  std::vector<Tap> others;
  std::vector<double> target;
  for (std::size_t i = 0; i < m; i++) {
    if (i == middle)
      continue;
    for (std::size_t j = 0; j < m; j++)
      if (j != middle)
        system.covariance.push_back (covariance (i, j));
    system.noise.push_back (all.noise[i]);
    target.push_back (covariance (i, middle));
    others.push_back (taps[i]);
  }
  system.flat.assign (others.size (), 1.0);
  const double variance = covariance (middle, middle) + all.noise[middle];
  const auto solved = SparseKriging (std::move (system), pairs_of (others))
                          .solve (target, 1.0, variance, excess);
  std::vector<float> weights (solved.begin (), solved.end ());
  weights.insert (weights.begin () + std::ptrdiff_t (middle), -1.0f);
  return weights;
}

/* Calls use (row, x, equations, elements of the taps) for every phase. */
template <typename Use>
void
each_system (const Phases &phases, const Observation &observation,
    const SceneClass &patch, std::span<const Tap> taps,
    std::span<const double> noise, const Use &use)
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
    for (int x = 0; x < phases.period (); x++) {
      const std::vector<int> elements = phases.elements (row, x, taps);
      use (row, x, equations (covariance, exposure, taps, elements, noises),
          elements[middle_of (taps)]);
    }
}

} // namespace

void
for_each_phase (const Phases &phases, const Observation &observation,
    const SceneClass &patch, std::span<const Tap> taps,
    std::span<const double> noise, const UseWeights &use)
{
  each_system (phases, observation, patch, taps, noise,
      [&] (int row, int x, KrigingSystem system, int element) {
        use (row, x,
            weights_of (std::move (system), observation, taps, element));
      });
}

void
for_each_sparse_phase (const Phases &phases, const Observation &observation,
    const SceneClass &patch, std::span<const Tap> taps,
    std::span<const double> noise, Sought sought, double excess,
    const UseSparse &use)
{
  each_system (phases, observation, patch, taps, noise,
      [&] (int row, int x, KrigingSystem system, int element) {
        use (row, x,
            sought == Sought::kSlots ? sparse_slots (std::move (system),
                                           observation, taps, element, excess)
                                     : sparse_residual (system, taps, excess));
      });
}

} // namespace codedexposure::fuse
