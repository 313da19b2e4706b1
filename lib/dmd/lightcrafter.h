/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The first LightCrafter (DLP3000), over TCP. */
#pragma once

#include <memory>
#include <string_view>

#include "dmd/dmd.h"

namespace codedexposure
{

/**
 * Opens "lightcrafter:[HOST[:PORT]][,key=value...]", see dmd_options.h; the
 * board is at 192.168.1.100, port 21845, unless something else is said.
 *
 * Its sequences know no frames: with the DMD as master, its trigger output
 * pulses once a mask, and the camera must divide by the number of slots; with
 * the camera as master, it wants one edge a slot.
 */
Result<std::unique_ptr<Dmd>> open_lightcrafter (std::string_view device);

} // namespace codedexposure
