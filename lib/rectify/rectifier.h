/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Resamples the frames of a misaligned camera to one pixel per mirror. */
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

#include "base/image.h"
#include "base/result.h"
#include "base/workers.h"
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
  /** Mirrors of which a pixel with a part in their estimate has the largest
   * value get it as well, and so do those that the camera does not see, so that
   * what is not known is seen to be so. */
  bool keep_unknown = false;
  /** Prepares correct (). */
  bool correct = false;

  bool operator== (const RectifyOptions &) const = default;
};

/** How well the camera sees the mirrors, in numbers of mirrors. */
struct RectifyReport {
  /** Copied: the pixel gets nine tenths of its light from this mirror. */
  std::uint64_t exact = 0;
  std::uint64_t weighted = 0; ///< estimated from several pixels
  /** Of the weighted ones, those of which even the best pixel gets less than
   * half of its light: their estimate depends mostly on neighbouring pixels. */
  std::uint64_t mixed = 0;
  /** Outside the frame; they are black, but with keep_unknown. */
  std::uint64_t unseen = 0;
};

/**
 * Resamples camera frames to one pixel per mirror, so that extraction and
 * fusion find each element at its place.
 *
 * Where a pixel gets its light from one mirror, its value is copied. Elsewhere,
 * also behind a lens that blurs an aligned camera, a pixel collects light from
 * several mirrors, which show different slots. Each
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
 * called from several threads, and keeps four bytes for each pixel of the
 * camera around which weights are used; besides, it allocates a few bytes at
 * most, and with keep_unknown a byte for each row of the camera.
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
  /** Whether the camera sees the mirror @p x, @p y of mirrors (). */
  bool sees (int x, int y) const;

  /** @p largest  pixel value, to which results are clamped; 0: that of the
   * type.
   * @p errors   of mirrors, beyond the noise of a pixel: rms, DN, as expected
   *             of a scene whose light varies as much as the pixels around;
   *             0 where a pixel was copied.
   * @p workers  share the rows; null: the caller's thread alone. The pixels do
   *             not depend on it.
   * Error when a view does not have the size of camera () or mirrors (), or the
   * frames overlap. */
  template <typename Pixel> // std::uint8_t or std::uint16_t
  Result<void> run (ImageView<const std::type_identity_t<Pixel>> camera,
      ImageView<Pixel> mirrors, int largest = 0,
      const std::optional<ImageView<float>> &errors = {},
      Workers *workers = nullptr) const;

  /** Whether correct () is prepared, which it is only where it pays: where many
   * mirrors lie between pixels. */
  bool corrects () const;
  /** Takes out of @p mirrors, which run () has made, what it makes wrong of a
   * scene of the light @p expected: what it would make of such a camera frame,
   * less that light. The noise stays as it is, and so do the outermost mirrors
   * and those of the largest value.
   * @p expected  of the mirrors of the first rows or of all, in any unit and
   *              with any error; the smaller, the less is left of that of
   *              run ().
   * @p workers   share the rows.
   * Error when nothing is prepared or a view has a wrong size. */
  template <typename Pixel>
  Result<void> correct (ImageView<Pixel> mirrors,
      ImageView<const std::uint16_t> expected, Workers &workers,
      int largest = 0) const;

private:
  struct Plan;
  explicit Rectifier (std::shared_ptr<const Plan> plan)
      : plan_ (std::move (plan))
  {
  }
  std::shared_ptr<const Plan> plan_;
};

} // namespace codedexposure
