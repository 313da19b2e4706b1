/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A pane of the window, for the files that make up the window. */
#pragma once

#include "window/window.h"

namespace codedexposure::app
{

constexpr std::size_t kCamera = 0, kSubframes = 1; ///< indices of panes

/** For which pictures are kept. */
constexpr ViewTime kLoop = GST_SECOND;

/** Running and stream time; none: outside of the segment. */
struct ViewTimes {
  GstClockTime running = GST_CLOCK_TIME_NONE, stream = GST_CLOCK_TIME_NONE;
};
/** Of @p time at @p pad. */
ViewTimes view_times_of (GstPad *pad, GstClockTime time);

struct Window::Pane {
  std::size_t index;
  WindowPane part;

  /* The thread of the pane: */
  std::optional<StatsMeter> meter;
  Extent metered;
  int metered_bits = 0;
  std::shared_ptr<const Exposure> exposure; // of the frame that passes

  /* The thread that draws: */
  Detail detail;

  /* Of the mutex: */
  Extent size; // of its pictures in the window
  std::string caption;
  Recent<ShownPtr> recent{kLoop};
};

} // namespace codedexposure::app
