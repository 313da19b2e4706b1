/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Resamples the frames of a misaligned camera to one pixel per mirror. */
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "base/image.h"
#include "base/result.h"
#include "mapping/mapping.h"
#include "schedule/schedule.h"

namespace codedexposure
{

/** What the weights assume about the camera. */
struct RectifyOptions {
  static constexpr double kMinNoise = 1e-5, kMaxNoise = 1.0;

  /** Noise of a pixel, rms, as a part of white, with the mirrors on in all
   * slots: codes that pass less light have more. */
  double noise = 0.006;

  bool operator== (const RectifyOptions &) const = default;
};

/** How well the camera sees the mirrors, in numbers of mirrors. */
struct RectifyReport {
  /** Copied: one pixel sees this mirror and no other. */
  std::uint64_t exact = 0;
  std::uint64_t weighted = 0; ///< estimated from several pixels
  /** Of the weighted ones, those of which even the best pixel gets less than
   * half of its light: their estimate depends mostly on neighbouring pixels. */
  std::uint64_t mixed = 0;
  std::uint64_t unseen = 0; ///< outside the frame; they are black
};

/**
 * Resamples camera frames to one pixel per mirror, so that extraction and
 * fusion find each element at its place.
 *
 * Where pixels and mirrors are one to one, pixel values are copied. Elsewhere a
 * pixel collects light from several mirrors, which show different slots. Each
 * mirror is then estimated from the pixels around it with the least mean
 * squared error. The weights follow from the part of each mirror in each
 * pixel's light (the mapping and its blur) and from the times when the mirrors
 * are on (the schedule). The more pixels differ from their neighbours, the
 * smaller the assumed noise, and the better the mirrors are separated.
 * Brightness is kept: of a flat, static scene, the result is that of an aligned
 * camera.
 *
 * Weights are made once, for fractions of a pixel; along the borders of
 * regions, where pixels mix two codes, for each mirror. run () is const, can be
 * called from several threads, and allocates nothing.
 */
class Rectifier
{
public:
  /** Error when an option is out of range, the mapping has less than 0.75 or
   * more than 3.5 pixels per mirror, a blur or a displacement with which pixels
   * see too many mirrors to find their weights in seconds, a region lies
   * outside the mirrors, the camera sees none of them, or memory for the
   * weights is not available. */
  static Result<Rectifier> make (const Mapping &mapping,
      const Schedule &schedule, const RectifyOptions &options = {});
  /** Sizes of the input and the output of run (). */
  Extent camera () const;
  Extent mirrors () const;
  const RectifyReport &report () const;

  /** @p largest  pixel value, to which results are clamped; 0: that of the
   * type. Error when a view does not have the size of camera () or mirrors (),
   * or both overlap. */
  Result<void> run (ImageView<const std::uint8_t> camera,
      ImageView<std::uint8_t> mirrors, int largest = 0) const;
  Result<void> run (ImageView<const std::uint16_t> camera,
      ImageView<std::uint16_t> mirrors, int largest = 0) const;

private:
  struct Plan;
  explicit Rectifier (std::shared_ptr<const Plan> plan)
      : plan_ (std::move (plan))
  {
  }
  std::shared_ptr<const Plan> plan_;
};

} // namespace codedexposure
