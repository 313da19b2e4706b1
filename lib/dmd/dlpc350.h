/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Boards with the DLPC350 controller: LightCrafter 4500. */
#pragma once

#include <memory>

#include "dmd/dmd.h"
#include "dmd/dmd_options.h"
#include "dmd/hid_link.h"

namespace codedexposure
{

/**
 * Opens the board behind @p link. It goes on with what it does until the first
 * upload (); from then on the destructor stops it.
 *
 * The board takes no masks over USB. Its user puts the images that
 * "codedexposure schedule render --planes" writes into its flash, or shows
 * them over HDMI, and says where they are (images=, source=): upload () then
 * only sets up the table of patterns, and is an error otherwise.
 */
Result<std::unique_ptr<Dmd>> open_dlpc350 (
    std::unique_ptr<HidLink> link, const DmdOptions &options);

} // namespace codedexposure
