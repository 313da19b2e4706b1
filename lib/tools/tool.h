/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure: what its commands share, and the commands. */
#pragma once

#include <optional>
#include <stop_token>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/result.h"
#include "schedule/schedule.h"

namespace cexp::tool
{

/** Exit status; the man page lists them. */
enum class Exit {
  done = 0,
  failed = 1,        ///< the device did not do it
  usage = 2,         ///< the command line or a schedule is wrong
  no_device = 3,     ///< the device is not there or cannot be opened
  does_not_fit = 4,  ///< the schedule is not for this device or frame rate
  interrupted = 130, ///< by SIGINT or SIGTERM
};

/** What the user said to all commands, and what became of it. */
struct Session {
  bool json = false;
  bool quiet = false;
  std::stop_token stop; ///< SIGINT or SIGTERM came
  Exit exit = Exit::done;

  /** Notes why the program is going to fail, and says it. */
  void fail (Exit code, const Error &error);
  /** Prints a result: as JSON, or as "name  value" lines. */
  void print (const nlohmann::ordered_json &object) const;
  /** One line about what goes on, on standard error. */
  void say (const std::string &line) const;
};

/** "25", "29.97" or "30000/1001" frames/s. */
Result<FrameRate> parse_rate (const std::string &text);

void add_advise_command (CLI::App &app, Session &session);
void add_dmd_commands (CLI::App &app, Session &session);
void add_schedule_commands (CLI::App &app, Session &session);

} // namespace cexp::tool
