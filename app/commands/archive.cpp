/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure archive: decodes archives of recordings on a batch engine,
 * which the Python package drives. */
#include "command.h"
#include "pipeline/python.h"

namespace codedexposure::app
{

namespace
{

class Archive : public Command
{
public:
  CommandText text () const override
  {
    return {.name = "archive",
        .summary = "decode many recordings on many cores or computers",
        .usage = "",
        .description = ""};
  }
  void declare (Options &) override {}
  Exit run () override { return Exit::usage; }
  bool parses_itself () const override { return true; }
  void run_with (const std::vector<std::string> &words) override
  {
    become_archive (words);
  }
};

} // namespace

std::unique_ptr<Command>
archive_command ()
{
  return make_command<Archive> ();
}

} // namespace codedexposure::app
