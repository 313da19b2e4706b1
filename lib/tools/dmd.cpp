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
#include "dmd/stop_guard.h"
#include "dmd/usb_bus.h"
#include "tools/tool.h"

namespace codedexposure::tool
{

namespace
{

using Clock = std::chrono::steady_clock;

struct Arguments {
  std::string duration;
  std::string mask = "0";
  bool predict = false;
};

std::string
seconds_text (double seconds)
{
  char text[32];
  std::snprintf (text, sizeof text, "%.1f s", seconds);
  return text;
}

/** Shows the progress of an upload and the remaining time. */
class ProgressLine
{
public:
  explicit ProgressLine (const Session &session)
      : shown_ (!session.quiet && isatty (STDERR_FILENO) != 0)
  {
  }

  void show (int sent, int total) const
  {
    if (!shown_)
      return;
    const double spent =
        std::chrono::duration<double> (Clock::now () - start_).count ();
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
open (const Session &session)
{
  return value_of (open_dmd (session.device), Exit::no_device);
}

DmdStatus
status_of (Dmd &dmd)
{
  return value_of (dmd.status (), Exit::failed);
}

Failure
failed (const Dmd &dmd, const char *how)
{
  return {Exit::failed, Error{dmd.info ().name + how}};
}

Json
describe (const DmdInfo &info)
{
  return {{"device", info.name}, {"mirrors", size_text (info.size)},
      {"array", info.array == Array::diamond ? "diamond" : "orthogonal"},
      {"shortest-mask", time_text (info.minimum_active)},
      {"shortest-pause", time_text (info.minimum_switching)},
      {"shortest-dark-time", time_text (info.minimum_dark)},
      {"masks", info.resident_masks}, {"trigger-input", info.trigger_in},
      {"trigger-output", info.trigger_out},
      {"triggers-camera", info.triggers_camera}};
}

void
list (const Session &session)
{
  const auto boards = value_of (list_usb_boards (), Exit::failed);
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
    session.say ("no DMD is connected to the USB");
  session.print (result);
}

void
status (const Session &session)
{
  const auto dmd = open (session);
  const DmdStatus now = status_of (*dmd);
  Json result{{"device", dmd->info ().name}, {"running", now.running}};
  for (const auto &[name, value] : now.details)
    result[name] = value;
  session.print (result);
}

void
stop (const Session &session)
{
  const auto dmd = open (session);
  dmd->stop ();
  if (status_of (*dmd).running)
    throw failed (*dmd, " did not stop; try again, or switch it off");
  session.print ({{"device", dmd->info ().name}, {"running", false}});
}

void
send (const Session &session, Dmd &dmd, const Schedule &schedule, Json &result)
{
  const Nanoseconds predicted = dmd.upload_time (schedule);
  result["upload-predicted"] = time_text (predicted);
  if (predicted > 0)
    session.say (
        "the upload takes at least " + seconds_text (double (predicted) / 1e9));
  const ProgressLine line (session);
  const auto start = Clock::now ();
  value_of (dmd.upload (schedule, session.stop,
                [&] (int sent, int total) { line.show (sent, total); }),
      Exit::failed);
  result["upload-took"] =
      time_text (std::chrono::nanoseconds (Clock::now () - start).count ());
}

void
upload (const Session &session, const Arguments &arguments)
{
  const auto dmd = open (session);
  const Schedule schedule = fit (session, dmd->info ()).schedule;
  Json result{{"device", dmd->info ().name}, {"schedule", schedule.text ()},
      {"masks", schedule.masks ()}};
  if (arguments.predict)
    result["upload-predicted"] = time_text (dmd->upload_time (schedule));
  else
    send (session, *dmd, schedule, result);
  session.print (result);
}

/** The value of --for. */
std::optional<std::chrono::nanoseconds>
duration_of (const Arguments &arguments)
{
  if (arguments.duration.empty ())
    return std::nullopt;
  return std::chrono::nanoseconds (
      value_of (parse_time (arguments.duration), Exit::usage));
}

/** Waits while @p dmd shows masks, then stops it. */
void
run (Session &session, Dmd &dmd,
    std::optional<std::chrono::nanoseconds> duration, const Json &result)
{
  session.say ("running; press Ctrl-C to stop");
  bool over = false;
  do
    over = wait_for (session.stop, duration.value_or (std::chrono::hours (24)));
  while (over && !duration);
  dmd.stop ();
  if (dmd.running ())
    throw failed (dmd, " did not acknowledge the stop and may still show "
                       "masks; try again, or switch it off");
  session.print (result);
  if (!over && duration)
    session.exit = Exit::interrupted;
}

void
start (Session &session, const Arguments &arguments)
{
  const auto duration = duration_of (arguments);
  const auto dmd = open (session);
  const auto [schedule, plan] = fit (session, dmd->info ());
  Json result{{"device", dmd->info ().name}};
  send (session, *dmd, schedule, result);
  value_of (dmd->start (plan, session.stop), Exit::failed);
  run (session, *dmd, duration, result);
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
    throw Failure{Exit::usage,
        Error{"cannot show mask " + in_quotes (name) + "; use 0 to " +
              std::to_string (schedule.slots () - 1) + " for " +
              schedule.text () + ", or on, or off"}};
  return still;
}

void
show (Session &session, const Arguments &arguments)
{
  const auto duration = duration_of (arguments);
  const auto dmd = open (session);
  const auto [schedule, plan] = fit (session, dmd->info ());
  const StillMask mask = still_mask (schedule, arguments.mask);
  value_of (dmd->show (mask, plan, session.stop), Exit::failed);
  run (session, *dmd, duration,
      {{"device", dmd->info ().name}, {"shows", mask.name}});
}

/** Waits until standard input ends, which means that the process that started
 * the board has ended. */
void
guard (const Session &session)
{
  std::signal (SIGHUP, SIG_IGN); // other signals request a stop
  value_of (stand_guard (STDIN_FILENO, session.device), Exit::failed);
}

/** Uploads, starts and stops a schedule that uploads fast, and checks the state
 * of the board each time. */
void
selftest (Session &session)
{
  const auto dmd = open (session);
  session.schedule = "sequential:4x1";
  if (dmd->info ().minimum_switching > 0)
    session.schedule +=
        ",switching=" + time_text (dmd->info ().minimum_switching);
  const auto [schedule, plan] = fit (session, dmd->info ());
  Json result = describe (dmd->info ());
  send (session, *dmd, schedule, result);
  value_of (dmd->start (plan, session.stop), Exit::failed);
  const auto running = dmd->status ();
  dmd->stop ();
  const bool stopped = !status_of (*dmd).running;
  if (!value_of (running, Exit::failed).running)
    throw failed (*dmd, " reports that it does not run");
  if (!stopped)
    throw failed (*dmd, " did not stop");
  result["selftest"] = "passed";
  session.print (result);
}

} // namespace

Command
dmd_commands (Session &session)
{
  const auto arguments = std::make_shared<Arguments> ();
  const auto calls = [&session, arguments] (auto command) {
    return [&session, arguments, command] {
      if constexpr (std::is_invocable_v<decltype (command), Session &>)
        command (session);
      else
        command (session, *arguments);
    };
  };
  const auto describe_board = [] (Session &s) {
    s.print (describe (open (s)->info ()));
  };
  const Option device = {"device", &session.device,
      "usb:[PORT|SERIAL], lightcrafter:[HOST] or sim:NAME"};
  const Option schedule = schedule_argument (session);
  const Option rate = rate_option (session);
  const Option duration = {
      "--for", &arguments->duration, "Stop after this time, such as 10s"};
  const Option predict = {
      "--predict", &arguments->predict, "Only predict the upload time"};
  const Option mask = {"--mask", &arguments->mask,
      "Number of a mask of the schedule, on, or off"};
  return {.name = "dmd",
      .help = "Control DMD boards",
      .commands = {
          {"list", "List the boards on the USB", {}, calls (list)},
          {"info", "Show the limits of a board", {device},
              calls (describe_board)},
          {"status", "Show the state of a board", {device}, calls (status)},
          {"upload", "Upload the masks of a schedule",
              {device, schedule, rate, predict}, calls (upload)},
          {"start", "Upload masks and show them until Ctrl-C",
              {device, schedule, rate, duration}, calls (start)},
          {"show", "Show one static mask, for alignment",
              {device, schedule, rate, duration, mask}, calls (show)},
          {"stop", "Stop a board", {device}, calls (stop)},
          /* What StopGuard starts; not for users. */
          {"guard", "", {device}, calls (guard)},
          {"selftest", "Test upload, start and stop", {device},
              calls (selftest)},
      }};
}

} // namespace codedexposure::tool
