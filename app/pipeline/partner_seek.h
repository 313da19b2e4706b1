/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Seeks in two recordings of the same exposures. */
#pragma once

#include <gst/gst.h>

namespace codedexposure::app
{

/** Positions count from the first frame of each recording, and one may begin
 * before the other. Turns each seek that comes to the source pad of @p partners
 * to the frames that were exposed when those of the pad @p coded were.
 *
 * Where frames do not say when they were exposed, both recordings begin with
 * the same exposure, and seeks go on as they are. */
void turn_seeks (GstElement *partners, GstPad *coded);

} // namespace codedexposure::app
