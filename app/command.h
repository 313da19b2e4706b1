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

/** What --help says of a command, in its order. */
struct CommandText {
  std::string name;
  /** One line for the list of commands; empty: the command is not listed. */
  std::string summary;
  /** After "codedexposure NAME": "[option...] RECORDING.mkv --output OUT". */
  std::string usage;
  std::string description;
  /** After the options: a list of exit statuses, keys ... */
  std::string notes = {};
  /** Lines of the form "  What it shows:\n    codedexposure NAME ...". */
  std::string examples = {};
};

/** A subcommand: its options, and what it does. */
class Command
{
public:
  virtual ~Command () = default;

  virtual CommandText text () const = 0;
  /** Declares its options and how they exclude or need each other. */
  virtual void declare (Options &options) = 0;
  /** After the command line was parsed. Throws Failure. */
  virtual Exit run () = 0;
  /** Another program reads its options: run_with () gets them all. */
  virtual bool parses_itself () const { return false; }
  virtual void run_with (const std::vector<std::string> &) {}
  /** Commands of its own, such as "schedule show"; then run () is not called.
   */
  virtual std::vector<std::unique_ptr<Command>> commands () { return {}; }
};

/** A command of a few functions, for those that share their arguments. */
class SmallCommand : public Command
{
public:
  SmallCommand (CommandText text, std::function<void (Options &)> declare,
      std::function<Exit ()> run)
      : text_ (std::move (text)), declare_ (std::move (declare)),
        run_ (std::move (run))
  {
  }
  CommandText text () const override { return text_; }
  void declare (Options &options) override { declare_ (options); }
  Exit run () override { return run_ (); }

private:
  CommandText text_;
  std::function<void (Options &)> declare_;
  std::function<Exit ()> run_;
};

/** A name with commands below it; Arguments are what those share. */
template <typename Arguments>
class CommandGroup : public Command
{
public:
  using Commands = std::vector<std::unique_ptr<Command>>;

  CommandGroup (CommandText text, Commands (*below) (Arguments &))
      : text_ (std::move (text)), below_ (below)
  {
  }
  CommandText text () const override { return text_; }
  void declare (Options &) override {}
  Exit run () override { return Exit::usage; }
  Commands commands () override { return below_ (arguments_); }

private:
  CommandText text_;
  Commands (*below_) (Arguments &);
  Arguments arguments_;
};

template <typename T>
std::unique_ptr<Command>
make_command ()
{
  return std::make_unique<T> ();
}

/** All of this build, in the order of --help. */
std::vector<std::unique_ptr<Command>> all_commands ();
/** A message: there is none of that name, or not in this build. */
std::string no_command (const std::string &name);

/* One for each file of commands/; nullptr: this build lacks its libraries. */
std::unique_ptr<Command> advise_command ();
std::unique_ptr<Command> archive_command ();
std::unique_ptr<Command> bench_command ();
std::unique_ptr<Command> calibrate_command ();
std::unique_ptr<Command> camera_command ();
std::unique_ptr<Command> decode_command ();
std::unique_ptr<Command> dmd_command ();
std::unique_ptr<Command> doctor_command ();
std::unique_ptr<Command> live_command ();
std::unique_ptr<Command> info_command ();
std::unique_ptr<Command> join_command ();
std::unique_ptr<Command> pack_command ();
std::unique_ptr<Command> play_command ();
std::unique_ptr<Command> profile_command ();
std::unique_ptr<Command> receive_command ();
std::unique_ptr<Command> record_command ();
std::unique_ptr<Command> report_command ();
std::unique_ptr<Command> schedule_command ();
std::unique_ptr<Command> send_command ();
std::unique_ptr<Command> simulate_command ();

} // namespace codedexposure::app
