/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The setups of a recording whose schedule, mapping or bench profile changes.
 * Its tags have all of them, as GST_TAG_COMMENT "coded-exposure-setup={...}"
 * beside that of the last one, so that a frame in the middle is decoded by its
 * own. */
#pragma once

#include <vector>

#include <gst/gst.h>

#include "setup/stream_setup.h"

namespace codedexposure::gst
{

/** The TAG event @p event with all @p setups but the last, in their order, if
 * they are not too many; Transfer: full, of both. */
GstEvent *add_setups (GstEvent *event, const std::vector<StreamSetup> &setups);

/** Those in @p tags that can be read. */
std::vector<StreamSetup> setups_from_tags (const GstTagList *tags);

} // namespace codedexposure::gst
