/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Coded frames of a misaligned camera, as an aligned one would take them. */
#pragma once

#include <cstdint>
#include <memory>

#include "base/image.h"
#include "base/result.h"
#include "schedule/mapping.h"
#include "schedule/schedule.h"

namespace cexp
{

/** What is known of the light before it is seen, for the weights. */
struct RectifyOptions {
  static constexpr double kLeastNoise = 1e-5, kMostNoise = 1.0;

  /** Mirrors, within which a pixel counts as looking at its own mirror only. */
  double tolerance = 0.05;
  /** Noise of a pixel, rms, as a part of white, where all slots are open: codes
   * that pass less light have more. */
  double noise = 0.006;
  /** Mirrors over which a scene is much the same. */
  double correlation_length = 2.0;
  /** Correlation of a scene with itself a slot later. */
  double persistence = 0.8;

  bool operator== (const RectifyOptions &) const = default;
};

/** How well the camera sees the mirrors; numbers of mirrors. */
struct RectifyReport {
  /** Looked up: there is one pixel a mirror, and it sees this one only. */
  std::uint64_t exact = 0;
  std::uint64_t weighted = 0; ///< from pixels that see neighbours, too
  /** Of those, where even the best pixel gets less than half of its light from
   * this mirror: what is said of them is much of it said by neighbours. */
  std::uint64_t mixed = 0;
  std::uint64_t unseen = 0; ///< no pixel looks at them; they are black
};

/**
 * Resamples camera frames to one pixel a mirror, so that everything that
 * follows finds each element at its place.
 *
 * Where pixels and mirrors are one to one, numbers are copied. Elsewhere a
 * pixel collects light of several mirrors, which show different slots; each
 * mirror is then estimated from the pixels around it by the weights of least
 * mean square error, which know which pixel sees how much of which mirror (the
 * mapping, its blur) and when that is open (the schedule). The more pixels
 * differ from their neighbours, the less their noise matters, and the more of
 * what is mixed is separated. Brightness is kept: a still, flat scene comes out
 * as an aligned camera has it.
 *
 * Weights are made once, for fractions of a pixel; along the borders of
 * regions, where pixels mix two codes, for each mirror. run () is const, may be
 * called from several threads, and allocates nothing.
 */
class Rectifier
{
public:
  /** Error when there is no room for the weights, a region does not lie among
   * the mirrors, or the camera sees none of them. */
  static Result<Rectifier> make (const Mapping &mapping,
      const Schedule &schedule, const RectifyOptions &options = {});
  Rectifier (Rectifier &&) noexcept;
  Rectifier &operator= (Rectifier &&) noexcept;
  ~Rectifier ();

  /** Size of what run () takes and of what it gives: all mirrors. */
  Extent camera () const;
  Extent mirrors () const;
  const RectifyReport &report () const;

  /** @p largest: of the numbers, where they are clamped; 0: of the type. */
  void run (ImageView<const std::uint8_t> camera,
      ImageView<std::uint8_t> mirrors, int largest = 0) const;
  void run (ImageView<const std::uint16_t> camera,
      ImageView<std::uint16_t> mirrors, int largest = 0) const;
  /** Rows [@p first_row, @p first_row + @p rows) of the result only, so that
   * threads can share a frame. */
  void run_rows (ImageView<const std::uint8_t> camera,
      ImageView<std::uint8_t> mirrors, int first_row, int rows,
      int largest = 0) const;
  void run_rows (ImageView<const std::uint16_t> camera,
      ImageView<std::uint16_t> mirrors, int first_row, int rows,
      int largest = 0) const;

private:
  struct Plan;
  explicit Rectifier (std::unique_ptr<const Plan> plan);
  std::unique_ptr<const Plan> plan_;
};

} // namespace cexp
