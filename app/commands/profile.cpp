/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure profile: shows bench profiles. */
#include "command.h"
#include "options/board.h"
#include "setup/bench_profile.h"

namespace codedexposure::app
{

namespace
{

struct Arguments : Printing {
  std::string path = "bench.json";
};

Exit
show (const Arguments &arguments)
{
  const BenchProfile profile =
      value_of (BenchProfile::parse (arguments.path), Exit::usage);
  Json lines = Json::object ();
  if (arguments.json)
    lines = Json::parse (profile.to_json ());
  else
    for (const auto &[name, text] : profile.rows ())
      lines[name] = text;
  arguments.print (lines);
  return Exit::done;
}

} // namespace

Command
profile_command ()
{
  return make_group<Arguments> (
      {.name = "profile",
          .summary = "show bench profiles",
          .usage = "COMMAND [option...]",
          .description = "Bench profiles are what was measured of a bench.\n"},
      {{{.name = "show",
            .summary = "check a bench profile and show what it says",
            .usage = "[option...] [FILE.json]",
            .description = R"(
Checks the bench profile FILE.json [bench.json], as "codedexposure doctor"
writes it, and shows what it says; with --json, its JSON form.
)"},
          [] (Options &options, Arguments &a) {
            options.word ("FILE.json", a.path, true);
            a.declare (options);
          },
          show}});
}

} // namespace codedexposure::app
