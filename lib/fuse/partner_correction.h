/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames of a second camera, made better by what the first one tells. */
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <utility>

#include "base/image.h"
#include "base/result.h"
#include "fuse/fuser.h"
#include "rectify/rectifier.h"
#include "schedule/schedule.h"

namespace codedexposure
{

/**
 * Corrects rectified frames of a second camera, in the beam of the mirrors that
 * are off, whose pixels lie between mirrors (Rectifier::correct ()). The light
 * that it must have got is estimated from the coded frame of the first camera
 * alone, by fusion with `fast`, of this frame only: a part of a stream gives
 * the same as the whole.
 */
template <typename Pixel> // std::uint8_t or std::uint16_t (host order)
class PartnerCorrection
{
public:
  /** @p schedule  of the first camera.
   *  @p partner   of the second one; Rectifier::corrects ().
   *  @p options   of the Fuser that takes both, of which those that are not for
   *               `fast` and one camera do not count. The threads serve run ().
   *  @p stop      another thread can request it if filters take too long.
   * Error as of Fuser. */
  static Result<PartnerCorrection> make (const Schedule &schedule,
      const Rectifier &partner, const FuseOptions &options,
      std::stop_token stop = {});

  PartnerCorrection (PartnerCorrection &&) noexcept = default;
  PartnerCorrection &operator= (PartnerCorrection &&) noexcept = default;

  /** Both with a pixel a mirror.
   * @p errors  none, or those of the partner, as of Rectifier::run (): less of
   *            them is left.
   * Error as of Fuser; the pixels of the partner are undefined then. */
  Result<void> run (ImageView<const Pixel> coded, ImageView<Pixel> partner,
      const std::optional<ImageView<float>> &errors = {},
      std::stop_token stop = {});

private:
  struct State;
  explicit PartnerCorrection (std::shared_ptr<State> state)
      : state_ (std::move (state))
  {
  }
  std::shared_ptr<State> state_;
};

extern template class PartnerCorrection<std::uint8_t>;
extern template class PartnerCorrection<std::uint16_t>;

} // namespace codedexposure
