/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How many frames later than its exposure a mask is seen. */
#pragma once

#include "doctor/checks.h"

namespace codedexposure
{

/**
 * Changes the mask again and again, and sets Examination::lag. False if the
 * light tells nothing, which @p finding then says; a lag that is not 0 or not
 * always the same is blamed there, too.
 *
 * @p last: stamp of the last frame that came.
 */
Result<bool> check_lag (
    Examination &examination, Nanoseconds last, Finding &finding);

} // namespace codedexposure
