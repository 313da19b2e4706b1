/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Whether the masks are in phase with the exposure, frame by frame. */
#pragma once

#include <cstdint>
#include <optional>

#include "sync/phase_watch.h"

namespace codedexposure
{

/** The decision on one frame. */
struct LockDecision {
  /** Whether the masks are synchronised with the exposure; none: unknown. */
  std::optional<bool> locked;
  /** Slots by which the masks come late (> 0) or early; 0 unless locked is
   * false. */
  int slip = 0;

  /** Set on the frame on which a slip is established. */
  struct Slip {
    std::uint64_t first_frame; ///< that showed it
    int slots;
    bool certain; ///< of the number of slots
  };
  std::optional<Slip> slipped;
  /** The first frame that is known to be in phase, of all or since a slip. */
  bool locked_now = false;
  /** The first frame after a slip that is not flagged: a restart was seen. */
  bool slip_over = false;
  /** The DMD must be restarted. */
  bool restart = false;
};

/**
 * The states of the lock:
 *
 *   following --slip--> slipped --restart--> awaiting
 *       ^ \--suspicion--> suspected              |
 *       +----------------------------------------+
 *
 * A DMD that was started is taken as in phase until a frame shows otherwise,
 * but only a frame whose pilot shows every mask is known to be: any other may
 * follow a slip between two exposures, which no code shows. A frame that shows
 * the pilot's half of the frame before it may be an old picture with a new
 * time, or not have the number that it is given. After a slip it is
 * restarted if possible, and all frames are flagged until the restart is
 * visible: in the pilot, or as an exposure with parked mirrors (a gap, if the
 * DMD triggers the camera) followed by a frame in phase. Frames exposed before
 * the restart look like those after it, however many arrive late.
 */
class PhaseLock
{
public:
  struct Options {
    SlipObservable observable = SlipObservable::never;
    bool can_restart = false;
    /** The camera gets its trigger from the DMD. */
    bool gap_shows_restart = false;
  };
  explicit PhaseLock (const Options &options) : options_ (options) {}

  /** @p sight  of frame @p number, before which @p lost frames are missing.
   *  @p restarted  no restart is pending. */
  LockDecision take (const PhaseSight &sight, std::uint64_t number,
      std::uint64_t lost, bool restarted);

private:
  enum class State { following, suspected, slipped, awaiting };

  void watch (
      const PhaseSight &sight, std::uint64_t number, LockDecision &decision);
  void await (
      const PhaseSight &sight, std::uint64_t lost, LockDecision &decision);
  bool alternates (const PhaseSight &sight, std::uint64_t number);
  bool is_proof (const PhaseSight &sight) const;
  void follow (LockDecision &decision);
  void establish (const PhaseReading &slip, LockDecision &decision);

  Options options_;
  State state_ = State::following;
  bool known_ = false; // that a frame was in phase, since the last slip
  int slip_ = 0;
  std::uint64_t first_frame_ = 0; // of the slip, or of its suspicion
  int awaited_ = 0;               // frames since the restart
  bool restart_seen_ = false;
  /* Half of the pilot in even frames, by the last frame that showed it. */
  std::optional<int> even_half_;
  int unopposed_ = 0; // frames since then without a contradiction
};

} // namespace codedexposure
