/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Without Aravis, there is no emulated camera, and none to examine a bench. */
#include "command.h"
#include "pipeline/cameras.h"

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

/* Nothing is known of cameras here. */
std::vector<std::string>
camera_names ()
{
  return {};
}

std::string
cameras_found ()
{
  return "this version was built without Aravis, and sees no camera";
}

std::optional<double>
camera_exposure (GstElement *)
{
  return std::nullopt;
}

} // namespace codedexposure::app
