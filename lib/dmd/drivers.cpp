/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/drivers.h"

#include "dmd/simulated_dmd.h"
#include "dmd/usb_bus.h"

namespace codedexposure
{

std::vector<DmdScheme>
dmd_schemes ()
{
  return {kSimulatedDmds,
      {"usb:", "usb:[PORT|SERIAL] (a LightCrafter 4500, 6500 or 9000)",
          open_usb_dmd},
      {"lightcrafter:",
          "lightcrafter:[ADDRESS[:PORT]] (the first LightCrafter, over TCP)",
          open_lightcrafter}};
}

} // namespace codedexposure
