/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The commands of the tool codedexposure, and what they share. */
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/result.h"
#include "dmd/dmd.h"

namespace codedexposure::tool
{

using Json = nlohmann::ordered_json;

/** Exit status; the man page lists them. */
enum class Exit {
  done = 0,
  failed = 1,        ///< the device failed, or output was lost
  usage = 2,         ///< the command line or a schedule is wrong
  no_device = 3,     ///< there is no such device, or it cannot be opened
  does_not_fit = 4,  ///< the schedule does not fit the device or the rate
  interrupted = 130, ///< by SIGINT or SIGTERM
};

/** Thrown by commands; main () prints the message. */
struct Failure {
  Exit exit;
  Error error;
};

/** The value of @p result; throws a Failure if it has none. */
template <typename T>
T
value_of (Result<T> result, Exit exit)
{
  if (!result)
    throw Failure{exit, result.error ()};
  if constexpr (!std::is_void_v<T>)
    return *std::move (result);
}

/** The arguments of all commands, and the exit status. */
struct Session {
  bool json = false;
  bool quiet = false;
  std::string device = "usb:";
  std::string schedule = "sequential:2x2";
  std::string rate = "25";
  std::string board = "dlp6500";
  std::stop_token stop; ///< requested by SIGINT or SIGTERM
  Exit exit = Exit::done;

  /** Prints a result as JSON, or as lines "name  value". */
  void print (const Json &object) const;
  /** Prints a line of progress to standard error, unless --quiet. */
  void say (const std::string &line) const;
};

/** "25", "29.97" or "30000/1001" frames/s. */
FrameRate parse_rate (const std::string &text);

/** What a board can do: dlp3000, dlp4500, dlp6500 or dlp9000. */
DmdInfo find_board (const std::string &name);

/** A schedule, and its slots on a device that can show them. */
struct Show {
  Schedule schedule;
  SlotPlan plan;
};
/** The schedule and frame rate of @p session on a device. */
Show fit (const Session &session, const DmdInfo &info);

/** An option, or an argument if its name begins with a letter; a bool is a
 * flag. What @p value points to has the default, which --help shows. */
struct Option {
  std::string name;
  std::variant<bool *, int *, double *, std::string *,
      std::vector<std::string> *>
      value;
  std::string help;
  bool *given = nullptr; ///< set if it is on the command line
};

/** A subcommand; one without help is not listed. */
struct Command {
  std::string name;
  std::string help;
  std::vector<Option> options = {};
  std::function<void ()> run = {};
  std::vector<Command> commands = {};
};

Option schedule_argument (Session &session);
Option rate_option (Session &session);
Option board_option (Session &session);

Command advise_command (Session &session);
Command bench_commands (Session &session);
Command dmd_commands (Session &session);
Command schedule_commands (Session &session);

} // namespace codedexposure::tool
