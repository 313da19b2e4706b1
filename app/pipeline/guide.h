/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include "pipeline/job.h"

namespace codedexposure::app
{

/** Plays a pipeline with the moirecalib element @p calib, and prints how to
 * move the stage, the progress and the result. @p stage  a simulated bench
 * whose stage is moved; null: a person moves it. */
Exit guide (Job &job, GstElement *calib, GstElement *stage);

} // namespace codedexposure::app
