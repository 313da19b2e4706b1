/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "alone.h"

#include <utility>

namespace codedexposure::gst
{

void
AloneFrames::add (gpointer element, GstClockTime pts, const char *reason)
{
  if (!reason) {
    if (open_)
      open_->to = pts;
    return end (element);
  }
  if (!open_) {
    open_ = PartnerLost{.reason = reason, .frames = 0, .from = pts};
    post_message (
        element, PartnerLost{.active = true, .reason = reason, .from = pts});
  }
  ++*open_->frames;
  open_->to = pts;
}

void
AloneFrames::end (gpointer element)
{
  if (const auto over = std::exchange (open_, std::nullopt))
    post_message (element, *over);
}

} // namespace codedexposure::gst
