/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What a program says of cameras that was built without Aravis. */
#include "pipeline/cameras.h"

namespace codedexposure::app
{

std::string
cameras_found ()
{
  return "this version was built without Aravis, and sees no camera";
}

Result<std::string>
change_gain (GstElement *, int)
{
  return Error{cameras_found ()};
}

Result<std::string>
change_exposure (GstElement *, int, Between)
{
  return Error{cameras_found ()};
}

} // namespace codedexposure::app
