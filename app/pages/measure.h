/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Measures coded frames and subframes of a recording. */
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/structure.h"
#include "options/picture.h"
#include "pipeline/job.h"
#include "record/provenance.h"
#include "stats/picture_stats.h"

namespace codedexposure::app
{

/** What subframestats says of a picture. */
struct MeasuredPicture {
  guint64 frame = 0;
  gint subframe = -1;
  GstClockTime pts = 0; ///< a position in the recording
  PictureStats stats;
  bool damaged = false;
  CODED_FIELDS (frame, subframe, pts, stats.mean, stats.minimum, stats.maximum,
      stats.entropy, stats.saturated, stats.pixels);
};

/** Of one pad of a demux; filled by its streaming thread. */
struct MeasuredStream {
  std::vector<MeasuredPicture> pictures;
  bool details = false; ///< keeps histograms and profiles
  int bits = 0;         ///< significant ones
  Extent size;
  FrameRate rate{0, 1};
  std::optional<Provenance> provenance;

  void add (GstPad *pad, GstBuffer *picture);
};

struct Measurement {
  MeasuredStream coded, subframes;
  RunResult result;
  bool salvaged = false; ///< the recording was read past damage
  std::size_t pairs = 0; ///< coded frames with one of a second camera
};

/** What is measured, and where to. */
struct MeasureOptions {
  std::string recording;
  DecodeOptions decode;
  std::string line;
  /** Files for the lines of subframestats; empty: none. */
  std::string coded_csv = {}, subframes_csv = {};
  PlayTimes times = {};
  bool details = false;
  RunOptions run = {};
  /** As that of the Job. */
  std::set<std::string> *said = nullptr;
};

/** Runs through a recording; salvages a damaged one. Throws Failure. */
Measurement measure (const MeasureOptions &options);

} // namespace codedexposure::app
