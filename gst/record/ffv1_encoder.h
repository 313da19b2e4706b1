/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The encoder of recordings. */
#pragma once

#include <gst/gst.h>

namespace codedexposure::gst
{

/** avenc_ffv1, all of whose frames can be decoded alone, and whose bytes do not
 * depend on @p threads (0: one for each processor). Null: it is not installed.
 */
GstElement *make_ffv1_encoder (guint threads);

/** Whether frames with these caps come out again: FFmpeg 5.1 loses the pixels
 * of frames of one row or column. */
bool ffv1_keeps (const GstCaps *caps);

} // namespace codedexposure::gst
