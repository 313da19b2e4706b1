/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure dmd: lists and controls the connected boards. */
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <functional>
#include <memory>
#include <mutex>

#include <unistd.h>

#include "base/text.h"
#include "dmd/dmd.h"
#include "dmd/stop_guard.h"
#include "dmd/usb_bus.h"
#include "tools/tool.h"

namespace codedexposure::tool
{

namespace
{

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

struct Arguments {
  std::string device = "usb:";
  std::string schedule = "sequential:2x2";
  std::string rate = "25";
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

  void operator() (int sent, int total)
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
open (Session &session, const std::string &device)
{
  auto dmd = open_dmd (device);
  if (dmd)
    return *std::move (dmd);
  session.fail (Exit::no_device, dmd.error ());
  return nullptr;
}

Json
describe (const DmdInfo &info)
{
  return {{"device", info.name},
      {"mirrors", std::to_string (info.size.width) + "x" +
                      std::to_string (info.size.height)},
      {"array", info.array == Array::diamond ? "diamond" : "orthogonal"},
      {"shortest-mask", time_text (info.minimum_active)},
      {"shortest-pause", time_text (info.minimum_switching)},
      {"shortest-dark-time", time_text (info.minimum_dark)},
      {"masks", info.resident_masks}, {"trigger-input", info.trigger_in},
      {"trigger-output", info.trigger_out},
      {"triggers-camera", info.triggers_camera}};
}

void
list (Session &session)
{
  const auto boards = list_usb_boards ();
  if (!boards)
    return session.fail (Exit::failed, boards.error ());
  Json result = Json::array ();
  for (const UsbBoard &board : *boards) {
    Json entry{{"device", "usb:" + board.port},
        {"controller", controller_text (board.controller)},
        {"serial", board.serial}};
    if (!board.trouble.empty ())
      entry["trouble"] = board.trouble;
    result.push_back (std::move (entry));
  }
  if (boards->empty ())
    session.say ("no DMD is connected to the USB");
  session.print (result);
}

void
status (Session &session, const Arguments &arguments)
{
  const auto dmd = open (session, arguments.device);
  if (!dmd)
    return;
  const auto now = dmd->status ();
  if (!now)
    return session.fail (Exit::failed, now.error ());
  Json result{{"device", dmd->info ().name}, {"running", now->running}};
  for (const auto &[name, value] : now->details)
    result[name] = value;
  session.print (result);
}

void
stop (Session &session, const Arguments &arguments)
{
  const auto dmd = open (session, arguments.device);
  if (!dmd)
    return;
  dmd->stop ();
  const auto now = dmd->status ();
  if (!now)
    return session.fail (Exit::failed, now.error ());
  if (now->running)
    return session.fail (Exit::failed,
        Error{
            dmd->info ().name + " did not stop; try again, or switch it off"});
  session.print ({{"device", dmd->info ().name}, {"running", false}});
}

/** A schedule and its slots, for a device that can show them. */
struct Show {
  Schedule schedule;
  SlotPlan plan;
};

std::optional<Show>
fit (Session &session, const Arguments &arguments, const DmdInfo &info)
{
  const auto rate = parse_rate (arguments.rate);
  const auto schedule = Schedule::parse (arguments.schedule);
  if (!rate || !schedule) {
    session.fail (Exit::usage, rate ? schedule.error () : rate.error ());
    return std::nullopt;
  }
  const auto plan =
      SlotPlan::fit (schedule->timing (), schedule->slots (), *rate);
  const auto fits =
      plan ? check_limits (info, *schedule, *plan) : plan.error ();
  if (!fits) {
    session.fail (Exit::does_not_fit, fits.error ());
    return std::nullopt;
  }
  return Show{*schedule, *plan};
}

bool
send (Session &session, Dmd &dmd, const Schedule &schedule, Json &result)
{
  const Nanoseconds predicted = dmd.upload_time (schedule);
  result["upload-predicted"] = time_text (predicted);
  if (predicted > 0)
    session.say (
        "the upload takes at least " + seconds_text (double (predicted) / 1e9));
  ProgressLine line (session);
  const auto start = Clock::now ();
  const auto sent = dmd.upload (schedule, session.stop,
      [&] (int done, int total) { line (done, total); });
  if (!sent) {
    session.fail (Exit::failed, sent.error ());
    return false;
  }
  result["upload-took"] =
      time_text (std::chrono::nanoseconds (Clock::now () - start).count ());
  return true;
}

void
upload (Session &session, const Arguments &arguments)
{
  const auto dmd = open (session, arguments.device);
  if (!dmd)
    return;
  const auto show = fit (session, arguments, dmd->info ());
  if (!show)
    return;
  Json result{{"device", dmd->info ().name},
      {"schedule", show->schedule.text ()}, {"masks", show->schedule.masks ()}};
  if (arguments.predict)
    result["upload-predicted"] = time_text (dmd->upload_time (show->schedule));
  else if (!send (session, *dmd, show->schedule, result))
    return;
  session.print (result);
}

/** Waits until @p duration is over, or until the user stops the program:
 * false. */
bool
wait (const Session &session, std::optional<Nanoseconds> duration)
{
  std::mutex lock;
  std::condition_variable_any never;
  std::unique_lock guard (lock);
  const auto nothing = [] { return false; };
  if (duration)
    never.wait_for (
        guard, session.stop, std::chrono::nanoseconds (*duration), nothing);
  else
    never.wait (guard, session.stop, nothing);
  return !session.stop.stop_requested ();
}

/** Parses --for; false, with an error, if it is invalid. */
bool
read_duration (Session &session, const Arguments &arguments,
    std::optional<Nanoseconds> &duration)
{
  if (arguments.duration.empty ())
    return true;
  const auto parsed = parse_time (arguments.duration);
  if (parsed)
    duration = *parsed;
  else
    session.fail (Exit::usage, parsed.error ());
  return parsed.ok ();
}

/** Parks the mirrors of @p dmd; false, with an error, when it does not answer.
 */
bool
park (Session &session, Dmd &dmd)
{
  dmd.stop ();
  if (dmd.running ())
    session.fail (Exit::failed,
        Error{dmd.info ().name + " did not acknowledge the stop and may still "
                                 "show masks; try again, or switch it off"});
  return !dmd.running ();
}

/** Waits while @p dmd shows masks, then stops it. */
void
run (Session &session, Dmd &dmd, std::optional<Nanoseconds> duration,
    const Json &result)
{
  session.say ("running; press Ctrl-C to stop");
  const bool over = wait (session, duration);
  if (!park (session, dmd))
    return;
  session.print (result);
  if (!over && duration)
    session.exit = Exit::interrupted;
}

void
start (Session &session, const Arguments &arguments)
{
  std::optional<Nanoseconds> duration;
  if (!read_duration (session, arguments, duration))
    return;
  const auto dmd = open (session, arguments.device);
  if (!dmd)
    return;
  const auto show = fit (session, arguments, dmd->info ());
  Json result{{"device", dmd->info ().name}};
  if (!show || !send (session, *dmd, show->schedule, result))
    return;
  if (const auto started = dmd->start (show->plan, session.stop); !started)
    return session.fail (Exit::failed, started.error ());
  run (session, *dmd, duration, result);
}

/** A mask that is shown in all slots: "on", "off", or a number of a mask of the
 * schedule. */
Result<StillMask>
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
    return Error{"cannot show mask " + in_quotes (name) + "; use 0 to " +
                 std::to_string (schedule.slots () - 1) + " for " +
                 schedule.text () + ", or on, or off"};
  return still;
}

void
show (Session &session, const Arguments &arguments)
{
  std::optional<Nanoseconds> duration;
  if (!read_duration (session, arguments, duration))
    return;
  const auto dmd = open (session, arguments.device);
  if (!dmd)
    return;
  const auto wanted = fit (session, arguments, dmd->info ());
  if (!wanted)
    return;
  const auto mask = still_mask (wanted->schedule, arguments.mask);
  if (!mask)
    return session.fail (Exit::usage, mask.error ());
  Json result{{"device", dmd->info ().name}, {"shows", mask->name}};
  if (const auto shown = dmd->show (*mask, wanted->plan, session.stop); !shown)
    return session.fail (Exit::failed, shown.error ());
  run (session, *dmd, duration, result);
}

/** Waits until standard input ends, which means that the process that started
 * the board has ended. */
void
guard (Session &session, const Arguments &arguments)
{
  std::signal (SIGHUP, SIG_IGN); // other signals request a stop
  if (const auto stopped = stand_guard (STDIN_FILENO, arguments.device);
      !stopped)
    session.fail (Exit::failed, stopped.error ());
}

/** Uploads, starts and stops a schedule that uploads fast, and checks the state
 * of the board each time. */
void
selftest (Session &session, Arguments arguments)
{
  const auto dmd = open (session, arguments.device);
  if (!dmd)
    return;
  arguments.schedule = "sequential:4x1";
  if (dmd->info ().minimum_switching > 0)
    arguments.schedule +=
        ",switching=" + time_text (dmd->info ().minimum_switching);
  const auto show = fit (session, arguments, dmd->info ());
  Json result = describe (dmd->info ());
  if (!show || !send (session, *dmd, show->schedule, result))
    return;
  if (const auto started = dmd->start (show->plan, session.stop); !started)
    return session.fail (Exit::failed, started.error ());
  const auto running = dmd->status ();
  dmd->stop ();
  const auto stopped = dmd->status ();
  if (!running || !stopped)
    return session.fail (
        Exit::failed, running ? stopped.error () : running.error ());
  if (!running->running || stopped->running)
    return session.fail (Exit::failed,
        Error{dmd->info ().name + (running->running
                                          ? " did not stop"
                                          : " reports that it does not run")});
  result["selftest"] = "passed";
  session.print (result);
}

} // namespace

void
add_dmd_commands (CLI::App &app, Session &session)
{
  auto *dmd = app.add_subcommand ("dmd", "Control DMD boards");
  dmd->require_subcommand (1);
  const auto arguments = std::make_shared<Arguments> ();
  const auto add = [&] (const char *name, const char *help, auto command) {
    auto *sub = dmd->add_subcommand (name, help);
    sub->callback (
        [&session, arguments, command] { command (session, *arguments); });
    return sub;
  };
  const auto with_device = [&] (CLI::App *sub) {
    sub->add_option ("device", arguments->device,
        "usb:[PORT|SERIAL], lightcrafter:[HOST] or sim:NAME");
    return sub;
  };
  const auto with_schedule = [&] (CLI::App *sub) {
    with_device (sub);
    sub->add_option ("schedule", arguments->schedule,
        "CODE:TILE[,key=value...] or a JSON file");
    sub->add_option (
        "--rate", arguments->rate, "Frame rate of the camera, frames/s");
    return sub;
  };

  add ("list", "List the boards on the USB",
      [] (Session &s, const Arguments &) { list (s); });
  with_device (add ("info", "Show the limits of a board",
      [] (Session &s, const Arguments &a) {
        if (const auto opened = open (s, a.device))
          s.print (describe (opened->info ()));
      }));
  with_device (add ("status", "Show the state of a board", status));
  with_schedule (add ("upload", "Upload the masks of a schedule", upload))
      ->add_flag (
          "--predict", arguments->predict, "Only predict the upload time");
  with_schedule (
      add ("start", "Upload masks and show them until Ctrl-C", start))
      ->add_option (
          "--for", arguments->duration, "Stop after this time, such as 10s");
  auto *shown =
      with_schedule (add ("show", "Show one static mask, for alignment", show));
  shown->add_option ("--mask", arguments->mask,
      "Number of a mask of the schedule, on, or off");
  shown->add_option (
      "--for", arguments->duration, "Stop after this time, such as 10s");
  with_device (add ("stop", "Stop a board", stop));
  with_device (add ("guard", "", guard))->group (""); // StopGuard's other side
  with_device (add ("selftest", "Test upload, start and stop", selftest));
}

} // namespace codedexposure::tool
