/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The bench as the doctor sees it: mirrors that obey, and a camera that looks
 * at them. */
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "dmd/dmd.h"
#include "setup/bench_profile.h"

namespace codedexposure
{

/** A frame as it came, with the pixel values of the camera. */
struct SeenFrame {
  /** By the camera's clock, which may be any epoch. The stamp of one frame to
   * that of the next is the time between their exposures. */
  Nanoseconds time = 0;
  Nanoseconds arrival = 0; ///< by the clock of this machine
  /** Packets of it are missing, and so are pixels. */
  bool damaged = false;
  Image<std::uint16_t> picture;
};

/** A frame of a recording, with what is known of it. */
struct RecordedFrame {
  Nanoseconds time = 0;    ///< start of its exposure
  Nanoseconds arrival = 0; ///< by the same clock
  std::uint64_t lost_before = 0;
  bool damaged = false;
  /** Whether masks and camera are in step; none: not known yet. */
  std::optional<bool> synchronised = {};
  /** 95 % bound on the error of the time; none: not known yet. */
  std::optional<Nanoseconds> uncertainty = {};
  ImageView<const std::uint16_t> picture = {}; ///< valid during the call
};

/** What can be known of the parts without a look at a frame. */
struct RigParts {
  BenchProfile::Device camera;
  std::string pixel_format; ///< GenICam name
  int bits = 8;             ///< significant ones, 1..16
  DmdInfo dmd;
  DmdStatus dmd_status;
  BenchProfile::Device dmd_device;
  FrameRate rate; ///< of the schedule, which the trigger gives
  /** GenICam features of the camera that could be read, as texts. */
  std::map<std::string, std::string> features;

  /** The largest DN. */
  int largest () const { return (1 << bits) - 1; }
  /** From frame to frame, s. */
  double period () const { return 1e-12 * double (rate.time_of (1000)); }
};

/**
 * Mirrors and camera of one bench. Calls come from one thread and may wait for
 * hardware. An Error is a part that does not obey; a camera that sends nothing
 * is none.
 */
class Rig
{
public:
  virtual ~Rig () = default;

  virtual const RigParts &parts () const = 0;
  /** Time as it passes at the bench, from any start. */
  virtual Nanoseconds now () const = 0;

  /**
   * Shows one mask from now on, repeated with the trigger of every frame period
   * of @p slots equal slots: @p mask in its own slots, all mirrors off in the
   * others. Returns when the DMD runs; frames of the mask before may still be
   * on their way.
   */
  virtual Result<void> show (const StillMask &mask, int slots) = 0;
  /** Parks the mirrors. If the DMD triggers the camera, frames end. */
  virtual void park () = 0;
  /** Sets the exposure time of the camera; none: the longest at which a frame
   * comes in every period. It holds from a later frame on. */
  virtual Result<void> expose (std::optional<Nanoseconds> time) = 0;
  /**
   * The frames that come from now on, which are those after the last watch ()
   * if nothing was called in between. Fewer than @p frames at the time @p until
   * of now (), or if none came for two seconds, or for ten frame periods,
   * whichever is longer.
   */
  virtual Result<std::vector<SeenFrame>> watch_until (
      Nanoseconds until, int frames) = 0;
  Result<std::vector<SeenFrame>> watch (int frames)
  {
    return watch_until (std::numeric_limits<Nanoseconds>::max (), frames);
  }
  /** Shows all mirrors on and takes @p frames as the network delivers them:
   * also those that lack pixels, which watch () may leave out. They need not
   * have a picture. */
  virtual Result<std::vector<SeenFrame>> deliver (int frames) = 0;
  /**
   * Records with @p schedule as a user would, for @p seconds, and hands each
   * frame to @p take. Ends early if no frame comes, as watch () does. The
   * mirrors are parked afterwards.
   */
  virtual Result<void> record (const Schedule &schedule, double seconds,
      const std::function<void (const RecordedFrame &)> &take) = 0;
  /**
   * The same mirrors with a second camera, in the beam of those that are off;
   * null where there is none. It can show () masks of one slot alone, of which
   * the mirrors get the complement, so that its camera sees them. Both cameras
   * see all that either shows, and watch () of both gives frames of the same
   * time. It does not record ().
   */
  virtual Rig *second () { return nullptr; }

protected:
  /** What the mirrors show where a second camera is to see @p mask in each of
   * @p slots. Error for more than one. */
  static Result<StillMask> mask_for_second (const StillMask &mask, int slots);
};

} // namespace codedexposure
