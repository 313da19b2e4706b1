/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Coded frames in memory, and the recording that is made of them. */
#pragma once

#include <cstdint>
#include <deque>
#include <string>

#include "base/result.h"
#include "common/raii.h"

namespace codedexposure::gst
{

/** The last frames of a stream, of one format and setup. */
struct KeptFrames {
  CapsPtr caps;
  EventPtr tag; ///< of the setup; null: there was none
  std::deque<BufferPtr> buffers;
  std::uint64_t bytes = 0;

  /** From the first frame to the last, also where time goes back. */
  GstClockTime length () const;
  /** Forgets the oldest frames until it is as short and small as that. */
  void limit (GstClockTime longest, std::uint64_t most_bytes);
  void clear ();
  /** References to all of it, in the order of their times. */
  KeptFrames copy () const;
};

/**
 * Writes @p frames, one at least, as a recording, BEGIN-frameN.mkv, and its
 * JSON lines beside it. N is the number of the first frame, 0 if it has none;
 * where a file of that name is there, -2 and so on follow. Files get their
 * names when they are finished; a run that is killed leaves NAME.part. Waits
 * for the disk.
 *
 * Returns the name.
 */
Result<std::string> write_kept (KeptFrames frames, const std::string &begin);

} // namespace codedexposure::gst
