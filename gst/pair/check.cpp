/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-pair: what the pixels of pairs show. */
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/pixels.h"
#include "common/messages.h"
#include "common/meta.h"
#include "pair/pair.h"

namespace codedexposure::gst::pairs
{

namespace
{

using Verdict = PartnerWatch::Verdict;

constexpr GstClockTime kEach = GST_SECOND;
/* A scene that moves fast is no drift. */
constexpr std::size_t kPairs = 5;
/* Mirrors; along both axes, fusion loses 1.3 dB by it (docs/two-cameras.md). */
constexpr double kTooFar = 0.1;
constexpr double kClear = 3.0; // standard deviations

/** @p mapping: of the stream, which the camera points to. */
PartnerWatch::Camera
camera_of (const PairStream &stream, const std::optional<Mapping> &mapping)
{
  PartnerWatch::Camera camera{
      {stream.info.width, stream.info.height}, mapping ? &*mapping : nullptr};
  int bits = 0;
  if (stream.setup) {
    bits = stream.setup->bits;
    if (stream.setup->bench)
      camera.black = stream.setup->bench->black ();
  }
  bits = significant_bits_of (bits, stream.info);
  camera.white = largest_pixel (
      bits > 0 ? bits : int (GST_VIDEO_INFO_COMP_DEPTH (&stream.info, 0)));
  return camera;
}

/* Times and leak are of no account. */
bool
have_same_masks (const Schedule &one, const Schedule &other)
{
  return one.tile () == other.tile () && one.code () == other.code () &&
         one.order () == other.order () && one.phase () == other.phase () &&
         one.pilot_rows () == other.pilot_rows () &&
         one.regions () == other.regions ();
}

GreyView
grey_view (MappedFrame &mapped)
{
  return read_pixels (mapped, [] (auto pixels) { return GreyView (pixels); });
}

} // namespace

void
PairCheck::configure (const PairStream &on, const PairStream &off)
{
  watch_.reset ();
  drift_.reset ();
  on_ = on.info;
  off_ = off.info;
  are_masks_alike_ = !on.setup || !off.setup ||
                     have_same_masks (on.setup->schedule, off.setup->schedule);
  const auto mapping_of = [] (const PairStream &stream) {
    return stream.setup ? stream.setup->known_mapping () : std::nullopt;
  };
  const auto mapping = mapping_of (on), other = mapping_of (off);
  const PartnerWatch::Camera first = camera_of (on, mapping),
                             second = camera_of (off, other);
  const auto fits = [] (const PartnerWatch::Camera &camera) {
    return !camera.mapping || camera.mapping->camera () == camera.size;
  };
  const Extent mirrors = first.mirrors ();
  if (on.setup && fits (first) && fits (second) &&
      second.mirrors () == mirrors && on.setup->schedule.complement () &&
      on.setup->schedule.check_size (mirrors.width, mirrors.height))
    watch_.emplace (on.setup->schedule, first, second);
  if (watch_ && on.setup->schedule.regions ().empty ())
    drift_.emplace (on.setup->schedule, first, second);
}

void
PairCheck::reset ()
{
  if (watch_)
    watch_->reset ();
}

Verdict
PairCheck::check (GstBuffer *coded, GstBuffer *partner)
{
  if (!watch_)
    return Verdict::unknown;
  MappedFrame on (on_, coded, GST_MAP_READ);
  MappedFrame off (off_, partner, GST_MAP_READ);
  return on && off ? watch_->take (grey_view (on), grey_view (off))
                   : Verdict::unknown;
}

void
PairCheck::take_alone (GstBuffer *frame, bool off)
{
  MappedFrame mapped (off ? off_ : on_, frame, GST_MAP_READ);
  if (watch_ && mapped)
    watch_->take_alone (grey_view (mapped), off);
}

std::optional<PartnerDrift::Shift>
PairCheck::drift (GstBuffer *coded, GstBuffer *partner) const
{
  if (!drift_)
    return {};
  MappedFrame on (on_, coded, GST_MAP_READ);
  MappedFrame off (off_, partner, GST_MAP_READ);
  return on && off ? drift_->largest (grey_view (on), grey_view (off))
                   : std::nullopt;
}

/* ---------------------------------------------------------------- drift -- */

bool
DriftWatch::is_due (GstClockTime pts)
{
  if (GST_CLOCK_TIME_IS_VALID (last_) && pts >= last_ && pts - last_ < kEach)
    return false;
  last_ = pts;
  return true;
}

std::optional<PartnerDrift::Shift>
DriftWatch::median () const
{
  if (shifts_.size () < kPairs)
    return {};
  std::vector<PartnerDrift::Shift> sorted (shifts_.begin (), shifts_.end ());
  const auto middle = sorted.begin () + kPairs / 2;
  std::ranges::nth_element (
      sorted, middle, {}, [] (const PartnerDrift::Shift &shift) {
        return std::hypot (shift.by.x, shift.by.y);
      });
  return *middle;
}

void
DriftWatch::take (gpointer element, GstClockTime pts,
    const std::optional<PartnerDrift::Shift> &shift)
{
  if (!shift)
    return;
  shifts_.push_back (*shift);
  if (shifts_.size () > kPairs)
    shifts_.pop_front ();
  const auto now = median ();
  if (!now)
    return;
  const double length = std::hypot (now->by.x, now->by.y);
  const double margin = kClear * now->uncertainty;
  if (has_moved_ ? length >= kTooFar : length <= kTooFar + margin)
    return;
  has_moved_ = !has_moved_;
  post_message (element, PartnerDrifted{.active = has_moved_,
                             .x = now->by.x,
                             .y = now->by.y,
                             .uncertainty = now->uncertainty,
                             .at_x = now->at.x,
                             .at_y = now->at.y,
                             .from = pts});
}

} // namespace codedexposure::gst::pairs
