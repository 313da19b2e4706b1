/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-schedule: says what a schedule is, for people and scripts. */
#include <cstdio>
#include <string_view>

#include "schedule/schedule.h"

namespace
{

constexpr char kUsage[] =
    "usage: codedexposure-schedule [--slots] SCHEDULE\n"
    "Prints the schedule as JSON, ready to be edited and named in its place;\n"
    "with --slots only the number of slots of an exposure.\n"
    "SCHEDULE  CODE:TILE[,key=value...] or the path of a JSON file\n";

} // namespace

int
main (int argc, char **argv)
{
  const bool slots = argc == 3 && std::string_view (argv[1]) == "--slots";
  if (argc != 2 && !slots) {
    std::fputs (kUsage, stderr);
    return 2;
  }
  const std::string_view text (argv[argc - 1]);
  if (text == "-h" || text == "--help") {
    std::fputs (kUsage, stdout);
    return 0;
  }
  const auto schedule = cexp::Schedule::parse (text);
  if (!schedule) {
    std::fprintf (stderr, "codedexposure-schedule: %s\n",
        schedule.error ().message.c_str ());
    return 2;
  }
  if (slots)
    std::printf ("%d\n", schedule->slots ());
  else
    std::printf ("%s\n", schedule->to_json ().c_str ());
  return 0;
}
