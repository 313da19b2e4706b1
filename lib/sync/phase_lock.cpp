/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "sync/phase_lock.h"

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
      state_ = State::started;
  } else if (state_ == State::awaiting) {
    await (sight, lost, decision);
  }
  if (state_ == State::started || state_ == State::locked ||
      state_ == State::suspected)
    watch (sight, number, decision);

  const bool known =
      options_.can_restart || options_.observable == SlipObservable::always;
  if (state_ != State::locked)
    decision.locked = false;
  else if (known)
    decision.locked = true;
  decision.locked_now &= known;
  decision.slip = state_ == State::locked ? 0 : slip_;
  return decision;
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
  } else if (state_ == State::started ||
             (state_ == State::suspected &&
                 sight.reading.kind == Kind::in_phase)) {
    decision.locked_now = state_ == State::started;
    state_ = State::locked;
  }
}

void
PhaseLock::establish (const PhaseReading &slip, LockDecision &decision)
{
  state_ = State::slipped;
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
    state_ = State::locked;
    decision.locked_now = true;
  } else if (++awaited_ >= kPatience) {
    state_ = State::slipped;
    decision.restart = true;
  }
}

} // namespace codedexposure
