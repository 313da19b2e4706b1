/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "sync/partner_watch.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace codedexposure
{

namespace
{

constexpr float kNone = std::numeric_limits<float>::quiet_NaN ();
/* Mirrors that are compared, spread over the frame. */
constexpr int kMaxMirrors = 65536;
/* Standard deviations; and blocks that differ, for these to mean something. */
constexpr double kClear = 5.0;
constexpr int kMinBlocks = 16;
/* Of unevenness, as an amplitude. Light between pixels is uneven by some
 * percent more or less, as the scene moves. */
constexpr double kMuchMore = 1.08;
/* Frames before. */
constexpr std::size_t kBefore = 3;
/* Unevenness of a pair of two exposures, beside that of a good one, at least;
 * 4.5 to 6.5 times were seen where much moves. */
constexpr double kOther = 1.5;
/* Pixels from a mirror to the next pixel. Farther away, little is left of the
 * masks. */
constexpr double kMaxBeside = 0.25;

double
dot (const float *a, const float *b, std::size_t count)
{
  double sum = 0.0;
  for (std::size_t i = 0; i < count; i++)
    sum += double (a[i]) * b[i];
  return sum;
}

void
subtract (float *from, const float *what, double factor, std::size_t count)
{
  for (std::size_t i = 0; i < count; i++)
    from[i] -= float (factor * what[i]);
}

/* An orthonormal basis of the polynomials of second order in a block, one after
 * the other. */
std::vector<float>
smooth_in (Extent block)
{
  const std::size_t size = std::size_t (block.width) * block.height;
  std::vector<float> basis;
  for (int order = 0; order <= 2; order++)
    for (int of_x = 0; of_x <= order; of_x++) {
      std::vector<float> next;
      for (int y = 0; y < block.height; y++)
        for (int x = 0; x < block.width; x++)
          next.push_back (
              float (std::pow (2.0 * x / block.width - 1.0, of_x) *
                     std::pow (2.0 * y / block.height - 1.0, order - of_x)));
      const double length = std::sqrt (dot (next.data (), next.data (), size));
      for (std::size_t at = 0; at < basis.size (); at += size)
        subtract (next.data (), &basis[at],
            dot (next.data (), &basis[at], size), size);
      const double rest = std::sqrt (dot (next.data (), next.data (), size));
      if (rest < 1e-3 * length)
        continue;
      for (const float value : next)
        basis.push_back (float (value / rest));
    }
  return basis;
}

/* Of the sum of both beams in one block. */
double
unevenness (const float *on, const float *off, std::size_t mirrors, double gain)
{
  double sum = 0.0;
  for (std::size_t i = 0; i < mirrors; i++) {
    const double both = on[i] + gain * off[i];
    sum += both * both;
  }
  return sum;
}

template <typename Use>
void
for_each_mirror (Extent block, int left, int top, Use use)
{
  for (int y = top; y < top + block.height; y++)
    for (int x = left; x < left + block.width; x++)
      use (x, y);
}

/* Whether pixels of @camera lie on the mirrors of a block. */
bool
sees (const PartnerWatch::Camera &camera, Extent block, int left, int top)
{
  bool all = true;
  for_each_mirror (block, left, top, [&] (int x, int y) {
    const Position at = camera.place (x, y);
    all = all && camera.contains (at) &&
          std::abs (at.x - std::round (at.x)) <= kMaxBeside &&
          std::abs (at.y - std::round (at.y)) <= kMaxBeside;
  });
  return all;
}

} // namespace

PartnerWatch::PartnerWatch (
    const Schedule &schedule, const Camera &on, const Camera &off)
    : on_{.black = on.black, .white = on.white}, off_{.black = off.black,
                                                     .white = off.white}
{
  const Extent mirrors = on.mirrors ();
  /* More than a tile, and little of the scene. */
  const int side = std::max (
      4, int (std::ceil (1.5 * std::sqrt (double (schedule.slots ())))));
  const Extent block{side, side};
  size_ = std::size_t (block.width) * std::size_t (block.height);
  smooth_ = smooth_in (block);
  std::vector<Position> blocks;
  const int bottom = mirrors.height - schedule.pilot_rows () - block.height;
  for (int y = 0; y <= bottom; y += block.height)
    for (int x = 0; x <= mirrors.width - block.width; x += block.width)
      if (sees (on, block, x, y) && sees (off, block, x, y))
        blocks.push_back ({double (x), double (y)});
  const std::size_t step = blocks.size () * size_ / kMaxMirrors + 1;
  double light_on = 0.0, light_all = 0.0;
  for (std::size_t i = 0; i < blocks.size (); i += step)
    for_each_mirror (
        block, int (blocks[i].x), int (blocks[i].y), [&] (int x, int y) {
          on_.places.push_back (on.place (x, y));
          off_.places.push_back (off.place (x, y));
          for (int slot = 0; slot < schedule.slots (); slot++)
            light_on += schedule.on (x, y, slot) ? 1.0 : schedule.leak ();
          light_all += schedule.slots () * (1.0 + schedule.leak ());
        });
  expected_ratio_ = light_on / (light_all - light_on);
}

PartnerWatch::Light
PartnerWatch::read (const View &view, const GreyView &frame) const
{
  Light light;
  light.levels.reserve (view.places.size ());
  each_level (frame, view.places, [&] (double level) {
    light.levels.push_back (level < view.white ? float (level) : kNone);
    light.sum += level - view.black;
  });
  for (std::size_t i = 0; i < light.levels.size (); i += size_)
    for (std::size_t at = 0; at < smooth_.size (); at += size_)
      subtract (&light.levels[i], &smooth_[at],
          dot (&light.levels[i], &smooth_[at], size_), size_);
  return light;
}

double
PartnerWatch::gain_of (const Pair &pair) const
{
  return pair.on.sum / pair.off.sum / expected_ratio_;
}

/* Mean amplitude of a block. */
double
PartnerWatch::unevenness_of (const Pair &pair) const
{
  const double gain = gain_of (pair);
  double sum = 0.0;
  int blocks = 0;
  for (std::size_t i = 0; i < pair.on.levels.size (); i += size_) {
    const double own = std::sqrt (
        unevenness (&pair.on.levels[i], &pair.off.levels[i], size_, gain));
    if (std::isnan (own))
      continue;
    sum += own;
    blocks++;
  }
  return sum / std::max (blocks, 1);
}

/* By how many standard deviations @now is less even than @on and @off; none
 * where nothing differs. */
double
PartnerWatch::excess (const Pair &now, const Light &on, const Light &off) const
{
  if (!(now.on.sum > 0.0 && now.off.sum > 0.0))
    return 0.0;
  const double gain = gain_of (now);
  double sum = 0.0, squares = 0.0, own_sum = 0.0, other_sum = 0.0;
  int blocks = 0;
  for (std::size_t i = 0; i < now.on.levels.size (); i += size_) {
    const double own =
        unevenness (&now.on.levels[i], &now.off.levels[i], size_, gain);
    const double other =
        unevenness (&on.levels[i], &off.levels[i], size_, gain);
    if (std::isnan (own + other) || own == other)
      continue;
    /* About as uncertain in blocks of little texture as in others. */
    const double more = (own - other) / std::sqrt (own + other);
    sum += more;
    squares += more * more;
    own_sum += std::sqrt (own);
    other_sum += std::sqrt (other);
    blocks++;
  }
  if (blocks < kMinBlocks || (sum > 0.0 && own_sum < other_sum * kMuchMore))
    return 0.0;
  return sum / std::sqrt (squares);
}

void
PartnerWatch::keep (std::deque<Light> &before, Light light)
{
  before.push_back (std::move (light));
  if (before.size () > kBefore)
    before.pop_front ();
}

PartnerWatch::Verdict
PartnerWatch::take (const GreyView &on, const GreyView &off)
{
  Pair now{read (on_, on), read (off_, off)};
  double worst = -std::numeric_limits<double>::infinity ();
  for (const Light &before : before_off_)
    worst = std::max (worst, excess (now, now.on, before));
  for (const Light &before : before_on_)
    worst = std::max (worst, excess (now, before, now.off));
  const bool compared = !before_on_.empty () || !before_off_.empty ();
  const bool is_new = new_pairs_ > 0;
  new_pairs_ -= is_new;
  const double uneven = unevenness_of (now);
  keep (before_on_, std::move (now.on));
  keep (before_off_, std::move (now.off));
  if (compared && worst > kClear)
    return Verdict::bad;
  if (is_new && usual_ && uneven > kOther * *usual_)
    return Verdict::bad;
  if (!compared || worst > -kClear)
    return Verdict::unknown;
  usual_ = uneven;
  return Verdict::good;
}

void
PartnerWatch::take_alone (const GreyView &frame, bool off)
{
  keep (off ? before_off_ : before_on_, read (off ? off_ : on_, frame));
  new_pairs_ = int (kBefore);
}

} // namespace codedexposure
