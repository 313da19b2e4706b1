/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Without Aravis, there is no emulated camera, and none to examine a bench. */
#include "command.h"

namespace codedexposure::app
{

std::unique_ptr<Command>
bench_command ()
{
  return nullptr;
}

std::unique_ptr<Command>
doctor_command ()
{
  return nullptr;
}

std::unique_ptr<Command>
camera_command ()
{
  return nullptr;
}

} // namespace codedexposure::app
