/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Whether the pixels of two buffers are of one exposure. */
#pragma once

#include <optional>

#include <gst/base/gstaggregator.h>
#include <gst/video/video.h>

#include "setup/stream_setup.h"
#include "sync/partner_drift.h"
#include "sync/partner_watch.h"

namespace codedexposure::gst
{

/** One camera: what its stream says. */
struct PairStream {
  /** None: @p pad has no caps yet. */
  static std::optional<PairStream> at (
      GstAggregatorPad *pad, const std::optional<StreamSetup> &setup);

  GstVideoInfo info;
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

} // namespace codedexposure::gst
