/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the checks of a bench measure against what was injected: one line of
 * JSON for each number of each simulated bench. */
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <random>
#include <string>

#include <CLI/CLI.hpp>

#include "bench/simulated_rig.h"
#include "doctor/checks.h"

using namespace codedexposure;

namespace
{

/** One bench; numbers that a healthy one does not have are injected in turn. */
class FiguresOfBench
{
public:
  FiguresOfBench (int seed, int bits, Extent camera) : seed_ (seed)
  {
    like_.bits = bits;
    like_.camera = camera;
    like_.mirrors = {camera.width + 32, camera.height + 32};
    random_.seed (std::uint64_t (seed) + 0x5EED);
  }

  void healthy ();
  void flicker ();
  void exposure ();
  void bow ();
  void leak ();
  void focus_tilt ();

private:
  struct Seen {
    std::unique_ptr<SimulatedRig> rig;
    std::unique_ptr<Examination> examination;
    std::vector<Finding> findings;

    const BenchProfile &truth () const { return rig->truth ().profile; }
    const BenchProfile &profile () const { return examination->profile; }
    const SickBenchOptions &options () const { return rig->truth ().options; }
    std::optional<Measured> number (const char *name) const;
  };
  using Run = Result<Finding> (*) (Examination &);

  double any (double low, double high)
  {
    return low + (high - low) * double (random_ () >> 11) * 0x1p-53;
  }
  Seen examine (const SickBenchOptions &options, std::vector<Run> checks) const;
  SickBenchOptions bench () const
  {
    return random_healthy_bench (std::uint64_t (seed_), like_);
  }
  void print (const char *name, double injected,
      const std::optional<Measured> &found, double scale = 1.0) const;

  int seed_;
  SickBenchOptions like_;
  std::mt19937_64 random_;
};

template <typename T>
T
must (Result<T> result)
{
  if (result)
    return *std::move (result);
  std::fprintf (
      stderr, "doctor_figures: %s\n", result.error ().message.c_str ());
  std::exit (1);
}

std::optional<Measured>
FiguresOfBench::Seen::number (const char *name) const
{
  for (const Finding &finding : findings)
    if (const Reading *reading = finding.reading (name))
      return reading->number;
  return std::nullopt;
}

FiguresOfBench::Seen
FiguresOfBench::examine (
    const SickBenchOptions &options, std::vector<Run> checks) const
{
  Seen seen;
  seen.rig = must (SimulatedRig::make (options));
  seen.examination = std::make_unique<Examination> (Examination{*seen.rig});
  seen.examination->exhibits = false;
  for (const Run check : checks)
    seen.findings.push_back (must (check (*seen.examination)));
  return seen;
}

void
FiguresOfBench::print (const char *name, double injected,
    const std::optional<Measured> &found, double scale) const
{
  std::printf ("{\"bench\": %d, \"bits\": %d, \"name\": \"%s\", "
               "\"injected\": %.9g, ",
      seed_, like_.bits, name, injected * scale);
  if (found)
    std::printf ("\"found\": %.9g, \"sigma\": %.9g}\n", found->value * scale,
        found->sigma * scale);
  else
    std::printf ("\"found\": null}\n");
  std::fflush (stdout);
}

void
FiguresOfBench::healthy ()
{
  const Seen seen = examine (
      bench (), {check_trigger, check_light, check_sensor, check_mirrors});
  const BenchProfile &truth = seen.truth (), &found = seen.profile ();
  print (
      "conversion gain", truth.conversion_gain->value, found.conversion_gain);
  print ("full well", truth.full_well->value, found.full_well);
  print ("read noise", truth.read_noise->value, found.read_noise);
  print ("black level", truth.black_level->value, found.black_level);
  print ("delay", truth.trigger_delay->value, found.trigger_delay, 1e-3);
  print ("exposure", truth.exposure->value, found.exposure, 1e-3);
  print ("leakage", truth.leak->value, found.leak, 100.0);
}

void
FiguresOfBench::leak ()
{
  SickBenchOptions options = bench ();
  options.leak = any (0.0, 0.05);
  const Seen seen = examine (
      options, {check_trigger, check_light, check_sensor, check_mirrors});
  print ("leakage, up to 5 %", options.leak, seen.profile ().leak, 100.0);
}

void
FiguresOfBench::exposure ()
{
  SickBenchOptions options = bench ();
  options.late = Nanoseconds (any (0, 8e6));
  options.ends_early = Nanoseconds (any (-5e6, 5e6));
  const Seen seen = examine (options, {check_trigger});
  print ("delay, up to 8 ms", seen.truth ().trigger_delay->value,
      seen.profile ().trigger_delay, 1e-3);
  print ("exposure, up to 5 ms off", seen.truth ().exposure->value,
      seen.profile ().exposure, 1e-3);
}

void
FiguresOfBench::flicker ()
{
  SickBenchOptions options = bench ();
  const double rates[] = {100.0, 120.0, any (1, 500), any (1, 500)};
  options.flicker_rate = rates[seed_ % 4];
  options.flicker_depth = any (0.01, 0.2);
  const Seen seen = examine (options, {check_trigger, check_light});
  print ("flicker frequency", options.flicker_rate,
      seen.number ("frequency of the flicker"));
  print (
      "flicker depth", options.flicker_depth * 100.0, seen.number ("flicker"));
}

void
FiguresOfBench::bow ()
{
  SickBenchOptions options = bench ();
  options.nonlinear = any (-0.05, 0.05);
  const Seen seen =
      examine (options, {check_trigger, check_light, check_sensor});
  print ("linearity error", std::abs (options.nonlinear),
      seen.profile ().linearity_error, 100.0);
}

void
FiguresOfBench::focus_tilt ()
{
  SickBenchOptions options = bench ();
  options.focus_tilt = any (1.0, 5.0);
  options.focus_direction = any (0.0, 360.0);
  const Seen seen =
      examine (options, {check_trigger, check_light, check_optics});
  auto direction = seen.number ("direction of the growth");
  if (direction)
    direction->value =
        options.focus_direction +
        std::remainder (direction->value - options.focus_direction, 360.0);
  print ("tilt direction", options.focus_direction, direction);
}

} // namespace

int
main (int argc, char **argv)
{
  int first = 1, benches = 1;
  std::string only;
  CLI::App app{
      "Prints what the checks of a bench measure of simulated benches"};
  app.add_option ("--first", first, "seed of the first bench");
  app.add_option ("--benches", benches, "how many");
  app.add_option ("--only", only, "only numbers of this group");
  CLI11_PARSE (app, argc, argv);
  const struct {
    const char *name;
    void (FiguresOfBench::*run) ();
  } groups[] = {{"healthy", &FiguresOfBench::healthy},
      {"exposure", &FiguresOfBench::exposure},
      {"flicker", &FiguresOfBench::flicker}, {"bow", &FiguresOfBench::bow},
      {"leak", &FiguresOfBench::leak}, {"tilt", &FiguresOfBench::focus_tilt}};
  for (int seed = first; seed < first + benches; seed++) {
    FiguresOfBench bench (seed, seed % 2 == 0 ? 8 : 12, {256, 192});
    for (const auto &[name, run] : groups)
      if (only.empty () || only == name)
        (bench.*run) ();
  }
}
