/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A whole bench in this process, in virtual time. */
#pragma once

#include <deque>
#include <memory>

#include "bench/sick_bench.h"
#include "doctor/rig.h"

namespace codedexposure
{

/**
 * A Rig over a SickBench. Nothing waits: now () is the time that a real bench
 * would have taken.
 *
 * The DMD has the limits of a DLPC900, receives masks as fast as one, and needs
 * 60 to 80 ms to show them, after which one period passes without a trigger.
 * Two frames are on their way when it stops, the later one cut short; they come
 * first in the next watch ().
 *
 * Options with a second camera have a rig of it.
 */
class SimulatedRig : public Rig
{
public:
  /** Fails where a number is out of its range or a part is missing. */
  static Result<std::unique_ptr<SimulatedRig>> make (
      const SickBenchOptions &options);

  const BenchTruth &truth () const { return bench_.truth (); }
  Nanoseconds now () const override;

  const RigParts &parts () const override { return parts_; }
  Result<void> show (const StillMask &mask, int slots) override;
  void park () override;
  Result<void> expose (std::optional<Nanoseconds> time) override;
  Result<std::vector<SeenFrame>> watch_until (
      Nanoseconds until, int frames) override;
  Result<std::vector<SeenFrame>> deliver (int frames) override;
  Result<void> record (const Schedule &schedule, double seconds,
      const std::function<void (const RecordedFrame &)> &take) override;
  Rig *second () override { return second_.get (); }

private:
  struct Setting {
    std::optional<Nanoseconds> exposure;
    int frames = 0; // until it is in force
  };

  explicit SimulatedRig (SickBench bench);
  std::optional<Shot> fetch (Nanoseconds until);
  std::optional<Shot> arrive (Nanoseconds until);
  Nanoseconds patience () const;
  SeenFrame frame_of (const Shot &shot);
  Nanoseconds arrival_of (const Shot &shot) const;
  void stop ();
  void catch_up (Nanoseconds now);
  void start (MirrorProgram program, Nanoseconds transfer = 0);
  bool spoil (const Shot &shot, ImageView<std::uint16_t> picture) const;
  Nanoseconds stamp_of (const Shot &shot) const;

  SickBench bench_;
  const SickBenchOptions options_;
  RigParts parts_;
  double clock_error_; // of the camera, relative
  Nanoseconds now_ = 0;
  bool shows_ = false;
  std::uint64_t starts_ = 0; // of masks
  std::deque<Shot> on_their_way_;
  std::optional<Setting> setting_;
  std::unique_ptr<SimulatedRig> second_;
  SimulatedRig *first_ = nullptr; // of the second
};

/** What a camera with these faults says of its GenICam features. */
std::map<std::string, std::string> camera_features (
    const SickBenchOptions &options);

} // namespace codedexposure
