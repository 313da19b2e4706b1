/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The buffer pool of subframes if downstream offers none. */
#pragma once

#include <gst/gst.h>

namespace codedexposure::gst
{

/**
 * A pool of grey pictures. Transfer: full.
 *
 * Its buffers start at different offsets in a memory page, because all
 * subframes of a coded frame are written at once (plane_stagger ()). Each
 * buffer always has the meta CodedExposureFrame; set it after a buffer is
 * acquired.
 */
GstBufferPool *make_picture_pool ();

} // namespace codedexposure::gst
