/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The commands of a build of what the demo needs. */
#include "base/text.h"
#include "command.h"

namespace codedexposure::app
{

std::vector<Command>
all_commands ()
{
  return {simulate_command (), live_command (), record_command (),
      decode_command (), play_command ()};
}

std::string
no_command (const std::string &name)
{
  return "there is no command " + in_quotes (name) +
         " in this build, which has only those of the demo; for all, run "
         "\"meson configure build -Dparts=all\" and \"meson compile -C build\"";
}

} // namespace codedexposure::app
