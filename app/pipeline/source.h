/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The beginning of a pipeline: what gives coded frames. */
#pragma once

#include "options/source.h"
#include "pipeline/job.h"

namespace codedexposure::app
{

enum class Pace {
  live, ///< frames come in real time and wait for nobody
  fast, ///< as fast as they can be made
};

/** Of the frames of @p plan, at that rate. */
std::string grey_caps (const SourcePlan &plan, FrameRate rate);

/** The scene and the simulated bench, whose masks come from the schedule. */
Chain simulation (Job &job, const SourceOptions &options,
    const SourcePlan &plan, Pace pace, const Settings &more = {});

/** The frames of a camera, without their schedule. */
Chain camera_source (
    Job &job, const SourceOptions &options, const SourcePlan &plan);

/** Coded frames of a camera, of any source, or of the simulated bench with its
 * DMD; then dmdsync, and the end after --frames. */
Chain coded_source (
    Job &job, const SourceOptions &options, const SourcePlan &plan, Pace pace);

/** Coded frames of both cameras: as coded_source (), and those of the second
 * behind a dmdsync of its own. */
std::pair<Chain, Chain> coded_sources (Job &job, const SourceOptions &options,
    const SourcePlan &plan, Pace pace, const SecondCamera &second);

/** Pairs of both cameras. @p patience  for a frame of the second camera that is
 * late; 0: a quarter of a frame period. */
Chain coded_pairs (Job &job, const SourceOptions &options,
    const SourcePlan &plan, Pace pace, const SecondCamera &second,
    Nanoseconds patience = 0);

/** Ends the stream after --frames, if set. */
void limit_frames (Job &job, const SourceOptions &options, Chain &chain);

/** Whether the frames of these options come in real time; those of a user's
 * source may be a file. */
inline bool
is_live (const SourceOptions &options, Pace pace)
{
  return pace == Pace::live && !options.source;
}

} // namespace codedexposure::app
