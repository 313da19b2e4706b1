/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure bench: shows bench profiles. */
#include <memory>

#include "setup/bench_profile.h"
#include "tools/tool.h"

namespace codedexposure::tool
{

namespace
{

void
show (const Session &session, const std::string &path)
{
  const BenchProfile profile =
      value_of (BenchProfile::parse (path), Exit::usage);
  if (session.json)
    return session.print (Json::parse (profile.to_json ()));
  Json lines = Json::object ();
  for (const auto &[name, text] : profile.rows ())
    lines[name] = text;
  session.print (lines);
}

} // namespace

Command
bench_commands (Session &session)
{
  const auto path = std::make_shared<std::string> ("bench.json");
  const Command shown = {.name = "show",
      .help = "Check a bench profile and show what it says",
      .options = {{"profile", path.get (), "A JSON file"}},
      .run = [&session, path] { show (session, *path); }};
  return {.name = "bench", .help = "Show bench profiles", .commands = {shown}};
}

} // namespace codedexposure::tool
