/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Reads what a recording, a Matroska file, says without its pixels. */
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/geometry.h"
#include "base/result.h"
#include "schedule/timing.h"
#include "setup/stream_setup.h"

namespace codedexposure
{

/** The head of a Matroska file, up to its list of tracks. */
struct MatroskaHead {
  enum class Codec { none, ffv1, raw, other };

  Codec codec = Codec::none; ///< of the first video track
  /** It lists tracks, and none of them was ever a video: damage to a name or a
   * type leaves the other. */
  bool has_no_video = false;
  std::string codec_name; ///< as the file has it
  /** Of the video; 0x0: there is none, or the head is damaged. */
  Extent size = {0, 0};
  /** Bytes of a pixel of raw frames: 1 or 2; 0: their format is not grey. */
  int pixel_bytes = 0;
  Nanoseconds duration = 0;     ///< of a frame; 0: not known
  Nanoseconds tick = 1'000'000; ///< to which times are rounded; 0: damaged
  static constexpr const char *kNoTick = "the head of the file is damaged: its "
                                         "TimestampScale is 0 ns, so that all "
                                         "frames have the same time; write 1, "
                                         "which recordings have, into the byte "
                                         "behind 2A D7 B1 81";
  /** Where the recording ends in the file; 0: not known. */
  std::uint64_t end = 0;
  /** Numbers of the tracks of frames and of their lines; 0: there is none. */
  std::uint64_t video = 0, lines = 0;
  /** Frames of a second camera, if the file has a second track of lines, too.
   */
  Extent partner_size = {0, 0};
  int partner_pixel_bytes = 0;
  std::uint64_t partner_video = 0, partner_lines = 0;

  bool has_partners () const
  {
    return partner_video != 0 && partner_lines != 0;
  }
};

/** The head in the first @p bytes of a file, which a file that is cut off has,
 * too; none: they are no Matroska, or end too early. */
std::optional<MatroskaHead> matroska_head (std::string_view bytes);

/** A recording of coded frames. */
struct RecordingInfo {
  MatroskaHead head;
  /** Its head has no length: it was not finished, or went through a pipe. */
  bool is_open = false;
  /** It is shorter than its head says; one that is open: it has no lines, or
   * its last line is missing or counts other frames, which is only known if
   * they were read. */
  bool is_cut_short = false;
  /** Something between its frames is no part of a recording. Only known if
   * the frames were read. */
  bool is_damaged = false;
  /** The time of the first frame or line: positions count from it; none: there
   * is none. */
  std::optional<Nanoseconds> start;
  /** PTS of the coded frames that are complete, in the order of the file. */
  std::vector<Nanoseconds> times;
  /** Frames of the second camera that are complete; there is one, or one that
   * stands in for it, of each coded frame. */
  std::uint64_t partners = 0;
  /** Of these, those that only stand in, by their lines. */
  std::uint64_t alone = 0;
  /** Frames that were recorded, by the last line; none: it is missing. */
  std::optional<std::uint64_t> recorded;
  /** Of the first frame whose line says it; none: not known. */
  std::optional<StreamSetup> setup;
  /** What the file has beside frames and their lines, such as "sound"; of files
   * of other programs. */
  std::vector<std::string> extras;
};

/** Reads the head of the file @p path and, with_frames, the places of all
 * frames, but no frame. An error says why it is no recording, and what to use
 * instead. */
Result<RecordingInfo> recording_info (
    const std::string &path, bool with_frames = true);

/** The text of a tag that GStreamer's muxer has quoted and escaped; none: it is
 * not quoted. */
std::optional<std::string> unquoted_tag (std::string_view text);

} // namespace codedexposure
