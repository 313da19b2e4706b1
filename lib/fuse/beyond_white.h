/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Light that saturates the first of two cameras. */
#pragma once

#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "base/image.h"
#include "base/try.h"
#include "fuse/fuser.h"
#include "schedule/schedule.h"

namespace codedexposure::fuse
{

/** What the second camera alone tells: its frames, each fused for itself with
 * the complement of the masks. */
template <typename Pixel>
class BeyondWhite
{
public:
  /** @p options  of the Fuser of both. */
  static Result<BeyondWhite> make (const Schedule &schedule, int width,
      int height, const FuseOptions &options, std::stop_token stop)
  {
    FuseOptions alone;
    alone.bits = options.bits;
    alone.target = options.target;
    alone.threads = options.threads;
    alone.noise = options.partner_noise.value_or (options.noise);
    ASSIGN_OR_RETURN (const Schedule complement, schedule.complement ());
    ASSIGN_OR_RETURN (auto fuser, Fuser<Pixel>::make (complement, width, height,
                                      alone, std::move (stop)));
    return BeyondWhite (schedule, std::move (fuser));
  }

  Result<void> take (ImageView<const Pixel> partner)
  {
    fuser_.forget ();
    RETURN_IF_ERROR (fuser_.take (partner));
    std::vector<ImageView<Pixel>> views;
    for (Image<Pixel> &slot : slots_)
      views.push_back (slot.view ());
    return fuser_.fuse (views);
  }
  /** What the first camera's pixel would have seen, in units of the second. */
  float at (int x, int y) const
  {
    float sum = 0.0f, count = 0.0f;
    for (std::size_t s = 0; s < slots_.size (); s++)
      if (schedule_.on (x, y, int (s))) {
        sum += float (slots_[s].at (x, y));
        count += 1.0f;
      }
    return sum / count;
  }

private:
  BeyondWhite (const Schedule &schedule, Fuser<Pixel> fuser)
      : schedule_ (schedule), fuser_ (std::move (fuser)),
        slots_ (std::size_t (schedule.slots ()),
            Image<Pixel> (fuser_.size ().width, fuser_.size ().height))
  {
  }

  Schedule schedule_;
  Fuser<Pixel> fuser_;
  std::vector<Image<Pixel>> slots_;
};

} // namespace codedexposure::fuse
