/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "alone.h"

#include <utility>

namespace codedexposure::gst
{

void
AloneFrames::add (gpointer element, GstClockTime pts, const char *reason)
{
  if (!reason)
    return close (element, pts);
  if (frames_++ == 0) {
    from_ = pts;
    reason_ = reason;
    post_message (
        element, PartnerLost{.active = true, .reason = reason, .from = pts});
  }
  last_ = pts;
}

void
AloneFrames::close (gpointer element, GstClockTime to)
{
  const guint64 frames = std::exchange (frames_, 0);
  if (frames > 0)
    post_message (element, PartnerLost{.active = false,
                               .reason = reason_,
                               .frames = frames,
                               .from = from_,
                               .to = to});
}

} // namespace codedexposure::gst
