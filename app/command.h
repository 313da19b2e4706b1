/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The subcommands of the program. */
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "failure.h"
#include "options/options.h"

namespace codedexposure::app
{

/** What --help says of a command, in its order. A description and notes may
 * begin with a line break, which is not shown. */
struct CommandText {
  std::string name;
  /** One line for the list of commands; empty: the command is not listed. */
  std::string summary;
  /** After "codedexposure NAME": "[option...] RECORDING.mkv --output OUT". */
  std::string usage;
  std::string description;
  /** After the options: a list of exit statuses, and examples of the form
   * "  What it shows:\n    codedexposure NAME ...". */
  std::string notes = {};
};

/** A subcommand: its options, and what it does. */
struct Command {
  CommandText text;
  /** Declares its options and how they exclude or need each other. */
  std::function<void (Options &)> declare;
  /** After the command line was parsed. Throws Failure. */
  std::function<Exit ()> run;
  /** Commands of its own, such as "schedule show"; then nothing else is run. */
  std::vector<Command> below = {};
  /** Another program reads its options: this gets them all. */
  std::function<void (const std::vector<std::string> &)> run_with = nullptr;
};

/** That of a class with declare () and run (). */
template <typename Class>
Command
make_command (CommandText text)
{
  const auto made = std::make_shared<Class> ();
  return {std::move (text),
      [made] (Options &options) { made->declare (options); },
      [made] { return made->run (); }};
}

/** A command below another one; Arguments are what those of a group share. */
template <typename Arguments>
struct Below {
  CommandText text;
  std::function<void (Options &, Arguments &)> declare;
  std::function<Exit (Arguments &)> run;
};

/** A name with commands below it. */
template <typename Arguments>
Command
make_group (CommandText text, const std::vector<Below<Arguments>> &below)
{
  const auto arguments = std::make_shared<Arguments> ();
  Command group{std::move (text), [] (Options &) {}, nullptr};
  for (const Below<Arguments> &each : below)
    group.below.push_back ({each.text,
        [arguments, declare = each.declare] (
            Options &options) { declare (options, *arguments); },
        [arguments, run = each.run] { return run (*arguments); }});
  return group;
}

/** All of this build, in the order of --help. */
std::vector<Command> all_commands ();
/** A message: there is none of that name, or not in this build. */
std::string no_command (const std::string &name);

/* One for each file of commands/; without a name: this build lacks its
 * libraries. */
Command advise_command ();
Command archive_command ();
Command bench_command ();
Command calibrate_command ();
Command camera_command ();
Command decode_command ();
Command dmd_command ();
Command doctor_command ();
Command live_command ();
Command info_command ();
Command join_command ();
Command pack_command ();
Command play_command ();
Command profile_command ();
Command receive_command ();
Command record_command ();
Command report_command ();
Command schedule_command ();
Command send_command ();
Command simulate_command ();

} // namespace codedexposure::app
