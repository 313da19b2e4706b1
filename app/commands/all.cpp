/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "base/text.h"
#include "command.h"

namespace codedexposure::app
{

std::vector<Command>
all_commands ()
{
  std::vector<Command> commands;
  for (const auto make :
      {simulate_command, live_command, record_command, decode_command,
          play_command, info_command, calibrate_command, pack_command,
          send_command, receive_command, archive_command, join_command,
          report_command, schedule_command, advise_command, camera_command,
          dmd_command, profile_command, doctor_command, bench_command})
    if (Command command = make (); !command.text.name.empty ())
      commands.push_back (std::move (command));
  return commands;
}

std::string
no_command (const std::string &name)
{
  return "there is no command " + in_quotes (name);
}

} // namespace codedexposure::app
