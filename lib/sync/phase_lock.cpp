/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "sync/phase_lock.h"

#include <utility>

namespace codedexposure
{

namespace
{

using Kind = PhaseReading::Kind;

/* A restart that is not visible by then is requested again. More frames than a
 * camera driver buffers. */
constexpr int kPatience = 64;
/* Unclear frames after a restart that are taken as in phase. */
constexpr int kUnopposed = 3;

} // namespace

LockDecision
PhaseLock::take (const PhaseSight &sight, std::uint64_t number,
    std::uint64_t lost, bool restarted)
{
  LockDecision decision;
  const bool alternating = alternates (sight, number);
  if (state_ == State::slipped && options_.can_restart && restarted) {
    state_ = State::awaiting;
    awaited_ = 0;
    restart_seen_ = false;
    unopposed_ = 0;
  }
  if (state_ == State::slipped) {
    if (!options_.can_restart &&
        options_.observable == SlipObservable::always &&
        sight.reading.kind == Kind::in_phase)
      follow (decision);
  } else if (state_ == State::awaiting) {
    await (sight, lost, decision);
  }
  if (state_ == State::following || state_ == State::suspected)
    watch (sight, number, decision);

  if (state_ != State::following) {
    decision.locked = false;
    decision.slip = slip_;
  } else if (alternating && is_proof (sight)) {
    decision.locked = true;
    decision.locked_now = !std::exchange (known_, true);
  }
  return decision;
}

/** Whether the pilot's halves alternate with the numbers of the frames, as far
 * as it shows. */
bool
PhaseLock::alternates (const PhaseSight &sight, std::uint64_t number)
{
  if (sight.reading.kind != Kind::in_phase || !sight.reading.half)
    return true;
  const int even = *sight.reading.half ^ int (number & 1);
  return std::exchange (even_half_, even).value_or (even) == even;
}

/** Whether the frame cannot have slipped. */
bool
PhaseLock::is_proof (const PhaseSight &sight) const
{
  return options_.observable == SlipObservable::always &&
         sight.reading.kind == Kind::in_phase && sight.reading.certain &&
         !sight.next_frame_tells;
}

void
PhaseLock::watch (
    const PhaseSight &sight, std::uint64_t number, LockDecision &decision)
{
  const bool slipped = sight.reading.kind == Kind::slipped;
  if (slipped && state_ != State::suspected)
    first_frame_ = number;

  if (slipped && !sight.next_frame_tells) {
    establish (sight.reading, decision);
  } else if (slipped) {
    state_ = State::suspected;
    slip_ = sight.reading.slots;
  } else if (sight.reading.kind == Kind::in_phase) {
    state_ = State::following;
  }
}

void
PhaseLock::follow (LockDecision &decision)
{
  state_ = State::following;
  decision.slip_over = true;
}

void
PhaseLock::establish (const PhaseReading &slip, LockDecision &decision)
{
  state_ = State::slipped;
  known_ = false;
  slip_ = slip.slots;
  decision.slipped = {first_frame_, slip.slots, slip.certain};
  decision.restart = options_.can_restart;
}

void
PhaseLock::await (
    const PhaseSight &sight, std::uint64_t lost, LockDecision &decision)
{
  const Kind kind = sight.reading.kind;
  if (options_.observable == SlipObservable::always)
    restart_seen_ = kind == Kind::in_phase && !sight.next_frame_tells;
  else if (kind == Kind::parked || (options_.gap_shows_restart && lost > 0))
    restart_seen_ = true;

  const bool opposed = kind == Kind::parked || kind == Kind::slipped;
  unopposed_ = restart_seen_ && !opposed ? unopposed_ + 1 : 0;
  if (restart_seen_ && (kind == Kind::in_phase || unopposed_ >= kUnopposed)) {
    follow (decision);
  } else if (++awaited_ >= kPatience) {
    state_ = State::slipped;
    decision.restart = true;
  }
}

} // namespace codedexposure
