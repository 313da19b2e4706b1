/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "sync/slip_signature.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <optional>

namespace codedexposure
{

namespace
{

using Kind = PhaseReading::Kind;

/* Slips by more slots count as changing light. */
constexpr int kMaxSlip = 3;
/* With more elements, the analysis takes too long. */
constexpr int kMaxElements = 64;
/* Relative change of levels by the scene from frame to frame, and its max
 * effect on the slots in a code whose slips are distinct. */
constexpr double kSceneChange = 0.003;
constexpr double kDistinct = 0.1;

/* Levels below this, in digital numbers, are dark current and rounding. */
constexpr double kDark = 2.0;
/* Max deviation from a whole number of slots in a slip, and from one slot in a
 * steady frame. */
constexpr double kMatch = 0.25;
constexpr double kSteady = 0.4;
/* If slots deviate this much without a slip, they cannot show one. */
constexpr double kMaxDeviation = 0.15;
constexpr double kFirstDeviation = 0.05;
/* Between two frames the light changes by less than this factor. */
constexpr double kLightChange = 1.5;

/* Light that a pixel gets from each neighbouring mirror; 0.19 for a Gaussian of
 * half a pixel. */
constexpr double kBlurStep = 0.01;
constexpr double kMaxBlur = 0.2;
/* A lens is likely if it explains the levels except for this part. */
constexpr double kLikely = 0.005;

/* The first frames are averaged; later ones are learned at these rates, if they
 * are steady or not. */
constexpr int kFirstFrames = 8;
constexpr double kSteadyRate = 1.0 / 8;
constexpr double kUnsteadyRate = 1.0 / 32;

double
sum (std::span<const double> values)
{
  return std::accumulate (values.begin (), values.end (), 0.0);
}

double
dot (std::span<const double> a, std::span<const double> b)
{
  return std::inner_product (a.begin (), a.end (), b.begin (), 0.0);
}

std::vector<double>
product (const Matrix &matrix, std::span<const double> vector)
{
  const std::size_t n = vector.size ();
  std::vector<double> out;
  for (std::size_t row = 0; row < n; row++)
    out.push_back (dot ({&matrix[row * n], n}, vector));
  return out;
}

/** Part of @p levels that no multiple of @p expected explains. */
double
unexplained (std::span<const double> levels, std::span<const double> expected)
{
  const double both = dot (levels, expected);
  return std::sqrt (std::max (0.0,
      1 - both * both / (dot (levels, levels) * dot (expected, expected))));
}

/** Levels of the elements from the light of the slots, if the part @p blur of
 * the light of a mirror goes to each neighbouring pixel. */
Matrix
levels_from_slots (const Schedule &schedule, double blur)
{
  const int n = schedule.elements ();
  const int width = schedule.tile ().period_x ();
  const int height = schedule.tile ().period_y ();
  const double weight[] = {blur, 1 - 2 * blur, blur};
  const double pixels = double (width) * height / n;

  Matrix levels (std::size_t (n) * std::size_t (n));
  for (int y = 0; y < 3 * height; y++)
    for (int x = 0; x < 3 * width; x++) {
      const int from = schedule.element_at (x % width, y % height);
      const int to = schedule.element_at (
          x % width + x / width - 1, y % height + y / height - 1);
      const double part = weight[x / width] * weight[y / height] / pixels;
      for (int slot = 0; slot < n; slot++)
        levels[std::size_t (to * n + slot)] +=
            part * schedule.light (from, slot);
    }
  return levels;
}

/** Max deviation from one slot. */
double
deviation_of (std::span<const double> slots)
{
  double deviation = 0;
  for (const double shown : slots)
    deviation = std::max (deviation, std::abs (shown - 1.0));
  return deviation;
}

/** Whether light that is switched on or off once has the same effect. */
bool
is_step (const std::vector<int> &shown)
{
  int edges = 0;
  for (std::size_t s = 1; s < shown.size (); s++)
    edges += shown[s] != shown[s - 1];
  return edges <= 1;
}

} // namespace

SlipSignature::SlipSignature (const Schedule &schedule)
{
  const int n = schedule.elements ();
  for (int e = 0; e < n; e++)
    usual_.push_back (schedule.light (e));
  code_light_ = sum (usual_);
  parked_part_ = schedule.leak () * n * n / code_light_;
  if (n > kMaxElements)
    return;

  for (double blur = 0; blur <= kMaxBlur; blur += kBlurStep)
    add_lens (schedule, blur);
  if (lenses_.empty ())
    return;
  for (int late = -kMaxSlip; late <= kMaxSlip; late++)
    for (int from = 1; late != 0 && from < n; from++)
      add_slip (n, from, late);

  const Lens &sharp = lenses_.front ();
  double worst = 0;
  for (std::size_t s = 0; s < std::size_t (n); s++) {
    double squares = 0;
    for (std::size_t e = 0; e < std::size_t (n); e++)
      squares += std::pow (sharp.slots[s * std::size_t (n) + e] * usual_[e], 2);
    worst = std::max (worst, kSceneChange * std::sqrt (squares));
  }
  distinct_ = n > 2 && worst <= kDistinct;
}

void
SlipSignature::add_lens (const Schedule &schedule, double blur)
{
  const std::size_t n = usual_.size ();
  const Matrix levels = levels_from_slots (schedule, blur);
  std::optional<Matrix> slots = inverted (levels, n);
  if (slots)
    lenses_.push_back ({product (levels, Vector (n, 1.0)), *std::move (slots),
        {}, kFirstDeviation, true});
}

/** The masks come @p late slots late from slot @p from on. */
void
SlipSignature::add_slip (int slots, int from, int late)
{
  std::vector<int> shown (std::size_t (slots), 0);
  for (int s = 0; s < slots; s++)
    shown[std::size_t (s < from ? s : floor_mod (s - late, slots))]++;
  if (is_step (shown))
    return;

  const auto same = std::find_if (slips_.begin (), slips_.end (),
      [&] (const Slip &slip) { return slip.shown == shown; });
  if (same == slips_.end ()) {
    slips_.push_back ({shown, late, true});
  } else if (std::abs (late) < std::abs (same->slots)) {
    /* A slip by few slots is likelier than one by many, */
    *same = {shown, late, true};
  } else if (late == -same->slots) {
    /* and a missed trigger is likelier than a spurious one. */
    same->slots = std::abs (late);
    same->certain = false;
  }
}

/** Slots for which each mask was shown, by the lens @p lens. */
SlipSignature::Vector
SlipSignature::slots_shown (
    std::span<const double> levels, const Lens &lens) const
{
  const Vector usual = product (lens.slots, usual_);
  Vector slots = product (lens.slots, levels);
  /* A slip does not change the sum of all slots. */
  const double light = sum (slots) / sum (usual);
  for (std::size_t s = 0; s < slots.size (); s++)
    slots[s] = slots[s] / light - usual[s] + 1.0;
  return slots;
}

PhaseReading
SlipSignature::read (std::span<const double> levels)
{
  if (*std::max_element (levels.begin (), levels.end ()) < kDark)
    return {brightness_ > kDark ? Kind::parked : Kind::unclear};
  if (lenses_.empty ())
    return {};

  if (learned_ == 0)
    guess_usual (levels);
  const double light = dot (levels, usual_) / dot (usual_, usual_);
  if (is_parked (levels))
    return {Kind::parked};
  for (Lens &lens : lenses_)
    lens.shown = slots_shown (levels, lens);
  const PhaseReading slip = read_slip (light);
  if (slip.kind == Kind::slipped)
    return slip;

  const bool steady = is_steady ();
  learn (levels, light, steady);
  return {steady ? Kind::in_phase : Kind::unclear};
}

PhaseReading
SlipSignature::read_slip (double light) const
{
  if (std::abs (std::log (light / brightness_)) > std::log (kLightChange))
    return {};

  PhaseReading reading;
  double min = kMatch;
  for (const Lens &lens : lenses_) {
    if (!lens.likely || lens.deviation > kMaxDeviation)
      continue;
    const Vector &shown = lens.shown;
    if (deviation_of (shown) < 1 - kMatch)
      continue;
    for (const Slip &slip : slips_) {
      double off = 0;
      for (std::size_t s = 0; s < shown.size () && off < min; s++)
        off = std::max (off, std::abs (shown[s] - slip.shown[s]));
      if (off < min) {
        reading = {Kind::slipped, slip.slots, slip.certain};
        min = off;
      }
    }
  }
  return reading;
}

bool
SlipSignature::is_parked (std::span<const double> levels) const
{
  return sum (levels) < brightness_ * code_light_ * (1 + parked_part_) / 2 &&
         unexplained (levels, Vector (levels.size (), 1.0)) <
             unexplained (levels, usual_);
}

/** Starts from the code as the likeliest lens shows it. */
void
SlipSignature::guess_usual (std::span<const double> levels)
{
  const auto likeliest = std::min_element (
      lenses_.begin (), lenses_.end (), [&] (const Lens &a, const Lens &b) {
        return unexplained (levels, a.code) < unexplained (levels, b.code);
      });
  usual_ = likeliest->code;
}

/** Whether every mask was shown for one slot, by the sharpest likely lens. */
bool
SlipSignature::is_steady () const
{
  const auto sharpest = std::find_if (lenses_.begin (), lenses_.end (),
      [] (const Lens &lens) { return lens.likely; });
  return deviation_of (sharpest->shown) < kSteady;
}

void
SlipSignature::learn (std::span<const double> levels, double light, bool steady)
{
  for (Lens &lens : lenses_)
    lens.deviation +=
        kSteadyRate * (deviation_of (lens.shown) - lens.deviation);

  const double rate = learned_ < kFirstFrames ? 1.0 / (learned_ + 1)
                      : steady                ? kSteadyRate
                                              : kUnsteadyRate;
  learned_ = std::min (learned_ + 1, kFirstFrames);
  for (std::size_t e = 0; e < levels.size (); e++)
    usual_[e] += rate * (levels[e] / light - usual_[e]);
  const double scale = code_light_ / sum (usual_);
  for (double &level : usual_)
    level *= scale;
  brightness_ = light;
  judge_lenses ();
}

void
SlipSignature::judge_lenses ()
{
  double min = 1.0;
  for (const Lens &lens : lenses_)
    min = std::min (min, unexplained (usual_, lens.code));
  for (Lens &lens : lenses_)
    lens.likely = unexplained (usual_, lens.code) <= min + kLikely;
}

} // namespace codedexposure
