/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The text track that stands beside the coded frames in a container: one line
 * of JSON a frame. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "record/frame_record.h"
#include "setup/stream_setup.h"

namespace codedexposure
{

/** A line of the track. docs/formats.md, "Per-frame track". */
struct TrackLine {
  static constexpr std::size_t kMaxSize = StreamSetup::kMaxJsonSize + 65536;

  std::optional<FrameRecord> frame = {};
  /** id_of () the setup of the frame. Lines of earlier versions have none:
   * there, a setup is valid from its frame on. */
  std::optional<std::uint64_t> setup_id = {};
  std::optional<StreamSetup> setup = {};
  /** The stream ended, complete, after so many frames. */
  std::optional<std::uint64_t> end = {};

  /** The last key, "check", is an XXH3 of the text before it. Contains no '<'
   * and no '&', which some programs take for markup. */
  std::string to_json () const;
  /** An error if the text is not as it was written. */
  static Result<TrackLine> from_json (std::string_view text);

  bool operator== (const TrackLine &) const = default;
};

/** By which lines name @p setup: an XXH3 of its JSON form, which does not tell
 * whether there is a track. */
std::uint64_t id_of (const StreamSetup &setup);

/** The file of lines of a recording: FILE.jsonl of FILE.mkv. */
std::string sidecar_of (const std::string &recording);

/** Text that a program has escaped as XML or Pango markup. */
std::string unescape_markup (std::string_view text);

} // namespace codedexposure
