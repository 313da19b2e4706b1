/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure dmd: lists and controls the connected boards. */
#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>

#include <unistd.h>

#include "base/text.h"
#include "base/wait.h"
#include "command.h"
#include "dmd/stop_guard.h"
#include "dmd/usb_bus.h"
#include "options/board.h"
#include "pipeline/messages.h"
#include "pipeline/program.h"

namespace codedexposure::app
{

namespace
{

using Clock = std::chrono::steady_clock;

struct Arguments : Printing, BoardOptions {
  std::string device = "usb:";
  std::optional<Nanoseconds> duration; ///< none: until Ctrl-C
  std::string mask = "0";
  bool predict = false;
  std::stop_token stop; ///< requested by SIGINT or SIGTERM
};

std::string
seconds_text (double seconds)
{
  return format ("%.1f s", seconds);
}

/** Shows the progress of an upload and the remaining time. */
class ProgressLine
{
public:
  explicit ProgressLine (const Arguments &arguments)
      : shown_ (!arguments.quiet && isatty (STDERR_FILENO) != 0)
  {
  }

  void show (int sent, int total) const
  {
    if (!shown_)
      return;
    const double spent = seconds_since (start_);
    const double part = total > 0 ? double (sent) / total : 1.0;
    std::fprintf (stderr, "\ruploading %3.0f %%", 100 * part);
    if (sent > 0 && sent < total)
      std::fprintf (stderr, ", %s left  ",
          seconds_text (spent * (1 - part) / part).c_str ());
    if (sent == total)
      std::fprintf (stderr, ", done in %s\n", seconds_text (spent).c_str ());
  }

private:
  const bool shown_;
  const Clock::time_point start_ = Clock::now ();
};

std::unique_ptr<Dmd>
open (const Arguments &arguments)
{
  return value_of (open_dmd (arguments.device), Exit::no_device);
}

DmdStatus
status_of (Dmd &dmd)
{
  return value_of (dmd.status ());
}

Json
describe (const DmdInfo &info)
{
  return {{"device", info.name}, {"mirrors", size_text (info.size)},
      {"array", info.array == Array::diamond ? "diamond" : "orthogonal"},
      {"shortest-mask", time_text (info.minimum_active)},
      {"shortest-pause", time_text (info.minimum_switching)},
      {"shortest-dark-time",
          time_text (
              info.patterns ? info.patterns->limits.minimum_dark * 1000 : 0)},
      {"masks", info.resident_masks}, {"trigger-input", info.trigger_in},
      {"trigger-output", info.trigger_out},
      {"triggers-camera", info.triggers_camera}};
}

Exit
list (const Arguments &arguments)
{
  const auto boards = value_of (list_usb_boards ());
  Json result = Json::array ();
  for (const UsbBoard &board : boards) {
    Json entry{{"device", "usb:" + board.port},
        {"controller", controller_text (board.controller)},
        {"serial", board.serial}};
    if (!board.trouble.empty ())
      entry["trouble"] = board.trouble;
    result.push_back (std::move (entry));
  }
  if (boards.empty ())
    arguments.say ("no DMD is connected to the USB");
  arguments.print (result);
  return Exit::done;
}

Exit
status (const Arguments &arguments)
{
  const auto dmd = open (arguments);
  const DmdStatus now = status_of (*dmd);
  Json result{{"device", dmd->info ().name}, {"running", now.running}};
  for (const auto &[name, value] : now.details)
    result[name] = value;
  arguments.print (result);
  return Exit::done;
}

Exit
stop (const Arguments &arguments)
{
  const auto dmd = open (arguments);
  dmd->stop ();
  if (status_of (*dmd).running)
    fail (dmd->info ().name + " did not stop; try again, or switch it off");
  arguments.print ({{"device", dmd->info ().name}, {"running", false}});
  return Exit::done;
}

void
send (const Arguments &arguments, Dmd &dmd, const Schedule &schedule,
    Json &result)
{
  const Nanoseconds predicted = dmd.upload_time (schedule);
  result["upload-predicted"] = time_text (predicted);
  if (predicted > 0)
    arguments.say (
        "the upload takes at least " + seconds_text (double (predicted) / 1e9));
  const ProgressLine line (arguments);
  const auto start = Clock::now ();
  value_of (dmd.upload (schedule, arguments.stop,
      [&] (int sent, int total) { line.show (sent, total); }));
  result["upload-took"] =
      time_text (std::chrono::nanoseconds (Clock::now () - start).count ());
}

Exit
upload (const Arguments &arguments)
{
  const auto dmd = open (arguments);
  const Schedule schedule = fit (arguments, dmd->info ()).schedule;
  Json result{{"device", dmd->info ().name}, {"schedule", schedule.text ()},
      {"masks", schedule.masks ()}};
  if (arguments.predict)
    result["upload-predicted"] = time_text (dmd->upload_time (schedule));
  else
    send (arguments, *dmd, schedule, result);
  arguments.print (result);
  return Exit::done;
}

/** Waits while @p dmd shows masks, then stops it. */
Exit
run (const Arguments &arguments, Dmd &dmd, const Json &result)
{
  constexpr Nanoseconds kDay = 24 * 3'600'000'000'000;
  const auto &duration = arguments.duration;
  arguments.say ("running; press Ctrl-C to stop");
  bool over = false;
  do
    over = wait_for (
        arguments.stop, std::chrono::nanoseconds (duration.value_or (kDay)));
  while (over && !duration);
  dmd.stop ();
  if (dmd.running ())
    fail (dmd.info ().name +
          " did not acknowledge the stop and may still show masks; try again, "
          "or switch it off");
  arguments.print (result);
  return !over && duration ? Exit::interrupted : Exit::done;
}

Exit
start (const Arguments &arguments)
{
  const auto dmd = open (arguments);
  const auto [schedule, plan] = fit (arguments, dmd->info ());
  Json result{{"device", dmd->info ().name}};
  send (arguments, *dmd, schedule, result);
  value_of (dmd->start (plan, arguments.stop));
  return run (arguments, *dmd, result);
}

/** A mask that is shown in all slots: "on", "off", or a number of a mask of the
 * schedule. */
StillMask
still_mask (const Schedule &schedule, const std::string &name)
{
  StillMask still{"mirrors " + name, {}, schedule.slots ()};
  const auto mask = parse_int (name);
  if (name == "on" || name == "off")
    still.on = [on = name == "on"] (int, int) { return on; };
  else if (mask && *mask >= 0 && *mask < schedule.slots ())
    still.on = [schedule, slot = *mask] (
                   int x, int y) { return schedule.on (x, y, slot); };
  else
    usage_error ("cannot show mask " + in_quotes (name) + "; use 0 to " +
                 std::to_string (schedule.slots () - 1) + " for " +
                 schedule.text () + ", or on, or off");
  return still;
}

Exit
show (const Arguments &arguments)
{
  const auto dmd = open (arguments);
  const auto [schedule, plan] = fit (arguments, dmd->info ());
  const StillMask mask = still_mask (schedule, arguments.mask);
  value_of (dmd->show (mask, plan, arguments.stop));
  return run (
      arguments, *dmd, {{"device", dmd->info ().name}, {"shows", mask.name}});
}

/** Waits until standard input ends, which means that the process that started
 * the board has ended. */
Exit
guard (const Arguments &arguments)
{
  std::signal (SIGHUP, SIG_IGN); // other signals request a stop
  value_of (stand_guard (STDIN_FILENO, arguments.device));
  return Exit::done;
}

/** Uploads, starts and stops a schedule that uploads fast, and checks the state
 * of the board each time. */
Exit
selftest (const Arguments &asked)
{
  Arguments arguments = asked;
  const auto dmd = open (arguments);
  arguments.schedule = "sequential:4x1";
  if (dmd->info ().minimum_switching > 0)
    arguments.schedule +=
        ",switching=" + time_text (dmd->info ().minimum_switching);
  const auto [schedule, plan] = fit (arguments, dmd->info ());
  Json result = describe (dmd->info ());
  send (arguments, *dmd, schedule, result);
  value_of (dmd->start (plan, arguments.stop));
  const auto running = dmd->status ();
  dmd->stop ();
  const bool stopped = !status_of (*dmd).running;
  if (!value_of (running).running)
    fail (dmd->info ().name + " reports that it does not run");
  if (!stopped)
    fail (dmd->info ().name + " did not stop");
  result["selftest"] = "passed";
  arguments.print (result);
  return Exit::done;
}

Exit
info (const Arguments &arguments)
{
  arguments.print (describe (open (arguments)->info ()));
  return Exit::done;
}

/* An error that a signal has caused is an interruption. */
Exit
run_command (Arguments &arguments, Exit (*run) (const Arguments &))
{
  name_this_program ();
  arguments.stop = stop_at_signals ();
  try {
    return run (arguments);
  } catch (const Failure &failure) {
    if (arguments.stop.stop_requested ())
      throw Failure{Exit::interrupted, failure.error};
    throw;
  }
}

/** Which options a command has beside the device. */
struct Takes {
  bool schedule = false, duration = false, predict = false, mask = false;
  bool no_device = false;
};

void
declare (Options &options, Arguments &arguments, const Takes &takes)
{
  if (!takes.no_device)
    options.word ("DEVICE", arguments.device, true);
  if (takes.schedule) {
    options.word ("SCHEDULE", arguments.schedule, true);
    arguments.declare_rate (options);
  }
  if (takes.duration)
    options.value ("--for", arguments.duration, "TIME",
        "stop after this time, such as 10s [at Ctrl-C]", time_rule ());
  if (takes.predict)
    options.flag (
        "--predict", arguments.predict, "only predict the upload time");
  if (takes.mask)
    options.value ("--mask", arguments.mask, "M",
        "number of a mask of the schedule, on, or off [0]", any_text ());
  arguments.declare (options);
}

struct Entry {
  const char *name, *summary, *description;
  Exit (*run) (const Arguments &);
  Takes takes;
};

constexpr Entry kEntries[] = {
    {"list", "list the boards on the USB",
        "Lists the boards on the USB with their ports and serial numbers.\n",
        list, {.no_device = true}},
    {"info", "show the limits of a board",
        "Shows the limits of a board: its mirrors, the min time of a mask and "
        "of the dark\ntime between two masks, the number of masks that it "
        "stores, and its triggers.\n",
        info, {}},
    {"status", "show the state of a board",
        "Shows the state that a board reports. The board continues to run.\n",
        status, {}},
    {"upload", "upload the masks of a schedule",
        "Prints the min upload time and uploads the masks. A board keeps its "
        "masks only\nwhile it is open, so use this to test a schedule, not to "
        "prepare a start.\n",
        upload, {.schedule = true, .predict = true}},
    {"start", "upload masks and show them until Ctrl-C",
        "Uploads the masks and shows them, with one exposure in each frame. If "
        "the\nprogram is killed, a separate process stops the board.\n",
        start, {.schedule = true, .duration = true}},
    {"show", "show one static mask, for alignment",
        "Shows one static mask with the trigger of the schedule, for focus and "
        "alignment.\nThe board must accept masks at run time.\n",
        show, {.schedule = true, .duration = true, .mask = true}},
    {"stop", "stop a board",
        "Stops a board, also if another program started it.\n", stop, {}},
    /* What StopGuard starts; not for users. */
    {"guard", "", "Stops a board when its standard input ends.\n", guard, {}},
    {"selftest", "test upload, start and stop",
        "Uploads a schedule with a short upload time, starts and stops it, and "
        "checks the\nstate of the board each time.\n",
        selftest, {}},
};

} // namespace

Command
dmd_command ()
{
  std::vector<Below<Arguments>> below;
  for (const Entry &entry : kEntries)
    below.push_back (
        {{.name = entry.name,
             .summary = entry.summary,
             .usage = entry.takes.no_device  ? "[option...]"
                      : entry.takes.schedule ? "[option...] [DEVICE] [SCHEDULE]"
                                             : "[option...] [DEVICE]",
             .description = entry.description},
            [&entry] (Options &options, Arguments &arguments) {
              declare (options, arguments, entry.takes);
            },
            [&entry] (Arguments &arguments) {
              return run_command (arguments, entry.run);
            }});
  return make_group<Arguments> ({.name = "dmd",
                                    .summary = "list and control DMD boards",
                                    .usage = "COMMAND [option...] [DEVICE]",
                                    .description = R"(
DEVICE is usb:[PORT|SERIAL], lightcrafter:[ADDRESS] or sim:NAME, followed by
options such as ,master=camera [usb:, the only board on the USB].
)",
                                    .notes = R"(
Exit status: 0 done, 1 the device failed, 2 wrong usage, 3 there is no such
device, 4 the schedule does not fit, 130 interrupted.

Examples:
  A test of a board, here of the simulated one:
    codedexposure dmd selftest sim:bench
)"},
      below);
}

} // namespace codedexposure::app
