/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Elements of a Matroska file (RFC 8794 and 9559). */
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <functional>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace codedexposure::ebml
{

/* Names of elements (RFC 9559). */
inline constexpr std::uint64_t kEbml = 0x1a45dfa3, kSegment = 0x18538067,
                               kInfo = 0x1549a966, kTimestampScale = 0x2ad7b1,
                               kTracks = 0x1654ae6b, kTrackEntry = 0xae,
                               kTrackNumber = 0xd7, kTrackType = 0x83,
                               kCodecId = 0x86, kCodecPrivate = 0x63a2,
                               kDefaultDuration = 0x23e383, kVideo = 0xe0,
                               kPixelWidth = 0xb0, kPixelHeight = 0xba,
                               kColourSpace = 0x2eb524, kCluster = 0x1f43b675,
                               kTimestamp = 0xe7, kBlockGroup = 0xa0,
                               kBlock = 0xa1, kSimpleBlock = 0xa3,
                               kTitle = 0x7ba9, kAttachments = 0x1941a469,
                               kChapters = 0x1043a770;
/* Children of a segment, and of a cluster. */
inline constexpr std::string_view kClusterName = "\x1f\x43\xb6\x75";
inline constexpr std::uint64_t kOfSegment[] = {kCluster, 0x1c53bb6b /* cues */,
    0x1254c367 /* tags */, 0x114d9b74 /* seek head */, kInfo, kTracks,
    kAttachments, kChapters, 0xec /* void */, 0xbf /* checksum */};
inline constexpr std::uint64_t kOfCluster[] = {kTimestamp, kSimpleBlock,
    kBlockGroup, 0xab /* previous size */, 0xa7 /* position */, 0xec, 0xbf};

template <std::size_t N>
bool
is_one_of (const std::uint64_t (&names)[N], std::uint64_t name)
{
  return std::find (std::begin (names), std::end (names), name) !=
         std::end (names);
}

inline constexpr std::uint64_t kVideoTrack = 1, kTextTrack = 0x11;
/** Where nothing else limits an element. */
inline constexpr std::uint64_t kUnlimited = std::uint64_t (1) << 60;

/** Positions in the file. */
struct Element {
  std::uint64_t id, data, end;
  bool is_open; ///< its size is not known
};

/** Reads a file, or a part of it that is in memory. */
class Source
{
public:
  /** @p fetch copies bytes from a position, fewer at the end. */
  using Fetch = std::function<std::string (std::uint64_t, std::size_t)>;

  Source (Fetch fetch, std::uint64_t size)
      : fetch_ (std::move (fetch)), size_ (size)
  {
  }

  /** Of @p bytes, which outlive it. */
  static Source of (std::string_view bytes)
  {
    return {[bytes] (std::uint64_t at, std::size_t length) {
              return std::string (bytes.substr (
                  std::min (std::size_t (at), bytes.size ()), length));
            },
        bytes.size ()};
  }

  std::uint64_t size () const { return size_; }

  /** Valid until the next call; shorter at the end of the file. */
  std::string_view bytes (std::uint64_t at, std::size_t length)
  {
    constexpr std::size_t kPage = 4096;
    if (at < begin_ || at + length > begin_ + window_.size ()) {
      window_ = fetch_ (at, std::max (length, kPage));
      begin_ = at;
    }
    return std::string_view (window_).substr (at - begin_, length);
  }
  /** None if it is damaged or begins at @p limit. */
  std::optional<Element> element_at (std::uint64_t at, std::uint64_t limit)
  {
    const auto id = number_at (at, limit, true);
    const auto size = id ? number_at (id->end, limit, false) : std::nullopt;
    if (!size)
      return std::nullopt;
    if (size->is_unknown)
      return Element{id->value, size->end, limit, true};
    if (size->value > limit - size->end)
      return std::nullopt;
    return Element{id->value, size->end, size->end + size->value, false};
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
  std::uint64_t number (const Element &element)
  {
    std::uint64_t value = 0;
    for (const char byte : text (element, sizeof value))
      value = value << 8 | std::uint8_t (byte);
    return value;
  }
  std::string_view text (const Element &element, std::size_t most)
  {
    return bytes (element.data, std::size_t (std::min<std::uint64_t> (
                                    element.end - element.data, most)));
  }
  struct Number {
    std::uint64_t value, end;
    bool is_unknown;
  };
  /** The zeros before the first one say how many bytes follow; names keep that
   * one. */
  std::optional<Number> number_at (
      std::uint64_t at, std::uint64_t limit, bool is_name)
  {
    const std::string_view seen = at < limit ? bytes (at, 8) : "";
    if (seen.empty ())
      return std::nullopt;
    const auto first = std::uint8_t (seen[0]);
    const std::size_t length = std::size_t (std::countl_zero (first)) + 1;
    if (length > seen.size () || length > limit - at)
      return std::nullopt;
    const std::uint64_t mask = (std::uint64_t (1) << 7 * length) - 1;
    std::uint64_t value = first;
    for (const char byte : seen.substr (1, length - 1))
      value = value << 8 | std::uint8_t (byte);
    if (!is_name)
      value &= mask;
    return Number{value, at + length, !is_name && value == mask};
  }

private:
  Fetch fetch_;
  std::uint64_t size_;
  std::uint64_t begin_ = 0;
  std::string window_;
};

} // namespace codedexposure::ebml
