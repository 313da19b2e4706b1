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
    int row = 0, shift = 0;
    while (
        row < rows () && !is_shift (y, row_starts_[std::size_t (row)], shift)) {
      shift = (shift + 1) % period_;
      row += shift == 0;
    }
    if (row == rows ())
      row_starts_.push_back (y);
    for (int x = 0; x < 2 * period_; x++)
      of_rows_.push_back (row * period_ + (x + shift) % period_);
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
taps_around (double own, double reach, Neighbours neighbours)
{
  std::vector<Tap> taps = taps_within (own);
  for (const int frame : {-1, 1})
    if (frame < 0 ? neighbours.before : neighbours.after)
      std::ranges::copy (taps_within (reach, frame), std::back_inserter (taps));
  if (neighbours.partner)
    std::ranges::copy (
        taps_within (kPartnerRadius, kPartner), std::back_inserter (taps));
  return taps;
}

namespace
{

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

/* Variance of light that partners have in common and the coded frame has not:
 * so large that their weights sum to 0, and their black level and gain need not
 * be known. */
constexpr double kPartnerFlatVariance = 1e3;

std::vector<int>
frames_of (std::span<const Tap> taps)
{
  std::vector<int> frames;
  for (const Tap &tap : taps)
    if (tap.frame != kPartner)
      frames.push_back (tap.frame);
  return frames;
}

/* The equations of the pixels of each phase, under one class. The frames of
 * taps are one exposure of several times as many slots; elements of later
 * frames come after those of earlier ones, and those of the partner come last.
 */
class Equations
{
public:
  Equations (const FilterPlan &plan, const SceneClass &patch,
      std::span<const Tap> taps, std::size_t per_neighbour = kAllTaps)
      : plan_ (plan), all_ (taps), taps_ (taps.begin (), taps.end ()),
        per_neighbour_ (per_neighbour),
        middle_ (std::size_t (
            std::ranges::find (taps, Tap{0, 0, 0}) - taps.begin ())),
        frames_ (std::ranges::minmax (frames_of (taps))),
        covariance_ (patch, shares (), slots () * count (), reach ())
  {
  }

  /* Calls use (row, x) after setting system () for them. */
  template <typename Use>
  void each (const Use &use)
  {
    for (int row = 0; row < plan_.phases.rows (); row++)
      for (int x = 0; x < plan_.phases.period (); x++) {
        plan_.throw_if_stopped ();
        set_system (row, x);
        use (row, x);
      }
  }
  std::span<const Tap> taps () const { return taps_; } ///< of the pixels set

  /* As one target more, row `middle` of the inverse of the bordered matrix: it
   * holds the prediction of that pixel by all others, scaled. */
  PhaseWeights weights ()
  {
    const std::size_t m = taps_.size (), n = std::size_t (slots ());
    const auto partner = std::size_t (
        std::ranges::find (taps_, Tap{0, 0, kPartner}) - taps_.begin ());
    const auto leave_out = [&] (std::size_t tap) {
      system_.flat_targets.push_back (0.0);
      system_.targets.resize (system_.targets.size () + m);
      system_.targets[system_.targets.size () - m + tap] = 1.0;
    };
    leave_out (middle_);
    if (partner < m)
      leave_out (partner);
    const std::vector<double> solved = solve_kriging (system_);
    const double *row = solved.data () + n * m;
    PhaseWeights weights;
    weights.slots.assign (solved.data (), row);
    keep_known (weights.slots);
    const auto prediction = [m] (const double *of_row, std::size_t tap) {
      std::vector<float> residual;
      for (std::size_t i = 0; i < m; i++)
        residual.push_back (float (-of_row[i] / of_row[tap]));
      return residual;
    };
    weights.residual = prediction (row, middle_);
    weights.predicted_variance = 1.0 / row[middle_];
    if (partner < m) {
      weights.partner_residual = prediction (row + m, partner);
      weights.partner_variance = 1.0 / row[m + partner];
    }
    for (std::size_t slot = 0; slot < n; slot++)
      weights.slot_variances.push_back (slot_variance (slot, solved));
    return weights;
  }

