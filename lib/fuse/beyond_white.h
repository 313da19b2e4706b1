/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Light that saturates the first of two cameras. */
#pragma once

#include "fuse/lone_fuser.h"

namespace codedexposure::fuse
{

/** What the second camera alone tells, by the complement of the masks. */
template <typename Pixel>
class BeyondWhite
{
public:
  /** @p schedule, @p options  of the Fuser of both. */
  static Result<BeyondWhite> make (const Schedule &schedule, Extent size,
      const FuseOptions &options, std::stop_token stop)
  {
    FuseOptions second = options;
    second.noise = options.partner_noise.value_or (options.noise);
    ASSIGN_OR_RETURN (const Schedule complement, schedule.complement ());
    ASSIGN_OR_RETURN (auto fuser,
        LoneFuser<Pixel>::make (complement, size, second, std::move (stop)));
    return BeyondWhite (schedule, std::move (fuser));
  }

  Result<void> take (ImageView<const Pixel> partner)
  {
    return fuser_.run (partner);
  }
  /** What the first camera's pixel would have seen, in units of the second. */
  float at (int x, int y) const
  {
    float sum = 0.0f, count = 0.0f;
    for (int s = 0; s < schedule_.slots (); s++)
      if (schedule_.on (x, y, s)) {
        sum += float (fuser_.slots ()[std::size_t (s)].at (x, y));
        count += 1.0f;
      }
    return sum / count;
  }

private:
  BeyondWhite (const Schedule &schedule, LoneFuser<Pixel> fuser)
      : schedule_ (schedule), fuser_ (std::move (fuser))
  {
  }

  Schedule schedule_;
  LoneFuser<Pixel> fuser_;
};

} // namespace codedexposure::fuse
