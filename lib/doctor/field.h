/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How light falls off over a picture; for this folder only. */
#pragma once

#include "base/image.h"
#include "setup/bench_profile.h"

namespace codedexposure
{

/**
 * Light that the darkest corner loses against the centre of @p picture, as a
 * part; negative if it is the brighter one. It is that of a smooth surface:
 * dust, odd pixels and a part that sees no mirror do not count. NaN if too few
 * pixels see mirrors.
 *
 * @p picture  of all mirrors on, less that of all mirrors off
 */
Measured corner_loss (ImageView<const float> picture);

/** @p image without what is smaller than some ten pixels, such as defects: the
 * medians of blocks, bilinear between their centres and beyond them. */
Image<float> smooth (const Image<float> &image);

} // namespace codedexposure
