/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The first LightCrafter (DLP3000), over TCP. */
#pragma once

#include <memory>
#include <string_view>

#include "dmd/dmd.h"

namespace codedexposure
{

/**
 * Opens "lightcrafter:[HOST[:PORT]][,key=value...]", see options.h; the
 * defaults are 192.168.1.100 and port 21845.
 *
 * Its sequences have no frames: with the DMD as master, its trigger output
 * pulses once per mask, and the camera must divide by the number of slots; with
 * the camera as master, it needs one edge per slot.
 */
Result<std::unique_ptr<Dmd>> open_lightcrafter (std::string_view device);

} // namespace codedexposure
