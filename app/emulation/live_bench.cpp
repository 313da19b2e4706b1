/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "emulation/live_bench.h"

#include <algorithm>
#include <chrono>

#include "base/try.h"

namespace codedexposure
{

namespace
{

using std::chrono::nanoseconds;
using std::chrono::steady_clock;
constexpr Nanoseconds kMicrosecond = 1000;

} // namespace

MirrorProgram
program_of (const emulated::EmulatedDlpc900 &board)
{
  MirrorProgram program;
  Nanoseconds time = 0;
  int pulses = 0;
  const auto lines = board.shown ();
  for (std::size_t line = 0; line < lines.size (); line++) {
    pulses += lines[line].pulses;
    const Nanoseconds end = time + lines[line].exposure * kMicrosecond;
    program.masks.push_back (
        std::make_shared<Image<std::uint8_t>> (board.mirrors (int (line))));
    program.stretches.push_back ({time, end, line});
    time = end + lines[line].dark * kMicrosecond;
  }
  program.periods = std::max (1, pulses);
  program.period = time / program.periods;
  program.slot = lines.empty () ? 0 : time / Nanoseconds (lines.size ());
  return program;
}

Result<std::unique_ptr<LiveBench>>
LiveBench::make (SickBenchOptions options, int kind)
{
  auto board = std::make_shared<emulated::EmulatedDlpc900> (kind);
  const auto began = steady_clock::now ();
  const auto open =
      [&] (SickBenchOptions of) -> Result<std::unique_ptr<LiveBench>> {
    of.mirrors = board->size ();
    if (!of.has ("mute"))
      of.gamma = 1.0; // a camera's own feature
    ASSIGN_OR_RETURN (SickBench bench, SickBench::make (of));
    return std::unique_ptr<LiveBench> (
        new LiveBench (std::move (bench), board, began));
  };
  ASSIGN_OR_RETURN (auto bench, open (options));
  for (const SickBenchOptions &other : options.second) {
    ASSIGN_OR_RETURN (bench->second_, open (other));
  }
  board->on_run = [first = bench.get ()] (
                      bool running) { first->follow (running); };
  return bench;
}

LiveBench::LiveBench (SickBench bench,
    std::shared_ptr<emulated::EmulatedDlpc900> board,
    std::chrono::steady_clock::time_point began)
    : board_ (std::move (board)), began_ (began), bench_ (std::move (bench))
{
}

Nanoseconds
LiveBench::now () const
{
  return nanoseconds (steady_clock::now () - began_).count ();
}

/* Both cameras get the same triggers. */
void
LiveBench::follow (bool running)
{
  const MirrorProgram program =
      running ? program_of (*board_) : MirrorProgram ();
  MirrorProgram other;
  if (second_ && running)
    other = program.complement (board_->size ());
  const std::unique_lock guard (lock_);
  const auto of_second = second_ ? std::unique_lock (second_->lock_)
                                 : std::unique_lock<std::mutex> ();
  const Nanoseconds time = now ();
  show (time, running, program);
  if (second_)
    second_->show (time, running, other);
}

void
LiveBench::show (Nanoseconds time, bool running, const MirrorProgram &program)
{
  if (running)
    bench_.show (time, program);
  else
    bench_.park (time);
  changed_.notify_all ();
}

void
LiveBench::expose (std::optional<Nanoseconds> time)
{
  const std::lock_guard guard (lock_);
  bench_.expose (time);
}

void
LiveBench::skip ()
{
  const std::lock_guard guard (lock_);
  pending_.reset ();
  while (bench_.next (now ()))
    ;
}

std::optional<Shot>
LiveBench::take (ImageView<std::uint16_t> picture)
{
  std::unique_lock guard (lock_);
  const Nanoseconds limit = now () + 2 * bench_.truth ().options.rate.period ();
  for (;;) {
    const Nanoseconds time = now ();
    if (!pending_)
      pending_ = bench_.next (time + 1);
    if (pending_ && pending_->end <= time) {
      const Shot shot = *pending_;
      pending_.reset ();
      bench_.take (shot, picture);
      return shot;
    }
    if (time >= limit)
      return std::nullopt;
    /* A trigger may come at any time. */
    constexpr Nanoseconds kLook = 1'000'000;
    const Nanoseconds until =
        std::min (limit, pending_ ? pending_->end : time + kLook);
    changed_.wait_until (guard, began_ + nanoseconds (until));
  }
}

} // namespace codedexposure
