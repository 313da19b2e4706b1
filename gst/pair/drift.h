/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Says when the second camera has moved. */
#pragma once

#include <deque>
#include <optional>

#include <gst/gst.h>

#include "sync/partner_drift.h"

namespace codedexposure::gst
{

/** Streaming thread. */
class DriftWatch
{
public:
  /** Of other streams, or after a gap in them. */
  void reset () { *this = {}; }
  /** Whether the pair at @p pts is to be measured: one a second is. */
  bool is_due (GstClockTime pts);
  /** The median of the last pairs; none: not known. */
  std::optional<PartnerDrift::Shift> median () const;
  /** Takes what the pair at @p pts shows; posts PartnerDrifted of @p element
   * when the median begins or ceases to be too large. */
  void take (gpointer element, GstClockTime pts,
      const std::optional<PartnerDrift::Shift> &shift);

private:
  GstClockTime last_ = GST_CLOCK_TIME_NONE; ///< that was measured
  std::deque<PartnerDrift::Shift> shifts_;
  bool has_moved_ = false;
};

} // namespace codedexposure::gst
