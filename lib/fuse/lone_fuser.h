/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* `fast`, of each coded frame of one camera for itself; for this folder only.
 */
#pragma once

#include <stop_token>
#include <utility>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "base/try.h"
#include "fuse/fuser.h"
#include "schedule/schedule.h"

namespace codedexposure::fuse
{

/** What a frame tells without those before it: that of a part of a stream is
 * that of the whole. */
template <typename Pixel>
class LoneFuser
{
public:
  /** @p options  of a Fuser, whose bits, noise, threads and target count. */
  static Result<LoneFuser> make (const Schedule &schedule, Extent size,
      const FuseOptions &options, std::stop_token stop)
  {
    FuseOptions plain;
    plain.bits = options.bits;
    plain.noise = options.noise;
    plain.threads = options.threads;
    plain.target = options.target;
    ASSIGN_OR_RETURN (auto fuser, Fuser<Pixel>::make (schedule, size.width,
                                      size.height, plain, std::move (stop)));
    return LoneFuser (std::move (fuser));
  }

  /** Error as of Fuser. */
  Result<void> run (ImageView<const Pixel> coded, std::stop_token stop = {})
  {
    fuser_.forget ();
    RETURN_IF_ERROR (fuser_.take (coded));
    std::vector<ImageView<Pixel>> views;
    for (Image<Pixel> &slot : slots_)
      views.push_back (slot.view ());
    return fuser_.fuse (views, std::move (stop));
  }
  /** Of the last frame, in exposure order. */
  const std::vector<Image<Pixel>> &slots () const { return slots_; }

private:
  explicit LoneFuser (Fuser<Pixel> fuser)
      : fuser_ (std::move (fuser)),
        slots_ (std::size_t (fuser_.slots ()),
            Image<Pixel> (fuser_.size ().width, fuser_.size ().height))
  {
  }

  Fuser<Pixel> fuser_;
  std::vector<Image<Pixel>> slots_;
};

} // namespace codedexposure::fuse
