/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The end of a pipeline that writes coded frames, and the beginning of one that
 * reads them. */
#pragma once

#include "options/source.h"
#include "pipeline/job.h"
#include "record/track.h"

namespace codedexposure::app
{

/** How coded frames are recorded. */
struct RecordingStyle {
  std::string codec = "ffv1"; ///< or "raw"
  std::optional<int> threads; ///< of ffv1; none: one for each processor
  /** Frames come in real time: when encoder or disk is too slow, the oldest
   * that wait are dropped, and the next one that is written tells how many. */
  bool live = false;
  FrameRate rate{25, 1};   ///< of the frames
  std::uint64_t bytes = 0; ///< of a raw recording, to be reserved; 0: not known
};

/** Writes the coded frames of @p chain to the recording @p file, and what is
 * known of each also to FILE.jsonl. */
void write_recording (Job &job, Chain &chain, const std::string &file,
    const RecordingStyle &style);

/** The coded frames of the recording @p file, with all that is known of them.
 */
Chain read_recording (Job &job, const std::string &file);
/** The same of a sender, over TCP. */
Chain read_sender (Job &job, const std::string &host, int port);

/** What to do with @p file, of which only all can be read, from front to back:
 * damage between its frames hides where a part of it is. */
std::string no_part_text (const std::string &file);

} // namespace codedexposure::app
