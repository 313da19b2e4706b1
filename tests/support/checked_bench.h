/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* One check of the doctor on a simulated bench, whose numbers are known. */
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "bench/simulated_rig.h"
#include "doctor/checks.h"

namespace codedexposure::test
{

/** How many random benches a test examines: DOCTOR_BENCHES, or @p usual. */
inline int
bench_count (int usual)
{
  const char *text = std::getenv ("DOCTOR_BENCHES");
  return text ? std::atoi (text) : usual;
}

/** Where a number and the truth differ by more than the tolerance, and by more
 * than what the number's doubt explains. */
inline void
expect_near (const Measured &measured, double truth, double tolerance,
    const std::string &what)
{
  EXPECT_LE (std::abs (measured.value - truth),
      std::max (tolerance, 3.5 * measured.sigma))
      << what << ": " << measured.value << " +- " << measured.sigma
      << ", truth " << truth;
}

/** A check that was made, and what it knew. */
struct CheckedBench {
  std::unique_ptr<SimulatedRig> rig;
  std::unique_ptr<Examination> examination;
  Finding finding;
  double seconds = 0.0; ///< of the bench

  /** "": there is none. */
  std::string first_diagnosis () const
  {
    return finding.diagnoses.empty () ? "" : finding.diagnoses[0].id;
  }
  const BenchProfile &truth () const { return rig->truth ().profile; }
  const BenchProfile &found () const { return examination->profile; }
};

/** What the check of the trigger finds of the lamp of @p options. */
inline LightFit
light_of (const SickBenchOptions &options)
{
  LightFit light{.epoch = 5e3}; // of the stamps of a simulated camera
  light.drift = {options.drift / 60.0, 1e-5};
  if (options.flicker_depth > 5e-4)
    light.lines = {{{options.flicker_rate, 1e-3},
        {options.flicker_depth, 0.01 * options.flicker_depth}}};
  light.faintest = 5e-4;
  return light;
}

/** The trigger's check has been made before. */
inline CheckedBench
check_bench (const SickBenchOptions &options,
    Result<Finding> (*check) (Examination &examination))
{
  CheckedBench done;
  auto rig = SimulatedRig::make (options);
  EXPECT_TRUE (rig) << (rig ? "" : rig.error ().message);
  done.rig = std::move (*rig);
  done.examination = std::make_unique<Examination> (Examination{*done.rig});
  done.examination->exhibits = false;
  const double period = double (done.rig->parts ().rate.period ());
  const double begin = done.truth ().trigger_delay->value;
  const double end = begin + done.truth ().exposure->value;
  const int first = int (std::ceil (begin * 16 / period));
  done.examination->inside = {
      first, std::min (16, int (std::floor (end * 16 / period))) - first, 16};
  done.examination->jitter = 1e-9 * options.jitter;
  done.examination->light = light_of (options);
  done.examination->profile.exposure =
      Measured{done.truth ().exposure->value, 5e3};
  done.examination->profile.trigger_delay =
      Measured{done.truth ().trigger_delay->value, 5e3};
  auto finding = check (*done.examination);
  EXPECT_TRUE (finding) << (finding ? "" : finding.error ().message);
  if (finding)
    done.finding = std::move (*finding);
  done.seconds = double (done.rig->now ()) * 1e-9;
  return done;
}

/** A bench of 8 bits for even seeds, and of 12 for odd ones. */
inline SickBenchOptions
healthy_bench (int seed)
{
  SickBenchOptions like;
  like.bits = seed % 2 == 0 ? 8 : 12;
  return random_healthy_bench (std::uint64_t (seed), like);
}

/** healthy_bench () with the faults @p words. */
inline SickBenchOptions
sick_bench (int seed, const std::string &words)
{
  SickBenchOptions options = healthy_bench (seed);
  const auto done = inflict (options, words);
  EXPECT_TRUE (done) << (done ? "" : done.error ().message);
  return options;
}

/** Expects that the first diagnosis is the name of the fault: of @p words, the
 * first one without its value. */
inline void
expect_named (const std::string &words,
    Result<Finding> (*check) (Examination &examination))
{
  static int seed = 1000;
  const CheckedBench e = check_bench (sick_bench (seed++, words), check);
  EXPECT_EQ (e.first_diagnosis (), words.substr (0, words.find ('=')))
      << words << " of bench " << seed - 1;
}

} // namespace codedexposure::test
