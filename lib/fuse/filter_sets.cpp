/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/filter_sets.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fuse/fuser.h"

namespace codedexposure::fuse
{

namespace
{

/* All slots are the same; or they are less correlated than in any real scene.
 */
constexpr SceneClass kStatic{0.0, 0.0, 5.0, 1.5, 1.0};
constexpr SceneClass kMoving{0.0, 0.0, 5.0, 1.5, 0.6};

/* Of the taps in the coded frames before and after, px, for the comparison of
 * models. */
constexpr double kComparedRadius = 1.2;
/* Squared errors of filters beyond those with all taps, as a part of them: for
 * estimates, and for the comparison of models. */
constexpr double kExcess = 0.015, kPredictionExcess = 0.01;

} // namespace

/* The neighbouring coded frames that there are. */
struct FilterSets::Around {
  bool previous = false, next = false;

  bool any () const { return previous || next; }
  /* Taps within these radii in the frame itself and in its neighbours. */
  std::vector<Tap> taps (double own, double neighbours) const
  {
    return taps_around (own, neighbours, previous, next);
  }
};

FilterSets::FilterSets (const Phases &phases, const Observation &observation,
    Models models, std::span<const double> noise, Frames frames)
    : phases_ (phases), observation_ (observation),
      models_ (std::move (models)), noise_ (noise.begin (), noise.end ()),
      frames_ (frames)
{
  const bool next = use_neighbours () && frames.lookahead;
  for (const bool previous : {false, use_neighbours ()})
    set_for ({previous, next});
}

int
FilterSets::most_models () const
{
  return int (std::max (models_.of_frame.size (), models_.over_frames.size ()));
}

int
FilterSets::most_classes () const
{
  return 1 + std::max (most_models (), 1);
}

/* Filters of many slots would take too long to be made sparse. */
void
FilterSets::each_filter (const SceneClass &scene, std::span<const Tap> taps,
    Sought sought, const UseSparse &use) const
{
  const bool residual = sought == Sought::kResidual;
  if (observation_.slots () <= Fuser<std::uint8_t>::kMaxSlots)
    for_each_sparse_phase (phases_, observation_, scene, taps, noise_, sought,
        residual ? kPredictionExcess : kExcess, use);
  else
    for_each_phase (phases_, observation_, scene, taps, noise_,
        [&] (int row, int x, const PhaseWeights &weights) {
          use (row, x, residual ? weights.residual : weights.slots);
        });
}

SparseBank
FilterSets::make_predictions (const SparseSources &sources, Around around) const
{
  std::vector<SceneClass> classes =
      around.any () ? models_.over_frames : models_.of_frame;
  if (classes.size () < 2)
    classes = {kMoving};
  classes.insert (classes.begin (), kStatic);
  const double radius = frames_.radius - 1.5;
  const std::vector<Tap> near = taps_within (radius),
                         all = around.taps (radius, kComparedRadius);
  /* Their taps fit some motion by chance, the more of all taps they are: their
   * squared errors count as this much larger. */
  const float chance = std::sqrt (1.0f + 1.0f / float (observation_.slots ()));
  SparseBank bank (phases_, int (classes.size ()), frames_.steps);
  for (std::size_t k = 0; k < classes.size (); k++) {
    /* Neither a static scene nor fast motion needs other frames. */
    const bool alone = k == 0 || k + 1 == classes.size () || !around.any ();
    const std::vector<Tap> &taps = alone ? near : all;
    each_filter (classes[k], taps, Sought::kResidual,
        [&] (int row, int x, std::vector<float> weights) {
          if (!alone)
            for (float &weight : weights)
              weight *= chance;
          bank.set (sources, row, x, int (k), taps, weights);
        });
  }
  return bank;
}

std::vector<SparseBank>
FilterSets::make_estimates (const SparseSources &sources, Around around) const
{
  const std::vector<SceneClass> &models =
      around.any () ? models_.over_frames : models_.of_frame;
  const double radius = frames_.radius + 0.5;
  const std::vector<Tap> wide = taps_within (radius),
                         all = around.taps (radius, kNeighbourRadius);
  const int slots = observation_.slots ();
  std::vector<SparseBank> banks;
  for (const SceneClass &model : models) {
    /* What moves fast has left the pixel in other frames. */
    const std::vector<Tap> &taps = &model == &models.back () ? wide : all;
    SparseBank &bank = banks.emplace_back (phases_, slots, frames_.steps);
    each_filter (model, taps, Sought::kSlots,
        [&] (int row, int x, const std::vector<float> &weights) {
          for (int s = 0; s < slots; s++)
            bank.set (sources, row, x, s, taps,
                std::span (weights).subspan (
                    std::size_t (s) * taps.size (), taps.size ()));
        });
  }
  return banks;
}

const FilterSets::Set &
FilterSets::for_frames (const SplitFrames &frames)
{
  return set_for ({frames[0] != nullptr, frames[2] != nullptr});
}

const FilterSets::Set &
FilterSets::set_for (Around around)
{
  constexpr int kReach = int (kNeighbourRadius);
  auto &set = sets_[(around.previous ? 1u : 0u) + (around.next ? 2u : 0u)];
  if (!set) {
    const SparseSources sources ({around.previous ? kReach : -1, frames_.radius,
                                     around.next ? kReach : -1},
        SplitField (frames_.width, 0, frames_.radius, frames_.period));
    set = {sources, make_predictions (sources, around),
        make_estimates (sources, around)};
  }
  return *set;
}

} // namespace codedexposure::fuse
