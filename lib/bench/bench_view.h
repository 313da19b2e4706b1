/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How the camera of a bench looks at its mirrors. */
#pragma once

#include "base/image.h"
#include "bench/sick_options.h"
#include "mapping/mapping.h"

namespace codedexposure
{

/** The middle of an array, which lies between mirrors if their number is even.
 */
inline Position
centre_of (Extent size)
{
  return {0.5 * (size.width - 1), 0.5 * (size.height - 1)};
}

/** Camera pixel to mirror: orientation, then alignment, about the centres of
 * camera and array. Fails where a number is out of its range. */
Result<Mapping> mapping_of (const SickBenchOptions &options);

/** Adds the blur of a focus that is tilted to what the camera sees. */
void blur_with_tilt (const SickBenchOptions &options, Image<float> &seen);

} // namespace codedexposure
