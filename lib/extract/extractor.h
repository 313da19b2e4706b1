/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* One coded frame in, n subframes out. */
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "schedule/schedule.h"

namespace codedexposure
{

enum class Method {
  /** Select for one-hot codes without leak, else decode, else rank. A part of a
   * schedule that gets less light than others is decoded for its brightness. */
  kAuto,
  kRank,   ///< subframe k = k-th smallest of the group (paper, Section 3.3)
  kSelect, ///< subframe k = the element that is on in slot k
  kDecode, ///< solve the code for the light of each slot
};

/** "auto", "rank", "select" or "decode". */
std::string_view method_name (Method method);

/** How to extract; the zero value is the default everywhere. */
struct ExtractOptions {
  static constexpr double kMaxGain = 1e6;

  Method method = Method::kAuto;
  /** Factor on the light of a slot (decode only); 0: white in a slot is white
   * out, i.e. Schedule::white_slots (). Up to kMaxGain. */
  double gain = 0.0;
  /** Significant bits of a pixel, 1..8 or 1..16; 0: all that the type has. */
  int bits = 0;
  /** decode only: interpolate each element to the centre of the cell before
   * the code is solved, where each element stands at the same place in every
   * cell (raster tiles) and the code is not one-hot. Off: solve with the pixels
   * as they stand, at different places. */
  bool interpolate = true;
  /** One of extract_targets (), which all give the same pixels; empty: the
   * fastest. */
  std::string_view target = {};
};

/** The instruction sets that extraction can use on this machine, fastest first;
 * the last one is always "scalar", the readable reference. */
std::vector<std::string_view> extract_targets ();

/** What was found in one coded frame. */
struct ExtractReport {
  /** Pixels of the cells that stand at the largest value: their light is
   * unknown. */
  std::uint64_t saturated = 0;
};

/**
 * A plan to extract frames of one size and depth, made once per caps. run ()
 * is const, may be called from several threads, and allocates nothing.
 */
template <typename Pixel> // std::uint8_t or std::uint16_t (host order)
class Extractor
{
public:
  /**
   * Of a schedule with regions, it extracts the background: pixels whose cells
   * a region touches are black, and beside them decode interpolates with the
   * cells that are left. Each region is extracted by itself, with
   * Schedule::region () and the pixels of its rectangle.
   *
   * Error when the method cannot be used with the code (decode of a singular
   * one), when a number is out of range, or when the frame holds no cell.
   * Select of a code that is not one-hot is allowed by name: subframe k is
   * element k then, and exposures have different lengths.
   */
  static Result<Extractor> make (const Schedule &schedule, int width,
      int height, const ExtractOptions &options = {});

  /** The method that is used, never kAuto. */
  Method method () const;
  /** The gain that is used; 1 where it does not apply. */
  double gain () const;
  int subframes () const;
  Extent subframe_size () const;

  /**
   * @p coded      width x height pixels.
   * @p subframes  subframes () views of subframe_size (), in exposure order,
   *               fully overwritten; none overlaps another or @p coded.
   * Error when a view is not so.
   * Select and rank copy values. Decode rounds to nearest and clamps to
   * 0..2^bits - 1 (decoder.h has the arithmetic): of a still, flat scene, and
   * with interpolation of any that is linear over neighbouring cells, it gives
   * the light of a slot times the gain within
   *   sum |factor| / 2 + 1/2, which is gain (1/2 + 1/2) + 1/2 for a staircase:
   * half a step from each coded pixel, half from the result.
   */
  Result<ExtractReport> run (ImageView<const Pixel> coded,
      std::span<const ImageView<Pixel>> subframes) const;

private:
  struct Plan;
  explicit Extractor (std::shared_ptr<const Plan> plan)
      : plan_ (std::move (plan))
  {
  }
  std::shared_ptr<const Plan> plan_;
};

extern template class Extractor<std::uint8_t>;
extern template class Extractor<std::uint16_t>;

} // namespace codedexposure
