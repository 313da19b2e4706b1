/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The plugin's custom events and queries: new_event (), parse_event (),
 * new_query (), answer_query () and parse_query () build and read them. */
#pragma once

#include "structure.h"

namespace codedexposure::gst
{

/** Sticky, downstream: a recording says what each frame of the stream is, so
 * one without a meta was changed since. */
inline constexpr const char *kRecordedEvent = "codedexposure/recorded";

/** Any element downstream of dmdsync can request a pattern; it expires unless
 * it is requested again. */
struct PatternRequest {
  static constexpr const char *kName = "dmdsync/pattern";
  static constexpr GstEventType kType = GST_EVENT_CUSTOM_UPSTREAM;
  std::optional<std::string> pattern; ///< none or empty: the schedule's masks
  std::optional<guint64> frames;      ///< for how many; none: dmdsync's default
  CODED_FIELDS (pattern, frames);
};

/** Query: which mirrors dmdsync controls, and whether it can show patterns. */
struct MirrorsAnswer {
  static constexpr const char *kName = "dmdsync/mirrors";
  gint width = 0, height = 0; ///< of the mirror array; 0: no device
  bool patterns = false;      ///< PatternRequest is served
  std::string reason = {};    ///< why not
  CODED_FIELDS (width, height, patterns, reason);
};

/** Query, from a camera whose frames stay away: whether dmdsync has the DMD
 * show something else, which triggers no camera meanwhile. */
struct SwitchAnswer {
  static constexpr const char *kName = "dmdsync/switch";
  bool switching = false; ///< no frame has shown it yet
  bool sending = false;   ///< the DMD still receives masks
  CODED_FIELDS (switching, sending);
};

/** Query: whether coded frames come from codedexposure-pair, so that they have
 * partners as soon as the second camera sends frames. */
struct PairsAnswer {
  static constexpr const char *kName = "codedexposure/pairs";
  bool come = false;
  CODED_FIELDS (come);
};

} // namespace codedexposure::gst
