/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The commands of the tool codedexposure, and what they share. */
#pragma once

#include <optional>
#include <stop_token>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/result.h"
#include "schedule/schedule.h"

namespace codedexposure::tool
{

/** Exit status; the man page lists them. */
enum class Exit {
  done = 0,
  failed = 1,        ///< the device failed
  usage = 2,         ///< the command line or a schedule is wrong
  no_device = 3,     ///< there is no such device, or it cannot be opened
  does_not_fit = 4,  ///< the schedule does not fit the device or the rate
  interrupted = 130, ///< by SIGINT or SIGTERM
};

/** The options that all commands share, and the exit status. */
struct Session {
  bool json = false;
  bool quiet = false;
  std::stop_token stop; ///< requested by SIGINT or SIGTERM
  Exit exit = Exit::done;

  /** Sets the exit status and prints the error. */
  void fail (Exit code, const Error &error);
  /** Prints a result as JSON, or as lines "name  value". */
  void print (const nlohmann::ordered_json &object) const;
  /** Prints a line of progress to standard error, unless --quiet. */
  void say (const std::string &line) const;
};

/** "25", "29.97" or "30000/1001" frames/s. */
Result<FrameRate> parse_rate (const std::string &text);

void add_advise_command (CLI::App &app, Session &session);
void add_dmd_commands (CLI::App &app, Session &session);
void add_schedule_commands (CLI::App &app, Session &session);

} // namespace codedexposure::tool
