/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Notices that something happens in the pictures of a stream. */
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/geometry.h"
#include "base/image.h"

namespace codedexposure
{

/** What is looked at, and what counts as an event. */
struct EventRule {
  enum class Kind {
    mean,   ///< the mean of the pixels jumps up or down
    motion, ///< pixels differ more from those of the picture before
  };
  Kind kind = Kind::mean;
  double part = 0.1; ///< of the largest pixel value, by which it jumps
  std::optional<Rect> region = {}; ///< pixels; none: the whole picture
};

/** "mean:10" or "motion:2.5@64x48+100+80": what, in percent of the largest
 * pixel value, in which region. None for another text. */
std::optional<EventRule> parse_event_rule (std::string_view text);

/**
 * Compares each picture with those of about the last second. Slow changes are
 * no event, and an event is told once: what follows it becomes usual.
 */
class EventWatch
{
public:
  explicit EventWatch (EventRule rule) : rule_ (std::move (rule)) {}

  /** @p picture  the next one, all of one size.
   * @p largest  value of its pixels.
   * Returns by which part of @p largest it jumps, if that is an event. A
   * picture without the region has none. */
  std::optional<double> add (ImageView<const std::uint8_t> picture, int largest)
  {
    return add_pixels (picture, largest);
  }
  std::optional<double> add (
      ImageView<const std::uint16_t> picture, int largest)
  {
    return add_pixels (picture, largest);
  }
  /** The picture before the next one is missing. */
  void skip () { before_.clear (); }
  /** Whether pictures of that size have the region. */
  bool fits (Extent size) const
  {
    return !rule_.region || (rule_.region->right () <= size.width &&
                                rule_.region->bottom () <= size.height);
  }
  const EventRule &rule () const { return rule_; }

private:
  template <typename Pixel>
  std::optional<double> add_pixels (
      ImageView<const Pixel> picture, int largest);
  std::optional<double> judge (double value);

  EventRule rule_;
  std::vector<std::uint16_t> before_; // pixels of the region, if they move
  std::deque<double> usual_;          // what was measured last
};

} // namespace codedexposure
