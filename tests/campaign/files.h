/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Recordings of the bench. */
#pragma once

#include <set>
#include <string>

#include "play.h"

namespace codedexposure::campaign
{

std::string read_file (const std::string &path);
void write_file (const std::string &path, const std::string &bytes);

struct Recording {
  std::string bytes;
  std::int64_t slots = 0; ///< exposed
  Reading reading = Reading::exact;
  /** Wrong by a slip, and recorded as not known to be synchronised. */
  std::set<std::int64_t> unjudged = {};
};

/** What follows dmdsync to record to @p path, and to show it as "out". */
std::string record_tail (const std::string &path);
/** A schedule that no element would assume; decoded by solving its code. */
inline constexpr const char *kStaircase = "staircase:2x2,pilot=8";
/** Records @p frames frames with a slip in the middle; frame @p lost never
 * comes. */
Recording record (const std::string &path, int frames, int lost,
    const std::string &schedule = "sequential:2x2,pilot=8");

/** How a recording is read. */
struct Reader {
  bool push_mode = false; ///< as a stream, without seeking
  double rate = 1.0;
  GstSeekFlags flags = GST_SEEK_FLAG_NONE;
  std::string edit = {}; ///< elements before codedexposure-demux, with "!"

  bool is_trick () const { return rate < 0 || flags != GST_SEEK_FLAG_NONE; }
};

/** Reads @p path again and judges it. */
void decode (Row &row, const std::string &path, const Recording &recording,
    const Reader &reader);

} // namespace codedexposure::campaign
