/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How coded frames are taken apart: the parts of a frame, an extractor for
 * each, and the times of the subframes. */
#pragma once

#include <cstdint>
#include <variant>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "extract/extractor.h"
#include "schedule/schedule.h"
#include "schedule/timing.h"

namespace codedexposure
{

/** When the light of a subframe fell, from the start of its coded frame. */
struct LightWindow {
  Nanoseconds start = 0;
  Nanoseconds duration = 0;
  bool operator== (const LightWindow &) const = default;
};

/**
 * The light of each subframe that @p method makes of @p part, which is
 * background () or region () of a schedule with @p slots.
 *
 * decode, and select of a one-hot code, give one slot; select and rank of
 * another code, all slots from the first to the last in which the element is
 * on; rank, where exposures are equally long and elements cannot be
 * distinguished, the whole exposure.
 *
 * @p method  the one that is used, not kAuto.
 */
std::vector<LightWindow> light_windows (
    const Schedule &part, Method method, const SlotPlan &slots);

using AnyExtractor =
    std::variant<Extractor<std::uint8_t>, Extractor<std::uint16_t>>;

/** Pixels that one tile and one code take apart. */
struct SplitPart {
  int region; ///< -1: the background, or all of the frame
  Schedule schedule;
  Rect rect; ///< of the frame
  AnyExtractor extractor;
  /** When subframe k is shown: from boundary k to boundary k + 1, counted from
   * the start of the coded frame; equal steps, one more than subframes. */
  std::vector<Nanoseconds> boundaries;
  std::vector<LightWindow> windows;

  int subframes () const { return schedule.elements (); }
  Nanoseconds period () const { return boundaries.back (); }
  Method method () const;
  double gain () const;
};

/** What a split plan is made for. */
struct SplitFormat {
  Extent size; ///< of the coded frames, in mirrors
  bool wide;   ///< 16-bit pixels, else 8-bit ones
  FrameRate rate;
  SlotPlan slots;
};

/**
 * The background and then the regions of @p schedule. Error where a region
 * does not lie within the frame or a part cannot be taken apart.
 *
 * @p options  gain is for a slot of the background; the longer or shorter slots
 *             of regions get theirs in proportion.
 */
Result<std::vector<SplitPart>> make_split_plan (const Schedule &schedule,
    const SplitFormat &format, const ExtractOptions &options);

/** A subframe of one of several parts. */
struct SplitTurn {
  std::size_t part;
  std::size_t subframe;
  bool operator== (const SplitTurn &) const = default;
};

/** All subframes of @p parts in the order of time, the background first;
 * @p backwards: the last one first. */
std::vector<SplitTurn> order_subframes (
    const std::vector<SplitPart> &parts, bool backwards);

} // namespace codedexposure
