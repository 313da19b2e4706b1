/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure: DMDs and schedules from the command line. */
#include <signal.h>

#include <cmath>
#include <cstdio>
#include <numeric>
#include <thread>

#include "base/text.h"
#include "bench/simulated_dmd.h"
#include "tools/tool.h"

namespace codedexposure::tool
{

void
Session::fail (Exit code, const Error &error)
{
  exit = stop.stop_requested () ? Exit::interrupted : code;
  if (json)
    std::printf ("%s\n",
        nlohmann::ordered_json{{"error", error.message}}.dump (2).c_str ());
  std::fprintf (stderr, "codedexposure: %s\n", error.message.c_str ());
}

void
Session::print (const nlohmann::ordered_json &object) const
{
  if (json) {
    std::printf ("%s\n", object.dump (2).c_str ());
    return;
  }
  const auto text = [] (const nlohmann::ordered_json &value) {
    return value.is_string () ? value.get<std::string> () : value.dump ();
  };
  const auto lines =
      object.is_array () ? object : nlohmann::ordered_json{object};
  for (const auto &entry : lines)
    for (const auto &[name, value] : entry.items ())
      std::printf ("%-18s %s\n", name.c_str (), text (value).c_str ());
}

void
Session::say (const std::string &line) const
{
  if (!quiet)
    std::fprintf (stderr, "%s\n", line.c_str ());
}

Result<FrameRate>
parse_rate (const std::string &text)
{
  const auto parts = split (text, '/');
  constexpr int kPerSecond = 1000;
  FrameRate rate;
  if (parts.size () == 2) {
    const auto num = parse_int (parts[0]), den = parse_int (parts[1]);
    rate = {num.value_or (0), den.value_or (0)};
  } else if (const auto real = parse_real (text);
             real && parts.size () == 1 && *real > 0 && *real < 1e6) {
    const int num = int (std::lround (*real * kPerSecond));
    const int common = std::gcd (num, kPerSecond);
    rate = {num / common, kPerSecond / common};
  } else {
    rate = {0, 0};
  }
  if (rate.num > 0 && rate.den > 0)
    return rate;
  return Error{"cannot use " + in_quotes (text) +
               " as a frame rate; use a number or a fraction, such as 25 or "
               "30000/1001"};
}

namespace
{

/** Requests a stop at SIGINT and SIGTERM. A thread waits for the signals,
 * because a signal handler could do almost nothing. */
class Interruption
{
public:
  Interruption ()
  {
    sigemptyset (&signals_);
    sigaddset (&signals_, SIGINT);
    sigaddset (&signals_, SIGTERM);
    pthread_sigmask (SIG_BLOCK, &signals_, nullptr);
    thread_ = std::jthread ([this] (std::stop_token quit) {
      constexpr timespec kPatience{0, 50'000'000};
      while (!quit.stop_requested ())
        if (sigtimedwait (&signals_, nullptr, &kPatience) > 0)
          source_.request_stop ();
    });
  }

  std::stop_token token () const { return source_.get_token (); }

private:
  sigset_t signals_;
  std::stop_source source_;
  std::jthread thread_; // last: it uses all of the above
};

int
run (int argc, char **argv)
{
  const Interruption interruption;
  Session session;
  session.stop = interruption.token ();
  serve_simulated_dmds ();

  CLI::App app ("Controls digital micromirror devices (DMDs) and checks "
                "schedules.\nSee codedexposure(1).");
  app.require_subcommand (1);
  app.fallthrough ();
  app.set_version_flag ("--version", "codedexposure " VERSION);
  app.add_flag ("--json", session.json, "Print results as JSON");
  app.add_flag ("--quiet", session.quiet, "Do not print progress");
  add_advise_command (app, session);
  add_dmd_commands (app, session);
  add_schedule_commands (app, session);
  try {
    app.parse (argc, argv);
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
    const int code = app.exit (error);
    return code == 0 ? 0 : int (Exit::usage);
  }
  return int (session.exit);
}

} // namespace

} // namespace codedexposure::tool

int
main (int argc, char **argv)
{
  return codedexposure::tool::run (argc, argv);
}
