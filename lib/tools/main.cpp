/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure: DMDs and schedules from the command line. */
#include <signal.h>

#include <cmath>
#include <cstdio>
#include <numeric>
#include <thread>

#include <CLI/CLI.hpp>

#include "base/file.h"
#include "base/text.h"
#include "bench/simulated_dmd.h"
#include "tools/tool.h"

namespace codedexposure::tool
{

void
Session::print (const Json &object) const
{
  if (json) {
    std::printf ("%s\n", object.dump (2).c_str ());
    return;
  }
  for (const Json &entry : object.is_array () ? object : Json{object})
    for (const auto &[name, value] : entry.items ())
      std::printf ("%-18s %s\n", name.c_str (),
          (value.is_string () ? value.get<std::string> () : value.dump ())
              .c_str ());
}

void
Session::say (const std::string &line) const
{
  if (!quiet)
    std::fprintf (stderr, "%s\n", line.c_str ());
}

FrameRate
parse_rate (const std::string &text)
{
  const auto parts = split (text, '/');
  constexpr int kPerSecond = 1000;
  FrameRate rate{0, 0};
  if (parts.size () == 2) {
    const auto num = parse_int (parts[0]), den = parse_int (parts[1]);
    rate = {num.value_or (0), den.value_or (0)};
  } else if (const auto real = parse_real (text);
             real && *real > 0 && *real < 1e6) {
    const int num = int (std::lround (*real * kPerSecond));
    const int common = std::gcd (num, kPerSecond);
    rate = {num / common, kPerSecond / common};
  }
  if (rate.num > 0 && rate.den > 0)
    return rate;
  throw Failure{Exit::usage,
      Error{"cannot use " + in_quotes (text) +
            " as a frame rate; use a number or a fraction, such as 25 or "
            "30000/1001"}};
}

DmdInfo
find_board (const std::string &name)
{
  const DmdInfo boards[] = {
      {.name = "dlp3000",
          .size = {608, 684},
          .minimum_active = 250'000,
          .minimum_switching = 250'000,
          .resident_masks = 96,
          .array = Array::diamond},
      {.name = "dlp4500",
          .size = {912, 1140},
          .minimum_active = 235'000,
          .resident_masks = 48,
          .array = Array::diamond},
      {.name = "dlp6500",
          .size = {1920, 1080},
          .minimum_active = 105'000,
          .resident_masks = 400},
      {.name = "dlp9000",
          .size = {2560, 1600},
          .minimum_active = 105'000,
          .resident_masks = 400},
  };
  for (const DmdInfo &board : boards)
    if (name == board.name)
      return board;
  throw Failure{
      Exit::usage, Error{"unknown DMD " + in_quotes (name) +
                         "; use dlp3000, dlp4500, dlp6500 or dlp9000"}};
}

Show
fit (const Session &session, const DmdInfo &info)
{
  const FrameRate rate = parse_rate (session.rate);
  Schedule schedule =
      value_of (Schedule::parse (session.schedule), Exit::usage);
  const SlotPlan plan =
      value_of (SlotPlan::fit (schedule.timing (), schedule.slots (), rate),
          Exit::does_not_fit);
  value_of (check_limits (info, schedule, plan), Exit::does_not_fit);
  return {std::move (schedule), plan};
}

Option
schedule_argument (Session &session)
{
  return {
      "schedule", &session.schedule, "CODE:TILE[,key=value...] or a JSON file"};
}

Option
rate_option (Session &session)
{
  return {"--rate", &session.rate, "Frame rate of the camera, frames/s"};
}

Option
board_option (Session &session)
{
  return {"--dmd", &session.board, "DMD: dlp3000, dlp4500, dlp6500 or dlp9000"};
}

namespace
{

/** Requests a stop at SIGINT and SIGTERM. A thread waits for the signals,
 * because a signal handler could do almost nothing. */
class Interruption
{
public:
  std::stop_token token () const { return source_.get_token (); }

private:
  /* Before any thread starts, as threads inherit it. */
  static sigset_t block_signals ()
  {
    sigset_t signals;
    sigemptyset (&signals);
    sigaddset (&signals, SIGINT);
    sigaddset (&signals, SIGTERM);
    pthread_sigmask (SIG_BLOCK, &signals, nullptr);
    return signals;
  }

