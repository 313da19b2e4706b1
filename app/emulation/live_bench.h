/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A bench in real time, whose mirrors are those of an emulated board. */
#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>

#include "bench/sick_bench.h"
#include "emulation/dlpc900.h"

namespace codedexposure
{

/** What the lines of @p board's table show, in true time. A line that pulses
 * begins a frame period. */
MirrorProgram program_of (const emulated::EmulatedDlpc900 &board);

/**
 * A SickBench in the time of this machine. Its board's triggers begin when it
 * is told to run, from whatever thread tells it. Options with a second camera
 * have a bench of it, with the same board.
 */
class LiveBench
{
public:
  /** @p kind of board as find_dlpc900 () has it; it gives the number of
   * mirrors. */
  static Result<std::unique_ptr<LiveBench>> make (
      SickBenchOptions options, int kind);

  const std::shared_ptr<emulated::EmulatedDlpc900> &board () const
  {
    return board_;
  }
  const BenchTruth &truth () const { return bench_.truth (); }
  /** In the beam of the mirrors that are off; null: there is none. */
  LiveBench *second () { return second_.get (); }

  /** The exposure time of frames from now on; none: the longest. Thread-safe,
   * like take (). */
  void expose (std::optional<Nanoseconds> time);
  /** The camera was off until now: what was triggered before is not exposed.
   * Thread-safe, too. */
  void skip ();
  /**
   * Waits for the end of the next exposure and takes its frame. Waits for two
   * frame periods at most, so that a camera can answer meanwhile; none if there
   * was no exposure.
   */
  std::optional<Shot> take (ImageView<std::uint16_t> picture);

private:
  LiveBench (SickBench bench, std::shared_ptr<emulated::EmulatedDlpc900> board,
      std::chrono::steady_clock::time_point began);
  Nanoseconds now () const;
  void follow (bool running);
  void show (Nanoseconds time, bool running, const MirrorProgram &program);

  std::shared_ptr<emulated::EmulatedDlpc900> board_;
  const std::chrono::steady_clock::time_point began_;
  std::unique_ptr<LiveBench> second_;

  std::mutex lock_; // covers everything below
  std::condition_variable changed_;
  SickBench bench_;
  std::optional<Shot> pending_; // its exposure is not over
};

} // namespace codedexposure
