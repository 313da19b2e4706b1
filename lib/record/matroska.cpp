/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "record/matroska.h"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <utility>

#include <sys/stat.h>
#include <unistd.h>

#include "record/ebml.h"
#include "record/track.h"

namespace codedexposure
{

using namespace ebml;

namespace
{

/* ----------------------------------------------------------------- head -- */

/** The segment of a file that is not finished has no size. */
std::optional<Element>
segment_of (Source &file)
{
  const auto head = file.element_at (0, file.size ());
  if (!head || head->id != kEbml)
    return std::nullopt;
  const auto segment = file.element_at (head->end, kUnlimited);
  return segment && segment->id == kSegment ? segment : std::nullopt;
}

int
pixel_bytes_of (std::string_view format)
{
  constexpr std::string_view kOfFfmpeg ("Y1\0\x10", 4);
  if (format == "Y800" || format == "GREY")
    return 1;
  /* The second is in streams of earlier versions. */
  return format == kOfFfmpeg || format == "Y16 " ? 2 : 0;
}

void
read_video (Source &file, const Element &video, Extent &size, int &pixel_bytes)
{
  constexpr std::uint64_t kLargest = 1 << 24;
  file.each (video, [&] (const Element &part) {
    if (part.id == kPixelWidth)
      size.width = int (std::min (file.number (part), kLargest));
    else if (part.id == kPixelHeight)
      size.height = int (std::min (file.number (part), kLargest));
    else if (part.id == kColourSpace)
      pixel_bytes = pixel_bytes_of (file.text (part, 4));
    return true;
  });
}

MatroskaHead::Codec
codec_of (std::string_view name, std::string_view setup)
{
  constexpr std::size_t kFourCc = 16; // its place in a BITMAPINFOHEADER
  using Codec = MatroskaHead::Codec;
  if (name == "V_UNCOMPRESSED")
    return Codec::raw;
  const bool is_ffv1 =
      name == "V_FFV1" || (name == "V_MS/VFW/FOURCC" &&
                              setup.substr (std::min (setup.size (), kFourCc))
                                  .starts_with ("FFV1"));
  return is_ffv1 ? Codec::ffv1 : Codec::other;
}

void
read_track (Source &file, const Element &entry, MatroskaHead &head)
{
  constexpr std::size_t kLongest = 64;
  std::uint64_t number = 0, type = 0;
  std::string codec, setup;
  Nanoseconds duration = 0;
  std::optional<Element> video;
  file.each (entry, [&] (const Element &part) {
    if (part.id == kTrackNumber)
      number = file.number (part);
    else if (part.id == kTrackType)
      type = file.number (part);
    else if (part.id == kCodecId)
      codec = std::string (file.text (part, kLongest)).c_str ();
    else if (part.id == kCodecPrivate)
      setup = file.text (part, kLongest);
    else if (part.id == kDefaultDuration)
      duration = Nanoseconds (file.number (part) & (kUnlimited - 1));
    else if (part.id == kVideo)
      video = part;
    return true;
  });
  if (type == kTextTrack && head.lines == 0)
    head.lines = number;
  else if (type == kTextTrack && head.partner_lines == 0)
    head.partner_lines = number;
  if (type != kVideoTrack)
    return;
  if (head.codec != MatroskaHead::Codec::none) {
    if (head.partner_video == 0 && video)
      read_video (file, *video, head.partner_size, head.partner_pixel_bytes);
    if (head.partner_video == 0)
      head.partner_video = number;
    return;
  }
  head.video = number;
  head.codec = codec_of (codec, setup);
  head.codec_name = codec;
  head.duration = duration;
  if (video)
    read_video (file, *video, head.size, head.pixel_bytes);
}

std::optional<MatroskaHead>
head_of (Source &file, const Element &segment)
{
  constexpr std::size_t kLongest = std::size_t (1) << 16;
  MatroskaHead head;
  head.end = segment.is_open ? 0 : segment.end;
  bool complete = false;
  file.each (segment, [&] (const Element &part) {
    if (part.end > file.size ())
      return false;
    if (part.id == kInfo)
      file.each (part, [&] (const Element &value) {
        if (value.id == kTimestampScale)
          head.tick = Nanoseconds (std::clamp<std::uint64_t> (
              file.number (value), 0, 1'000'000'000));
        return true;
      });
    if (part.id != kTracks)
      return part.id != kCluster;
    complete = true;
    file.each (part, [&] (const Element &entry) {
      if (entry.id == kTrackEntry)
        read_track (file, entry, head);
      head.has_no_video |= entry.id == kTrackEntry;
      return true;
    });
    head.has_no_video &=
        head.codec == MatroskaHead::Codec::none &&
        file.text (part, kLongest).find ("V_") == std::string_view::npos;
    return false;
  });
  return complete ? std::optional (head) : std::nullopt;
}

/* --------------------------------------------------------------- frames -- */

/** A frame or a line. */
struct Block {
  std::uint64_t track, data;
  Nanoseconds time;
};

std::optional<Block>
block_of (
    Source &file, const Element &part, std::uint64_t cluster, Nanoseconds tick)
{
  const auto track = file.number_at (part.data, part.end, false);
  if (!track || part.end - track->end < 3)
    return std::nullopt;
  const std::string_view after = file.bytes (track->end, 2);
  if (after.size () < 2)
    return std::nullopt;
  const auto offset =
      std::int16_t (std::uint8_t (after[0]) << 8 | std::uint8_t (after[1]));
  Nanoseconds time = 0;
  if (cluster > std::uint64_t (kFarthestTime) ||
      __builtin_mul_overflow (Nanoseconds (cluster) + offset, tick, &time))
    return std::nullopt;
  return Block{track->value, track->end + 3, time};
}

/** What read_blocks has seen. */
struct Walk {
  std::size_t tracks = 0;
  std::uint64_t cluster = 0;            ///< its time
  std::uint64_t line = 0, line_end = 0; ///< the last one
};

void
read_extras (Source &file, const Element &part, Walk &walk, RecordingInfo &info)
{
  if (part.id == kAttachments)
    info.extras.emplace_back ("attachments");
  else if (part.id == kChapters)
    info.extras.emplace_back ("chapters");
  else if (part.id == kInfo || part.id == kTracks)
    file.each (part, [&] (const Element &child) {
      if (part.id == kInfo && child.id == kTitle)
        info.extras.emplace_back ("a title");
      walk.tracks += part.id == kTracks && child.id == kTrackEntry;
      return true;
    });
}

/* A second recording in the file has the same tracks as a second camera. */
void
settle_tracks (const Walk &walk, RecordingInfo &info)
{
  if (!info.setup || !info.setup->partner)
    info.partners = info.head.partner_video = info.head.partner_lines = 0;
  const std::size_t own = info.head.has_partners () ? 4
                          : info.head.lines != 0    ? 2
                                                    : 1;
  if (walk.tracks > own)
    info.extras.emplace_back ("other tracks, such as sound");
}

/* Of a block group: the block, its duration, references, additions and the
 * like. */
constexpr std::uint64_t kOfGroup[] = {
    kBlock, 0x9b, 0xfb, 0xfa, 0x75a1, 0x75a2, 0xa4, 0x8e};

/** The size of the file: there is none. */
std::uint64_t
next_cluster (Source &file, std::uint64_t at)
{
  constexpr std::size_t kStep = std::size_t (1) << 20;
  for (; at + kClusterName.size () <= file.size ();
       at += kStep - kClusterName.size ()) {
    const std::size_t found = file.bytes (at, kStep).find (kClusterName);
    if (found != std::string_view::npos)
      return at + found;
  }
  return file.size ();
}

Result<TrackLine>
line_at (Source &file, std::uint64_t begin, std::uint64_t end)
{
  return TrackLine::from_json (file.bytes (
      begin, std::min<std::size_t> (end - begin, TrackLine::kMaxSize)));
}

bool
stands_in (const Result<TrackLine> &line)
{
  return line && line->frame &&
         std::ranges::count (line->frame->flags, "gap") > 0;
}

void
read_block (Source &file, const Element &part, Walk &walk, RecordingInfo &info)
{
  const auto block = block_of (file, part, walk.cluster, info.head.tick);
  if (!block)
    return;
  if (!info.start)
    info.start = block->time;
  if (block->track == info.head.video)
    info.times.push_back (block->time);
  info.partners += block->track == info.head.partner_video;
  if (block->track == info.head.partner_lines)
    info.alone += stands_in (line_at (file, block->data, part.end));
  if (block->track != info.head.lines)
    return;
  walk.line = block->data, walk.line_end = part.end;
  if (!info.setup)
    if (auto line = line_at (file, walk.line, walk.line_end))
      info.setup = std::move (line->setup);
}

/* To where it is cut off, and past what is damaged. Clusters and groups are
 * entered: those of a stream, and the last of a file that was not finished,
 * have no size. */
void
read_blocks (Source &file, const Element &segment, RecordingInfo &info)
{
  const bool is_cut = segment.is_open || segment.end > file.size ();
  Walk walk;
  for (std::uint64_t at = segment.data;
       at < std::min (file.size (), segment.end);) {
    const auto part = file.element_at (at, segment.end);
    const bool holds =
        part && (part->id == kCluster || part->id == kBlockGroup);
    const bool is_known =
        part && (!part->is_open || holds) &&
        (is_one_of (kOfSegment, part->id) || is_one_of (kOfCluster, part->id) ||
            is_one_of (kOfGroup, part->id));
    if (!is_known || (holds ? part->data : part->end) > file.size ()) {
      at = next_cluster (file, at + 1);
      info.is_damaged |= at < file.size () || !is_cut;
      continue;
    }
    at = holds ? part->data : part->end;
    if (part->id == kTimestamp)
      walk.cluster = file.number (*part);
    read_extras (file, *part, walk, info);
    if (part->id == kBlock || part->id == kSimpleBlock)
      read_block (file, *part, walk, info);
  }
  if (walk.line_end > 0)
    if (const auto line = line_at (file, walk.line, walk.line_end))
      info.recorded = line->end;
  settle_tracks (walk, info);
}

std::string
read_at (int file, std::uint64_t at, std::size_t length)
{
  std::string bytes (length, '\0');
  const ssize_t got =
      TEMP_FAILURE_RETRY (pread (file, bytes.data (), length, off_t (at)));
  bytes.resize (std::size_t (std::max<ssize_t> (got, 0)));
  return bytes;
}

} // namespace

std::optional<MatroskaHead>
matroska_head (std::string_view bytes)
{
  Source file = Source::of (bytes);
  const auto segment = segment_of (file);
  return segment ? head_of (file, *segment) : std::nullopt;
}

Result<RecordingInfo>
recording_info (const std::string &path, bool with_frames)
{
  constexpr const char *kRemedy =
      "; use a recording of \"codedexposure record\" or \"codedexposure "
      "simulate\"";
  struct stat status = {};
  if (stat (path.c_str (), &status) != 0 || !S_ISREG (status.st_mode))
    return Error{"cannot read " + path + "; give the name of a recording",
        ErrorCode::io};
  const std::unique_ptr<std::FILE, int (*) (std::FILE *)> opened (
      std::fopen (path.c_str (), "rbe"), std::fclose);
  if (!opened)
    return Error{
        "cannot read " + path + ": " + std::strerror (errno), ErrorCode::io};
  Source file ([number = fileno (opened.get ())] (std::uint64_t at,
                   std::size_t length) { return read_at (number, at, length); },
      std::uint64_t (status.st_size));
  if (file.bytes (0, 4) != "\x1a\x45\xdf\xa3")
    return Error{path + " is not a Matroska file" + kRemedy, ErrorCode::parse};
  const auto segment = segment_of (file);
  RecordingInfo info;
  info.is_open = segment && segment->is_open;
  if (auto head = segment ? head_of (file, *segment) : std::nullopt)
    info.head = *std::move (head);
  info.is_cut_short = !segment || (info.is_open ? info.head.lines == 0
                                                : segment->end > file.size ());
  if (info.head.tick == 0)
    return Error{path + ": " + MatroskaHead::kNoTick, ErrorCode::parse};
  if (info.head.has_no_video)
    return Error{
        path + " has no video, but a recording has coded frames" + kRemedy,
        ErrorCode::parse};
  if (info.head.codec == MatroskaHead::Codec::other)
    return Error{path + " has " + info.head.codec_name +
                     ", but coded frames are recorded as FFV1 or raw" + kRemedy,
        ErrorCode::parse};
  if (segment && with_frames) {
    read_blocks (file, *segment, info);
    if (info.is_open)
      info.is_cut_short = info.recorded != info.times.size ();
  }
  return info;
}

std::optional<std::string>
unquoted_tag (std::string_view text)
{
  if (text.size () < 2 || text.front () != '"' || text.back () != '"')
    return std::nullopt;
  text = text.substr (1, text.size () - 2);
  std::string plain;
  const auto digit = [&] (std::size_t at) {
    return at < text.size () && text[at] >= '0' && text[at] <= '7';
  };
  for (std::size_t i = 0; i < text.size (); i++) {
    if (text[i] == '\\' && digit (i + 1) && digit (i + 2) && digit (i + 3)) {
      plain += char ((text[i + 1] - '0') * 64 + (text[i + 2] - '0') * 8 +
                     (text[i + 3] - '0'));
      i += 3;
    } else {
      i += text[i] == '\\' && i + 1 < text.size ();
      plain += text[i];
    }
  }
  return plain;
}

} // namespace codedexposure