  std::vector<float> sparse_slots (double excess) const
  {
    constexpr double kScene = 1.0;
    const SparseKriging kriging (system_, pairs_of (taps_));
    std::vector<float> weights;
    for (std::size_t at = 0; at < system_.targets.size (); at += taps_.size ())
      std::ranges::copy (
          kriging.solve (
              std::span (system_.targets).subspan (at, taps_.size ()), 1.0,
              kScene, excess),
          std::back_inserter (weights));
    keep_known (weights);
    return weights;
  }

  /* The middle tap is sought, so it is not among the equations' taps. */
  std::vector<float> sparse_residual (double excess) const
  {
    std::vector<int> others;
    std::vector<Tap> taps;
    std::vector<double> target;
    for (std::size_t i = 0; i < taps_.size (); i++)
      if (i != middle_) {
        others.push_back (int (i));
        taps.push_back (taps_[i]);
        target.push_back (covariance (i, middle_));
      }
    const double variance =
        covariance (middle_, middle_) + system_.noise[middle_];
    const auto solved =
        SparseKriging (equations_of (system_, others), pairs_of (taps))
            .solve (target, 1.0, variance, excess);
    std::vector<float> weights (solved.begin (), solved.end ());
    weights.insert (weights.begin () + std::ptrdiff_t (middle_), -1.0f);
    return weights;
  }

private:
  int slots () const { return plan_.observation.slots (); }
  bool is_partner (std::size_t tap) const
  {
    return taps_[tap].frame == kPartner;
  }
  int count () const { return frames_.max - frames_.min + 1; }
  int reach () const
  {
    int radius = 0;
    for (const Tap &tap : taps_)
      radius = std::max ({radius, std::abs (tap.x), std::abs (tap.y)});
    return 2 * radius;
  }
  std::vector<SlotShares> shares () const
  {
    std::vector<SlotShares> shares;
    const auto add = [&] (const Observation &observation, int frame) {
      for (SlotShares element : observation.shares ()) {
        for (SlotShare &share : element)
          share.slot += (frame - frames_.min) * slots ();
        shares.push_back (std::move (element));
      }
    };
    for (int frame = frames_.min; frame <= frames_.max; frame++)
      add (plan_.observation, frame);
    if (plan_.partner)
      add (*plan_.partner, 0);
    return shares;
  }
  double covariance (std::size_t a, std::size_t b) const
  {
    return system_
        .covariance[std::min (a, b) * taps_.size () + std::max (a, b)];
  }

  /* Which ones tell most depends on the elements around the pixel. */
  void choose_taps (int row, int x)
  {
    const std::vector<int> elements = plan_.phases.elements (row, x, all_);
    std::vector<bool> used (all_.size (), true);
    for (const int frame : {-1, 1}) {
      const int slot = (frame < 0 ? 0 : slots () - 1) - frames_.min * slots ();
      std::vector<std::pair<double, std::size_t>> told;
      for (std::size_t i = 0; i < all_.size (); i++)
        if (all_[i].frame == frame)
          told.emplace_back (
              -covariance_.target ({all_[i].x, all_[i].y},
                  (frame - frames_.min) * slots () + elements[i], slot),
              i);
      std::ranges::sort (told);
      for (std::size_t i = per_neighbour_; i < told.size (); i++)
        used[told[i].second] = false;
    }
    taps_.clear ();
    for (std::size_t i = 0; i < all_.size (); i++)
      if (used[i])
        taps_.push_back (all_[i]);
  }

