/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* In a build of what the demo needs: boards have names, but no drivers. */
#include "dmd/drivers.h"

#include "dmd/simulated_dmd.h"

namespace codedexposure
{

namespace
{

Result<std::unique_ptr<Dmd>>
refuse (std::string_view device)
{
  return Error{"this build has no driver for the DMD '" + std::string (device) +
                   "'; run \"meson configure build -Dparts=all\" and "
                   "\"meson compile -C build\"",
      ErrorCode::unsupported};
}

} // namespace

std::vector<DmdScheme>
dmd_schemes ()
{
  return {kSimulatedDmds,
      {"usb:", "usb:[PORT|SERIAL] (not in this build)", refuse},
      {"lightcrafter:", "lightcrafter:[ADDRESS[:PORT]] (not in this build)",
          refuse}};
}

} // namespace codedexposure
