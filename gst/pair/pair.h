/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-pair: pair.cpp makes pairs, check.cpp compares their pixels,
 * events.cpp handles events and queries. */
#pragma once

#include <deque>
#include <limits>
#include <optional>
#include <vector>

#include <gst/base/gstaggregator.h>
#include <gst/video/video.h>

#include "common/alone.h"
#include "common/element.h"
#include "common/raii.h"
#include "setup/stream_setup.h"
#include "sync/partner_drift.h"
#include "sync/partner_watch.h"

namespace codedexposure::gst::pairs
{

/** One camera: what its stream says of its next frame. The sticky events of the
 * pad can be those of later frames, which still are in its queue. */
struct PairStream {
  CapsPtr caps = {};      ///< null: none came yet
  GstVideoInfo info = {}; ///< of the caps
  std::optional<StreamSetup> setup = {};
};

/** What the pixels of two buffers show: whether they are of one exposure, and
 * whether the second camera has moved. */
class PairCheck
{
public:
  /** With streams whose frames cannot be compared, since no tag says how they
   * lie on the mirrors, no verdict will be known. */
  void configure (const PairStream &on, const PairStream &off);
  /** False if both streams say which masks they saw, and these differ. */
  bool are_masks_alike () const { return are_masks_alike_; }
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
  bool are_masks_alike_ = true;
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

struct Counters {
  guint64 paired = 0, confirmed = 0, alone = 0, refused = 0, dropped = 0;
};

inline constexpr PartnerDrift::Shift kUnknown{
    {0.0, 0.0}, std::numeric_limits<double>::infinity (), {0.0, 0.0}};

/* What is forgotten at the end of a run. Source pad's streaming thread, which
 * also handles serialized events. */
struct Run {
  PairStream on, off;
  std::vector<EventPtr> due; ///< before the next coded frame or the end
  bool setup_due = false;
  /** A frame has pushed caps and segment of the base class, so that a gap need
   * not wait for one. */
  bool has_begun = false;
  bool has_ended = false;  ///< the next frame is none
  bool check_due = false;  ///< a stream is another
  bool refused = false;    ///< an error was posted
  bool masks_said = false; ///< that they differ
  bool is_silent = false;  ///< no coded frame is there to be late for
  PairCheck check;
  AloneFrames alone;
  guint64 refused_in_a_row = 0;
  DriftWatch drift;

  void set_due () { setup_due = check_due = true; }
  bool is_due () const { return setup_due || !due.empty (); }
};

struct PairState : Run {
  /* Object lock: */
  Counters counters;
  PartnerDrift::Shift shift = kUnknown; ///< of the last pairs
};

struct GstCodedExposurePair : Instance<GstAggregator, PairState> {
};

inline constexpr auto &state = state_in<GstCodedExposurePair>;

inline GstAggregatorPad *
sink (gpointer self, const char *name)
{
  /* Always there, and so is what it points to. */
  return GST_AGGREGATOR_PAD (pad_of (GST_ELEMENT (self), name).get ());
}

/* The events that wait, and the stream tag if it has changed. */
void push_due (GstCodedExposurePair *self);

/* Virtual functions of GstAggregator. */
gboolean sink_event (
    GstAggregator *aggregator, GstAggregatorPad *pad, GstEvent *event);
gboolean sink_query (
    GstAggregator *aggregator, GstAggregatorPad *pad, GstQuery *query);
gboolean src_event (GstAggregator *aggregator, GstEvent *event);
gboolean src_query (GstAggregator *aggregator, GstQuery *query);
GstFlowReturn flush (GstAggregator *aggregator);

} // namespace codedexposure::gst::pairs
