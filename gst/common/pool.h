/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Where subframes lie when nobody downstream has a place for them. */
#pragma once

#include <gst/gst.h>

namespace codedexposure::gst
{

/**
 * A pool of grey pictures. Transfer: full.
 *
 * Its buffers start at different places of a page, since all subframes of a
 * coded frame are written at once (plane_stagger ()). Each bears the meta
 * CodedExposureFrame for as long as it lives: whoever takes one sets it.
 */
GstBufferPool *make_picture_pool ();

} // namespace codedexposure::gst