  void watch (const std::stop_token &quit)
  {
    constexpr timespec kPatience{0, 50'000'000};
    while (!quit.stop_requested ())
      if (sigtimedwait (&signals_, nullptr, &kPatience) > 0)
        source_.request_stop ();
  }

  const sigset_t signals_ = block_signals ();
  std::stop_source source_;
  std::jthread thread_{[this] (const std::stop_token &quit) { watch (quit); }};
};

void
report (Session &session, const Failure &failure)
{
  const std::string &message = failure.error.message;
  session.exit =
      session.stop.stop_requested () ? Exit::interrupted : failure.exit;
  if (session.json)
    std::printf ("%s\n", Json{{"error", message}}.dump (2).c_str ());
  std::fprintf (stderr, "codedexposure: %s\n", message.c_str ());
}

void
add (CLI::App &app, const Option &option)
{
  const auto add_typed = [&] (auto *value) {
    if constexpr (std::is_same_v<decltype (value), bool *>)
      app.add_flag (option.name, *value, option.help);
    else if constexpr (std::is_same_v<decltype (value),
                           std::vector<std::string> *>)
      app.add_option (option.name, *value, option.help);
    else
      app.add_option (option.name, *value, option.help)
          ->capture_default_str ()
          ->each ([given = option.given] (const std::string &) {
            if (given)
              *given = true;
          });
  };
  std::visit (add_typed, option.value);
}

void
add (CLI::App &app, const Command &command)
{
  CLI::App *sub = app.add_subcommand (command.name, command.help);
  if (command.help.empty ())
    sub->group ("");
  for (const Option &option : command.options)
    add (*sub, option);
  for (const Command &next : command.commands)
    add (*sub, next);
  if (command.commands.empty ())
    sub->callback (command.run);
  else
    sub->require_subcommand (1);
}

constexpr const char *kExamples = R"(Examples:
  Whether a board can show a schedule at a frame rate:
    codedexposure schedule check sequential:16x16 --dmd dlp6500 --rate 25
  The best schedule for a fast scene with little light:
    codedexposure advise --speed 400 --light 0.3 --dmd dlp3000
  A test of a board, here of the simulated one:
    codedexposure dmd selftest sim:bench)";

int
run (int argc, char **argv)
{
  const Interruption interruption;
  Session session;
  session.stop = interruption.token ();
  serve_simulated_dmds ();

  CLI::App app ("Controls digital micromirror devices (DMDs) and checks "
                "schedules.\nSee codedexposure(1).");
  app.footer (kExamples);
  app.require_subcommand (1);
  app.fallthrough ();
  app.set_version_flag ("--version", "codedexposure " VERSION);
  app.add_flag ("--json", session.json, "Print results as JSON");
  app.add_flag ("--quiet", session.quiet, "Do not print progress");
  add (app, advise_command (session));
  add (app, bench_commands (session));
  add (app, dmd_commands (session));
  add (app, schedule_commands (session));
  try {
    app.parse (argc, argv);
  } catch (const Failure &failure) {
    report (session, failure);
  } catch (const CLI::RequiredError &error) {
    /* Most often, the subcommand is misspelt. */
    const auto words = app.remaining (true);
    if (words.empty ())
      app.exit (error);
    else
      std::fprintf (stderr,
          "codedexposure: unknown subcommand or option %s\n"
          "Run with --help for more information.\n",
          in_quotes (words.front ()).c_str ());
    return int (Exit::usage);
  } catch (const CLI::ParseError &error) {
    return app.exit (error) == 0 ? 0 : int (Exit::usage);
  }
  return int (session.exit);
}

} // namespace

} // namespace codedexposure::tool

int
main (int argc, char **argv)
{
  int code = codedexposure::tool::run (argc, argv);
  if (const auto written = codedexposure::finish_output (); !written) {
    std::fprintf (
        stderr, "codedexposure: %s\n", written.error ().message.c_str ());
    code = int (codedexposure::tool::Exit::failed);
  }
  return code;
}
