/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "pair/drift.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/messages.h"

namespace codedexposure::gst
{

namespace
{

constexpr GstClockTime kEach = GST_SECOND;
/* A scene that moves fast is no drift. */
constexpr std::size_t kPairs = 5;
/* Mirrors; along both axes, fusion loses 1.3 dB by it (docs/two-cameras.md). */
constexpr double kTooFar = 0.1;
constexpr double kClear = 3.0; // standard deviations

} // namespace

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

} // namespace codedexposure::gst
