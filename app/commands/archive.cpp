/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure archive: decodes archives of recordings on a batch engine,
 * which the Python package drives. */
#include "command.h"
#include "pipeline/program.h"

namespace codedexposure::app
{

Command
archive_command ()
{
  return {.text = {.name = "archive",
              .summary = "decode many recordings on many cores or computers",
              .usage = "",
              .description = ""},
      .declare = [] (Options &) {},
      .run = [] { return Exit::usage; },
      .run_with = become_archive};
}

} // namespace codedexposure::app
