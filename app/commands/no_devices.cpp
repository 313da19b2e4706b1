/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Without Aravis, there is no emulated camera, and none to examine a bench. */
#include "command.h"

namespace codedexposure::app
{

Command
bench_command ()
{
  return {};
}

Command
doctor_command ()
{
  return {};
}

Command
camera_command ()
{
  return {};
}

} // namespace codedexposure::app
