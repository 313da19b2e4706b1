/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "board.h"

#include <signal.h>

#include <cstdio>
#include <thread>

#include "base/text.h"
#include "dmd/boards.h"
#include "failure.h"
#include "options/common.h"
#include "pipeline/signals.h"

namespace codedexposure::app
{

void
Printing::declare (Options &options)
{
  options.heading ("");
  options.flag ("--json", json, "print results as JSON");
  options.flag ("--quiet", quiet, "do not print progress");
}

void
Printing::print (const Json &object) const
{
  if (json) {
    print_json (object, 2);
    return;
  }
  for (const Json &entry : object.is_array () ? object : Json{object})
    for (const auto &[name, value] : entry.items ())
      std::printf ("%-18s %s\n", name.c_str (),
          (value.is_string () ? value.get<std::string> () : value.dump ())
              .c_str ());
}

void
Printing::say (const std::string &line) const
{
  if (!quiet)
    std::fprintf (stderr, "%s\n", line.c_str ());
}

Rule<Nanoseconds>
time_rule (const std::string &such)
{
  return {[] (const std::string &text) {
            const auto time = parse_time (text);
            return time ? std::optional (*time) : std::nullopt;
          },
      "a time such as " + such};
}

void
BoardOptions::declare_rate (Options &options)
{
  options.value ("--rate", rate, "R", "frame rate of the camera, frames/s [25]",
      frame_rate_rule ());
}

void
BoardOptions::declare_board (Options &options)
{
  options.value ("--dmd", board, "NAME",
      "board: " + board_names () + ", with the options of its driver [dlp6500]",
      any_text ());
}

Schedule
BoardOptions::parsed () const
{
  return value_of (Schedule::parse (schedule), Exit::usage);
}

DmdInfo
BoardOptions::info () const
{
  return value_of (parse_board (board), Exit::usage).info;
}

Show
fit (const BoardOptions &options, const DmdInfo &info)
{
  Schedule schedule = options.parsed ();
  const SlotPlan plan = value_of (
      SlotPlan::fit (schedule.timing (), schedule.slots (), options.rate),
      Exit::does_not_fit);
  value_of (check_limits (info, schedule, plan), Exit::does_not_fit);
  return {std::move (schedule), plan};
}

/* A thread waits for the signals, because a signal handler could do almost
 * nothing. */
std::stop_token
stop_at_signals ()
{
  static sigset_t signals;
  sigemptyset (&signals);
  for (const int number : ending_signals ())
    sigaddset (&signals, number);
  pthread_sigmask (SIG_BLOCK, &signals, nullptr);
  static std::stop_source source;
  static const std::jthread thread ([] (const std::stop_token &quit) {
    constexpr timespec kPatience{0, 50'000'000};
    while (!quit.stop_requested ())
      if (sigtimedwait (&signals, nullptr, &kPatience) > 0)
        source.request_stop ();
  });
  return source.get_token ();
}

} // namespace codedexposure::app
