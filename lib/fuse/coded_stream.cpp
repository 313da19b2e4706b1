/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/coded_stream.h"

#include <utility>

namespace codedexposure::fuse
{

CodedCamera::CodedCamera (const Kernels &kernels, const Schedule &schedule,
    const Observation &observation, Extent size, int radius, int period,
    float steps)
    : kernels_ (kernels), radius_ (radius), period_ (period), steps_ (steps),
      pixels_ (size.width, size.height, radius)
{
  find_margin (schedule, observation.exact ());
  if (!observation.gains ())
    return;
  gain_ = Field (size.width, size.height);
  for (int y = 0; y < size.height; y++)
    for (int x = 0; x < size.width; x++)
      gain_.row (y)[x] = float (observation.gain (schedule.element_at (x, y)));
}

/* The margin mirrors the frame. If elements see several slots, a pixel of the
 * margin repeats the pixel of its own element that is closest to its mirror
 * image: the weights of a slot have both signs and fit only the code's phase.
 */
void
CodedCamera::find_margin (const Schedule &schedule, bool exact)
{
  const int width = pixels_.width (), height = pixels_.height ();
  const int reach =
      std::max (schedule.tile ().period_x (), schedule.tile ().period_y ());
  const auto closest = [&] (int x, int y, int element) {
    Offset best{x, y};
    int shortest = 4 * reach * reach;
    for (int dy = -reach; dy <= reach; dy++) {
      if (dy * dy >= shortest || y + dy < 0 || y + dy >= height)
        continue;
      for (int dx = -reach; dx <= reach; dx++) {
        const int distance = dx * dx + dy * dy;
        if (distance < shortest && x + dx >= 0 && x + dx < width &&
            schedule.element_at (x + dx, y + dy) == element) {
          shortest = distance;
          best = {x + dx, y + dy};
        }
      }
    }
    return best;
  };
  for (int y = -radius_; y < height + radius_; y++) {
    const bool inside = y >= 0 && y < height;
    for (int x = -radius_; x < width + radius_; x++) {
      if (inside && x == 0)
        x = width;
      const Offset image{mirrored (x, width), mirrored (y, height)};
      const Offset from =
          exact ? image
                : closest (image.x, image.y, schedule.element_at (x, y));
      margin_.push_back (
          {y * pixels_.stride () + x, from.y * pixels_.stride () + from.x});
    }
  }
}

CodedLight
CodedCamera::room () const
{
  const int width = pixels_.width (), height = pixels_.height ();
  return {
      Field (width, height), SplitField (width, height, radius_, period_), {}};
}

void
CodedCamera::pair (CodedLight &seen)
{
  const int width = pixels_.width (), height = pixels_.height ();
  for (int y = 0; y < height; y++)
    kernels_.to_steps (seen.light.row (y), steps_, width, pixels_.row (y));
  std::int32_t *origin = pixels_.row (0);
  for (const Repeat &repeat : margin_)
    origin[repeat.to] = origin[repeat.from];
  const Parts parts{period_, seen.pairs.stride (), width + 2 * radius_};
  for (int y = -radius_; y < height + radius_; y++) {
    std::int32_t *row = pixels_.row (y) - radius_;
    kernels_.pair (row, parts.count);
    kernels_.split_pairs (parts, row, seen.pairs.row (y));
  }
}

CodedStream::CodedStream (const Kernels &kernels, const Schedule &schedule,
    const Observation &observation, const Observation *partner, Extent size,
    int radius, int period, float steps)
    : camera_ (kernels, schedule, observation, size, radius, period, steps)
{
  if (partner)
    partner_.emplace (kernels, schedule, *partner, size, radius, period, steps);
}

CodedFrame &
CodedStream::next ()
{
  if (spare_.light.empty ()) {
    static_cast<CodedLight &> (spare_) = camera_.room ();
    if (partner_)
      spare_.partner = partner_->room ();
  }
  spare_.has_partner = false;
  spare_.errors = spare_.partner.errors = {};
  return spare_;
}

void
CodedStream::take ()
{
  camera_.pair (spare_);
  if (spare_.has_partner)
    partner_->pair (spare_.partner);
  queue_.push_back (std::exchange (spare_, CodedFrame ()));
}

CodedFrames
CodedStream::frames () const
{
  return {previous_.light.empty () ? nullptr : &previous_, &queue_.front (),
      queue_.size () > 1 ? &queue_[1] : nullptr};
}

void
CodedStream::advance ()
{
  spare_ = std::exchange (previous_, std::move (queue_.front ()));
  queue_.pop_front ();
}

void
CodedStream::forget ()
{
  queue_.clear ();
  previous_ = {};
}

} // namespace codedexposure::fuse
