/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The drivers of the boards. */
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "dmd/dmd.h"
#include "dmd/hid_link.h"
#include "dmd/options.h"

namespace codedexposure
{

/** The devices that can be opened, by their names. */
std::vector<DmdScheme> dmd_schemes ();

/**
 * Opens the LightCrafter 4500 behind @p link. The board continues with what it
 * does until the first upload (); from then on, the destructor stops it.
 *
 * The board takes no masks over USB. The user writes the images that
 * "codedexposure schedule render --planes" makes into its flash, or shows them
 * over HDMI, and names them (images=, source=): upload () then only sets up the
 * table of patterns, and fails otherwise.
 */
Result<std::unique_ptr<Dmd>> open_dlpc350 (
    std::unique_ptr<HidLink> link, const DmdOptions &options);

/**
 * The same for the LightCrafter 6500 or 9000, which takes masks as planes of
 * 24-bit images. The driver knows by digest which masks the board holds: images
 * on the board are not sent again, and a schedule with the same masks in
 * another order only moves lines of the pattern table.
 */
Result<std::unique_ptr<Dmd>> open_dlpc900 (
    std::unique_ptr<HidLink> link, const DmdOptions &options);

/**
 * Opens "lightcrafter:[ADDRESS[:PORT]][,key=value...]", see options.h; the
 * defaults are 192.168.1.100 and port 21845.
 *
 * Its sequences have no frames: with the DMD as master, its trigger output
 * pulses once per mask, and the camera must divide by the number of slots; with
 * the camera as master, it needs one edge per slot.
 */
Result<std::unique_ptr<Dmd>> open_lightcrafter (std::string_view device);

} // namespace codedexposure
