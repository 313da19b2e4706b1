/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "record/large_blocks.h"

#include <algorithm>

namespace codedexposure
{

using namespace ebml;

namespace
{

constexpr std::string_view kToken = "codedexposure:frame:";
constexpr std::size_t kNumber = 8;
/* The longest name and length. */
constexpr std::size_t kHeader = 12;
/* Of a stream; more is damage. */
constexpr std::uint64_t kMostHeld = std::uint64_t (256) << 20;

/* Of an element of a stream. */
bool
is_large (std::uint64_t size)
{
  return size > LargeBlocks::kMost && size <= kMostHeld;
}

std::string
digits (std::uint64_t value)
{
  std::string bytes (kNumber, '\0');
  for (auto byte = bytes.rbegin (); byte != bytes.rend (); ++byte, value >>= 8)
    *byte = char (value & 0xff);
  return bytes;
}

/* A name of one byte, and a length of eight. */
std::string
header (std::uint64_t name, std::uint64_t size)
{
  return char (name) + digits (size | std::uint64_t (1) << 7 * kNumber);
}

} // namespace

std::optional<LargeBlocks::Frame>
LargeBlocks::frame_of (std::string_view bytes)
{
  if (bytes.size () != kToken.size () + 2 * kNumber ||
      !bytes.starts_with (kToken))
    return std::nullopt;
  Source source = Source::of (bytes);
  const auto number = [&] (std::uint64_t at) {
    return source.number ({0, at, at + kNumber, false});
  };
  return Frame{number (kToken.size ()), number (kToken.size () + kNumber)};
}

/* That at @at; of one that holds others, only the header. None: it is damaged,
 * or no element of a recording. */
std::optional<Element>
LargeBlocks::element_of (Source &source, std::uint64_t at)
{
  auto element = source.element_at (at, kUnlimited);
  if (!element)
    return std::nullopt;
  const bool holds_others = element->id == kSegment || element->id == kCluster;
  if (holds_others)
    element->end = element->data;
  const bool is_known = element->id == kEbml || holds_others ||
                        is_one_of (kOfSegment, element->id) ||
                        is_one_of (kOfCluster, element->id);
  return is_known && (holds_others || !element->is_open) ? element
                                                         : std::nullopt;
}

/* None: it is small, or none of one frame. */
std::optional<LargeBlocks::Block>
LargeBlocks::block_of (Source &source, std::uint64_t at, const Element &element)
{
  constexpr std::uint64_t kMostBefore = 4096;
  constexpr std::uint8_t kLaced = 0x06;
  const bool is_group = element.id == kBlockGroup;
  if (element.end - at <= kMost || (!is_group && element.id != kSimpleBlock))
    return std::nullopt;
  Element block = element;
  std::uint64_t before = element.data;
  if (is_group)
    source.each (element, [&] (const Element &child) {
      block = child;
      if (child.id != kBlock)
        before = child.end;
      return child.id != kBlock;
    });
  if (is_group && (block.id != kBlock || before - element.data > kMostBefore))
    return std::nullopt;
  const auto track = source.number_at (block.data, block.end, false);
  constexpr std::uint64_t kTimeAndFlags = 3;
  if (!track || block.end - track->end <= kTimeAndFlags)
    return std::nullopt;
  const Frame frame{track->end + kTimeAndFlags, block.end};
  const std::size_t size = std::size_t (frame.at - block.data);
  const std::string head (source.bytes (block.data, size));
  if (head.size () < size || std::uint8_t (head.back ()) & kLaced)
    return std::nullopt;
  const std::string content =
      head + std::string (kToken) + digits (frame.at) + digits (frame.end);
  std::string shown = header (block.id, content.size ()) + content;
  if (is_group) {
    shown.insert (
        0, source.bytes (element.data, std::size_t (before - element.data)));
    shown.insert (
        0, header (kBlockGroup, shown.size () + (element.end - block.end)));
  }
  return Block{at, element.end, frame, shown};
}

std::vector<LargeBlocks::Patch>
LargeBlocks::patches_of (const Block &block)
{
  constexpr std::uint64_t kVoid = 0xec, kLongest = std::uint64_t (8) << 20;
  constexpr std::uint64_t kVoidHeader = 1 + kNumber;
  const std::uint64_t end = block.frame.end - block.head.size ();
  std::vector<Patch> patches;
  for (std::uint64_t at = block.at; at < end;) {
    const std::uint64_t rest = end - at;
    const std::uint64_t size = rest > kLongest + kVoidHeader ? kLongest : rest;
    patches.emplace_back (at, header (kVoid, size - kVoidHeader));
    at += size;
  }
  patches.emplace_back (end, block.head);
  return patches;
}

/* -------------------------------------------------------------- a file -- */

std::vector<LargeBlocks::Patch>
LargeBlocks::patches (Source &file, std::uint64_t at, std::uint64_t end)
{
  constexpr std::size_t kKept = 4; // a demuxer reads ahead less than one
  std::uint64_t next = at;
  for (const Block &block : blocks_)
    if (next >= block.at && next < block.end)
      next = block.end;
  for (std::optional<Element> element;
       next < end && (element = element_of (file, next)); next = element->end) {
    const bool is_known =
        std::ranges::find (blocks_, next, &Block::at) != blocks_.end ();
    auto block = is_known ? std::nullopt : block_of (file, next, *element);
    /* Pixels may look like an element, but not like two. */
    if (!block || (!file.bytes (element->end, 1).empty () &&
                      !element_of (file, element->end)))
      continue;
    blocks_.push_back (std::move (*block));
    if (blocks_.size () > kKept)
      blocks_.pop_front ();
  }
  std::vector<Patch> within;
  for (const Block &block : blocks_)
    for (const auto &[place, bytes] : patches_of (block)) {
      const std::uint64_t from = std::max (place, at);
      const std::uint64_t to = std::min (place + bytes.size (), end);
      if (from < to)
        within.emplace_back (from, bytes.substr (from - place, to - from));
    }
  return within;
}

bool
LargeBlocks::hides (const Frame &frame) const
{
  return std::ranges::any_of (blocks_, [&] (const Block &block) {
    return block.frame.at == frame.at && block.frame.end == frame.end;
  });
}

/* ------------------------------------------------------------ a stream -- */

void
LargeBlocks::restart (std::uint64_t at)
{
  held_.clear ();
  at_ = next_ = at;
}

/* The @bytes from at_ on. */
Source
LargeBlocks::source_of (std::string_view bytes) const
{
  return {[at = at_, bytes] (std::uint64_t place, std::size_t length) {
            const std::size_t from = std::size_t (place - at);
            return std::string (
                bytes.substr (std::min (from, bytes.size ()), length));
          },
      at_ + bytes.size ()};
}

bool
LargeBlocks::passes (std::string_view bytes)
{
  if (!held_.empty ())
    return false;
  const std::uint64_t end = at_ + bytes.size ();
  Source source = source_of (bytes);
  std::uint64_t next = next_;
  while (next < end) {
    const auto element = element_of (source, next);
    if (element ? is_large (element->end - next) : end - next < kHeader)
      return false;
    next = element ? element->end : kUnlimited;
  }
  next_ = next;
  at_ = end;
  return true;
}

void
LargeBlocks::pass (std::size_t size, std::string &to)
{
  to.append (held_, 0, size);
  held_.erase (0, size);
  at_ += size;
}

void
LargeBlocks::hide (const Block &block)
{
  const auto [at, end] = block.frame;
  shown_.emplace_back (at, held_.substr (at - at_, end - at));
  for (const auto &[place, bytes] : patches_of (block))
    held_.replace (place - at_, bytes.size (), bytes);
}

std::string
LargeBlocks::take (std::string_view bytes)
{
  held_ += bytes;
  shown_.clear ();
  std::string passed;
  for (;;) {
    pass (std::size_t (std::min<std::uint64_t> (held_.size (), next_ - at_)),
        passed);
    if (held_.empty ())
      break;
    Source source = source_of (held_);
    const auto element = element_of (source, at_);
    if (!element && held_.size () < kHeader)
      break;
    next_ = element ? element->end : kUnlimited;
    if (!is_large (next_ - at_))
      continue;
    if (held_.size () < next_ - at_) {
      next_ = at_;
      break;
    }
    if (const auto block = block_of (source, at_, *element))
      hide (*block);
  }
  return passed;
}

std::string_view
LargeBlocks::bytes_of (const Frame &frame) const
{
  const auto found = std::ranges::find (shown_, frame.at, &Patch::first);
  return found == shown_.end () ? std::string_view () : found->second;
}

} // namespace codedexposure
