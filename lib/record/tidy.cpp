/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "record/tidy.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <fstream>
#include <optional>
#include <string_view>

#include "record/matroska.h"

namespace codedexposure
{

namespace
{

/* Names of elements (RFC 9559). */
constexpr std::uint64_t kEbml = 0x1a45dfa3, kSegment = 0x18538067,
                        kSeekHead = 0x114d9b74, kSeek = 0x4dbb,
                        kSeekId = 0x53ab, kSeekPosition = 0x53ac,
                        kTracks = 0x1654ae6b, kTrackEntry = 0xae,
                        kTrackType = 0x83, kName = 0x536e,
                        kCluster = 0x1f43b675, kTags = 0x1254c367,
                        kTag = 0x7373, kSimpleTag = 0x67c8, kTagString = 0x4487;
constexpr char kTextTrack = 0x11;
/** Where the end of the file does not limit an element. */
constexpr std::uint64_t kUnlimited = std::uint64_t (1) << 60;

/** Positions in the file. */
struct Element {
  std::uint64_t id, begin, data, end;
};

class File
{
public:
  File (const std::string &path, std::ios::openmode mode)
      : stream_ (path, mode | std::ios::binary)
  {
    stream_.seekg (0, std::ios::end);
    size_ = std::uint64_t (stream_.tellg ());
  }

  bool good () const { return stream_.good (); }
  std::uint64_t size () const { return size_; }

  /** None if it does not end by @p limit. */
  std::optional<Element> element_at (std::uint64_t at, std::uint64_t limit)
  {
    const auto id = number_at (at, limit, true);
    const auto size = id ? number_at (id->end, limit, false) : std::nullopt;
    if (!size || size->value > limit - size->end)
      return std::nullopt;
    return Element{id->value, at, size->end, size->end + size->value};
  }
  /** Calls @p use for each child of @p parent until it returns false. */
  template <typename Use>
  void each (const Element &parent, Use use)
  {
    for (std::uint64_t at = parent.data; at < parent.end;) {
      const auto child = element_at (at, parent.end);
      if (!child || !use (*child))
        return;
      at = child->end;
    }
  }
  /** Up to its first zero, which ends a text before its element does. */
  std::string text (const Element &element)
  {
    return content (element).c_str ();
  }
  std::uint64_t number (const Element &element)
  {
    std::uint64_t value = 0;
    for (const char byte :
        read (element.data,
            std::min<std::uint64_t> (element.end - element.data, sizeof value)))
      value = value << 8 | std::uint8_t (byte);
    return value;
  }
  std::string content (const Element &element)
  {
    constexpr std::uint64_t kLongest = 16 << 20;
    return read (element.data, std::min (element.end - element.data, kLongest));
  }
  void write (std::uint64_t at, std::string_view bytes)
  {
    stream_.seekp (std::streamoff (at));
    stream_.write (bytes.data (), std::streamsize (bytes.size ()));
    stream_.flush ();
  }

private:
  struct Number {
    std::uint64_t value, end;
  };

  std::string read (std::uint64_t at, std::uint64_t length)
  {
    std::string bytes (length, '\0');
    stream_.seekg (std::streamoff (at));
    stream_.read (bytes.data (), std::streamsize (length));
    return bytes;
  }
  /** The zeros before the first one say how many bytes follow; names keep that
   * one. */
  std::optional<Number> number_at (
      std::uint64_t at, std::uint64_t limit, bool is_name)
  {
    if (at >= limit)
      return std::nullopt;
    const auto first = std::uint8_t (read (at, 1)[0]);
    const int length = std::countl_zero (first) + 1;
    if (length > 8 || std::uint64_t (length) > limit - at)
      return std::nullopt;
    std::uint64_t value = is_name ? first : first & (0xffU >> length);
    for (const char byte : read (at + 1, std::uint64_t (length) - 1))
      value = value << 8 | std::uint8_t (byte);
    return Number{value, at + std::uint64_t (length)};
  }

  std::fstream stream_;
  std::uint64_t size_ = 0;
};

void
make_tags_plain (File &file, const Element &tags)
{
  file.each (tags, [&] (const Element &tag) {
    if (tag.id == kTag)
      file.each (tag, [&] (const Element &simple) {
        if (simple.id == kSimpleTag)
          file.each (simple, [&] (const Element &part) {
            if (part.id != kTagString)
              return true;
            if (auto plain = unquoted_tag (file.text (part))) {
              plain->resize (part.end - part.data, '\0');
              file.write (part.data, *plain);
            }
            return true;
          });
        return true;
      });
    return true;
  });
}

/* Its name, "Subtitle" and a zero, is as long as a shorter one with FlagDefault
 * 0. */
void
hide_text_track (File &file, const Element &entry)
{
  constexpr std::string_view kHidden ("\x88\x81\x00\x53\x6e\x86"
                                      "Frames",
      12);
  bool is_text = false;
  std::optional<Element> name;
  file.each (entry, [&] (const Element &part) {
    if (part.id == kTrackType)
      is_text = file.content (part) == std::string (1, kTextTrack);
    if (part.id == kName && file.text (part) == "Subtitle")
      name = part;
    return true;
  });
  if (is_text && name && name->end - name->begin == kHidden.size ())
    file.write (name->begin, kHidden);
}

/** Position of the tags in the segment. */
std::optional<std::uint64_t>
find_tags (File &file, const Element &seek_head)
{
  std::optional<std::uint64_t> position;
  file.each (seek_head, [&] (const Element &seek) {
    std::string id;
    std::uint64_t at = 0;
    file.each (seek, [&] (const Element &part) {
      if (part.id == kSeekId)
        id = file.content (part);
      if (part.id == kSeekPosition)
        at = file.number (part);
      return true;
    });
    if (id == "\x12\x54\xc3\x67")
      position = at;
    return true;
  });
  return position;
}

/** The segment of a file that is not finished has no size. */
std::optional<Element>
segment_of (File &file)
{
  const auto head = file.element_at (0, file.size ());
  if (!head || head->id != kEbml)
    return std::nullopt;
  const auto segment = file.element_at (head->end, kUnlimited);
  return segment && segment->id == kSegment ? segment : std::nullopt;
}

} // namespace

Result<void>
tidy_matroska (const std::string &path)
{
  File file (path, std::ios::in | std::ios::out);
  if (!file.good ())
    return Error{"cannot open " + path, ErrorCode::io};
  const auto segment = segment_of (file);
  if (!segment || segment->end > file.size ())
    return {};
  std::optional<std::uint64_t> tags_at;
  file.each (*segment, [&] (const Element &part) {
    if (part.id == kSeekHead)
      tags_at = find_tags (file, part);
    if (part.id == kTracks)
      file.each (part, [&] (const Element &entry) {
        if (entry.id == kTrackEntry)
          hide_text_track (file, entry);
        return true;
      });
    return part.id != kCluster;
  });
  if (tags_at && *tags_at < segment->end - segment->data)
    if (const auto tags =
            file.element_at (segment->data + *tags_at, segment->end);
        tags && tags->id == kTags)
      make_tags_plain (file, *tags);
  if (!file.good ())
    return Error{"cannot write " + path, ErrorCode::io};
  return {};
}

} // namespace codedexposure
