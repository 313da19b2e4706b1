/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Matroska for a demuxer that refuses blocks above a size. */
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "record/ebml.h"

namespace codedexposure
{

/**
 * Hides the frames of large blocks. No byte moves: in place of the block, a
 * demuxer sees empty elements (Void), and at their end the block with a token
 * in place of its frame. The token names the bytes of the frame.
 */
class LargeBlocks
{
public:
  /** matroskademux refuses elements of more than 15 MiB. */
  static constexpr std::uint64_t kMost = std::uint64_t (14) << 20;

  /** Bytes, and where they stand. */
  using Patch = std::pair<std::uint64_t, std::string>;
  /** The bytes of a frame, in the file or stream. */
  struct Frame {
    std::uint64_t at, end;
  };

  /** What @p bytes, those of a block, stand for; none: for themselves. */
  static std::optional<Frame> frame_of (std::string_view bytes);

  /** What to write over the bytes of @p file from @p at to @p end, which a
   * demuxer reads, and which begin with an element or are no elements. */
  std::vector<Patch> patches (
      ebml::Source &file, std::uint64_t at, std::uint64_t end);

  /** Whether the frame is that of a block that patches () found last. */
  bool hides (const Frame &frame) const;

  /* Of a stream: */

  /** An element follows, at @p at. */
  void restart (std::uint64_t at);
  /** Whether @p bytes go on as they are, without take (). */
  bool passes (std::string_view bytes);
  /** What goes on after @p bytes; a large block does when all of it is there.
   */
  std::string take (std::string_view bytes);
  /** The bytes of @p frame, if its block went on last; else "". */
  std::string_view bytes_of (const Frame &frame) const;

private:
  /** A block that is hidden. */
  struct Block {
    std::uint64_t at, end;
    Frame frame;
    std::string head; ///< what stands before its end
  };
  static std::optional<ebml::Element> element_of (
      ebml::Source &source, std::uint64_t at);
  static std::optional<Block> block_of (
      ebml::Source &source, std::uint64_t at, const ebml::Element &element);
  static std::vector<Patch> patches_of (const Block &block);
  ebml::Source source_of (std::string_view bytes) const;
  void pass (std::size_t size, std::string &to);
  void hide (const Block &block);

  std::deque<Block> blocks_; ///< of a file, the last ones

  std::string held_; ///< of a stream, from at_ on
  std::uint64_t at_ = 0;
  std::uint64_t next_ = 0;   ///< where the next element begins
  std::vector<Patch> shown_; ///< the frames of blocks that went on last
};

} // namespace codedexposure
