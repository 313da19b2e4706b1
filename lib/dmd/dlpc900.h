/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Boards with the DLPC900 controller: LightCrafter 6500 and 9000. */
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
 * Masks are sent as planes of 24-bit images. What the board holds is known by
 * digest: images that it has are not sent again, and a schedule that has the
 * same masks in another order only moves lines of the pattern table.
 */
Result<std::unique_ptr<Dmd>> open_dlpc900 (
    std::unique_ptr<HidLink> link, const DmdOptions &options);

} // namespace codedexposure
