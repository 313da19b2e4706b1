/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the pixels of two buffers show: whether they are of one exposure, and
 * whether the second camera has moved. */
#pragma once

#include <deque>
#include <optional>

#include <gst/video/video.h>

#include "common/raii.h"
#include "setup/stream_setup.h"
#include "sync/partner_drift.h"
#include "sync/partner_watch.h"

namespace codedexposure::gst
{

/** One camera: what its stream says of its next frame. The sticky events of the
 * pad can be those of later frames, which still are in its queue. */
struct PairStream {
  CapsPtr caps = {};      ///< null: none came yet
  GstVideoInfo info = {}; ///< of the caps
  std::optional<StreamSetup> setup = {};
};

class PairCheck
{
public:
  /** With streams whose frames cannot be compared, since no tag says how they
   * lie on the mirrors, no verdict will be known. */
  void configure (const PairStream &on, const PairStream &off);
  /** The next pair has none before it. */
  void reset ();
  /** Buffers that cannot be read are not known. */
  PartnerWatch::Verdict check (GstBuffer *coded, GstBuffer *partner);
  /** A frame that has no partner, of the second camera if it is @p off. */
  void take_alone (GstBuffer *frame, bool off);
  /** How far the second camera has moved, by partners; none: not known. */
  std::optional<PartnerDrift::Shift> drift (
      GstBuffer *coded, GstBuffer *partner) const;

private:
  std::optional<PartnerWatch> watch_;
  std::optional<PartnerDrift> drift_; ///< none: masks are not of one period
  GstVideoInfo on_ = {}, off_ = {};
};

/** Says when the second camera has moved. */
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