  void set_system (int row, int x)
  {
    if (per_neighbour_ != kAllTaps)
      choose_taps (row, x);
    const std::vector<int> elements = plan_.phases.elements (row, x, taps_);
    std::vector<Offset> places;
    std::vector<int> exposed;
    std::vector<double> noise;
    for (int frame = 0; frame < count (); frame++)
      noise.insert (noise.end (), plan_.noise.begin (), plan_.noise.end ());
    noise.insert (
        noise.end (), plan_.partner_noise.begin (), plan_.partner_noise.end ());
    for (std::size_t i = 0; i < taps_.size (); i++) {
      places.push_back ({taps_[i].x, taps_[i].y});
      const int frame =
          is_partner (i) ? count () : taps_[i].frame - frames_.min;
      exposed.push_back (frame * slots () + elements[i]);
    }
    element_ = elements[middle_];
    system_ = slot_equations (covariance_, places, exposed, noise);
    const std::ptrdiff_t of_frame = slots () * std::ptrdiff_t (taps_.size ());
    const auto first = system_.targets.begin () - frames_.min * of_frame;
    system_.targets = {first, first + of_frame};
    for (std::size_t i = 0; i < taps_.size (); i++)
      for (std::size_t j = i; is_partner (i) && j < taps_.size (); j++)
        if (is_partner (j))
          system_.covariance[i * taps_.size () + j] += kPartnerFlatVariance;
    system_.flat.assign (taps_.size (), 1.0);
    system_.flat_targets.assign (std::size_t (slots ()), 1.0);
  }

  /* The expected squared error of ordinary kriging in flat light, 1 - w c +
   * lambda. The multiplier lambda is the same in all equations of a target; it
   * is taken from that of the middle tap. */
  double slot_variance (std::size_t slot, std::span<const double> weights) const
  {
    const double *w = weights.data () + slot * taps_.size ();
    const double *c = system_.targets.data () + slot * taps_.size ();
    double variance = 1.0 - c[middle_] + system_.noise[middle_] * w[middle_];
    for (std::size_t i = 0; i < taps_.size (); i++)
      variance += w[i] * (covariance (i, middle_) - c[i]);
    return variance;
  }

  /* Without noise, a pixel of a one-hot code is known in its own slot. */
  void keep_known (std::vector<float> &weights) const
  {
    const Observation &observation = plan_.observation;
    if (!observation.exact () || !observation.noise_free ())
      return;
    const auto slot = weights.begin () + observation.shares (element_)[0].slot *
                                             std::ptrdiff_t (taps_.size ());
    std::fill_n (slot, taps_.size (), 0.0f);
    slot[std::ptrdiff_t (middle_)] = 1.0f;
  }

  const FilterPlan &plan_;
  std::span<const Tap> all_;
  std::vector<Tap> taps_;     ///< those of all that are used
  std::size_t per_neighbour_; ///< see for_each_phase ()
  std::size_t middle_; ///< all taps of its frame are used, and come first
  std::ranges::minmax_result<int> frames_;
  CodedCovariance covariance_;
  int element_ = 0;
  KrigingSystem system_; ///< ordinary kriging of the slots of the middle frame
};

} // namespace

void
for_each_phase (const FilterPlan &plan, const SceneClass &patch,
    std::span<const Tap> taps, const UseWeights &use, std::size_t per_neighbour)
{
  Equations equations (plan, patch, taps, per_neighbour);
  equations.each ([&] (int row, int x) {
    use (row, x, equations.taps (), equations.weights ());
  });
}

void
for_each_sparse_phase (const FilterPlan &plan, const SceneClass &patch,
    std::span<const Tap> taps, Sought sought, double excess,
    const UseSparse &use)
{
  const bool slots = sought == Sought::kSlots;
  if (plan.observation.slots () > kMaxSparseSlots)
    return for_each_phase (plan, patch, taps,
        [&] (
            int row, int x, std::span<const Tap>, const PhaseWeights &weights) {
          use (row, x, slots ? weights.slots : weights.residual);
        });
  Equations equations (plan, patch, taps);
  equations.each ([&] (int row, int x) {
    use (row, x,
        slots ? equations.sparse_slots (excess)
              : equations.sparse_residual (excess));
  });
}

} // namespace codedexposure::fuse
