/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A damaged Matroska stream without what is damaged in its structure. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace codedexposure
{

/**
 * Lets the bytes of a Matroska stream pass, but for clusters and other elements
 * of the segment that are no such: a demuxer takes the length that garbage
 * claims, and skips everything after it. The stream goes on with the next
 * cluster, whose beginning is searched for. What lies within the blocks of a
 * cluster is not looked at.
 *
 * An element of the segment passes as a whole, so up to kMostHeld bytes are
 * held back. The head, up to the first cluster, passes as it is.
 */
class ClusterGate
{
public:
  static constexpr std::size_t kMostHeld = std::size_t (256) << 20;

  /** What may go on after @p bytes. */
  std::string take (std::string_view bytes);
  /** The bytes that did not pass so far. */
  std::uint64_t dropped () const { return dropped_; }

private:
  enum class Found { whole, part, damaged };

  void pass (std::size_t size, std::string &to);
  void drop (std::size_t size);
  bool find_cluster (std::string &head);
  Found look (std::size_t &size);
  Found look_into (std::size_t data, std::size_t end) const;

  std::string held_;
  std::size_t at_ = 0; ///< of it, to here, has passed or is dropped
  bool in_head_ = true, lost_ = false;
  bool is_open_ = false; ///< in a cluster whose size is not known
  std::uint64_t dropped_ = 0;
};

} // namespace codedexposure
