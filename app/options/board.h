/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the commands about schedules and boards share. */
#pragma once

#include <stop_token>
#include <string>

#include <nlohmann/json.hpp>

#include "dmd/dmd.h"
#include "options.h"

namespace codedexposure::app
{

using Json = nlohmann::ordered_json;

/** How results are printed. */
struct Printing {
  bool json = false;
  bool quiet = false;

  void declare (Options &options);
  /** A result as JSON, or as lines "name  value", on standard output. */
  void print (const Json &object) const;
  /** A line of progress on standard error, unless --quiet. */
  void say (const std::string &line) const;
};

/** A schedule, the frame rate of the camera, and a board. */
struct BoardOptions {
  std::string schedule = "sequential:2x2";
  FrameRate rate{25, 1};
  std::string board = "dlp6500";

  void declare_rate (Options &options);
  void declare_board (Options &options);
  Schedule parsed () const;
  /** The board that --dmd names. */
  DmdInfo info () const;
};

/** A schedule, and its slots on a device that can show them. */
struct Show {
  Schedule schedule;
  SlotPlan plan;
};
/** Throws Failure if the schedule does not fit the device or the rate. */
Show fit (const BoardOptions &options, const DmdInfo &info);

/** A time such as 500us or 10s. @p such  the examples for a message. */
Rule<Nanoseconds> time_rule (const std::string &such = "500us or 10s");

/** Requests a stop at SIGINT, SIGTERM and SIGHUP, for work that is no pipeline.
 * Make it before any thread starts. */
std::stop_token stop_at_signals ();

} // namespace codedexposure::app
