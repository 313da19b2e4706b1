/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-pair: pair.cpp makes pairs, events.cpp handles events and
 * queries. */
#pragma once

#include <limits>
#include <vector>

#include <gst/base/gstaggregator.h>

#include "common/alone.h"
#include "common/element.h"
#include "common/raii.h"
#include "pair/check.h"

namespace codedexposure::gst::pairs
{

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
  bool has_ended = false; ///< the next frame is none
  bool check_due = false; ///< a stream is another
  bool refused = false;   ///< an error was posted
  bool is_silent = false; ///< no coded frame is there to be late for
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
