/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure advise: recommends a schedule. */
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "advise/advice.h"
#include "base/text.h"
#include "base/try.h"
#include "command.h"
#include "options/board.h"
#include "pipeline/messages.h"
#include "setup/bench_profile.h"

namespace codedexposure::app
{

namespace
{

struct Advise : Printing, BoardOptions {
  void declare (Options &options);
  Exit run ();

  Conditions conditions;
  std::vector<std::string> schedules;
  Nanoseconds readout = 0;
  std::optional<Text> bench;
  /* In place of those of the bench profile: */
  std::optional<Extent> size;
  std::optional<double> full_well, read_noise;
  std::optional<int> bits;
  double min_rate = 0.0;
};

/** The prediction for a schedule, or the reason why it cannot be used. */
struct Finding {
  std::string text;
  Result<Prediction> prediction;
};

/** The schedules to compare: those on the command line, else the usual ones. */
std::vector<Schedule>
candidates (const Advise &arguments, const DmdInfo &board)
{
  if (arguments.schedules.empty ())
    return usual_schedules (board.minimum_switching, arguments.readout);
  std::vector<Schedule> schedules;
  for (const std::string &text : arguments.schedules)
    schedules.push_back (value_of (Schedule::parse (text), Exit::usage));
  return schedules;
}

void
use_bench (Camera &camera, const BenchProfile &bench)
{
  camera.size = bench.camera.size;
  camera.bits = bench.bits;
  if (bench.read_noise)
    camera.noise.read_noise = bench.read_noise->value;
  if (bench.full_well)
    camera.noise.full_well = bench.full_well->value;
  else if (const auto electrons = bench.electrons_per_number ())
    camera.noise.full_well = *electrons * (bench.largest () - bench.black ());
}

/** What is on the command line wins over the bench profile. */
void
use_options (Camera &camera, const Advise &arguments)
{
  camera.size = arguments.size.value_or (camera.size);
  camera.bits = arguments.bits.value_or (camera.bits);
  camera.noise.full_well =
      arguments.full_well.value_or (camera.noise.full_well);
  camera.noise.read_noise =
      arguments.read_noise.value_or (camera.noise.read_noise);
  camera.rate = arguments.rate;
}

Result<Prediction>
predict_on (const DmdInfo &board, const Schedule &schedule,
    const Conditions &conditions)
{
  ASSIGN_OR_RETURN (
      const SlotPlan plan, SlotPlan::fit (schedule.timing (), schedule.slots (),
                               conditions.camera.rate));
  RETURN_IF_ERROR (check_limits (board, schedule, plan));
  return predict (schedule, conditions);
}

double
rounded (double value, int digits)
{
  const double scale = std::pow (10.0, digits);
  return std::round (value * scale) / scale;
}

Json
describe (const Prediction &p)
{
  Json json = {{"schedule", p.text ()}, {"fits", true},
      {"frame_rate", rounded (p.frame_rate, 3)},
      {"subframe", {p.subframe.width, p.subframe.height}},
      {"light_efficiency", rounded (p.efficiency, 4)},
      {"slot_electrons", rounded (p.slot_electrons, 1)},
      {"snr_white_db", rounded (p.snr_white, 2)},
      {"snr_grey_db", rounded (p.snr_grey, 2)},
      {"psnr_db", rounded (p.psnr, 2)}, {"overexposed", p.overexposed}};
  for (const Prediction &part : p.parts)
    json["parts"].push_back (describe (part));
  return json;
}

Json
describe (const Finding &finding)
{
  if (!finding.prediction)
    return {{"schedule", finding.text}, {"fits", false},
        {"trouble", finding.prediction.error ().message}};
  return describe (*finding.prediction);
}

void
print_row (int column, const std::string &name, const Prediction &p)
{
  std::printf ("%-*s %8.5g %5dx%-4d %5.1f%% %6.1f dB %6.1f dB %6.1f dB%s\n",
      column, name.c_str (), p.frame_rate, p.subframe.width, p.subframe.height,
      100 * p.efficiency, p.snr_white, p.snr_grey, p.psnr,
      p.overexposed ? "  overexposed" : "");
}

void
print_table (const std::vector<Finding> &findings)
{
  std::size_t width = 8;
  for (const Finding &finding : findings)
    width = std::max (width, finding.text.size ());
  const int column = int (width);
  std::printf ("%-*s %8s %10s %6s %9s %9s %9s\n", column, "schedule", "fps",
      "subframes", "light", "SNR white", "SNR grey", "PSNR");
  for (const Finding &finding : findings) {
    if (!finding.prediction) {
      std::printf ("%-*s %s\n", column, finding.text.c_str (),
          finding.prediction.error ().message.c_str ());
      continue;
    }
    print_row (column, finding.text, *finding.prediction);
    for (std::size_t i = 0; i < finding.prediction->parts.size (); i++)
      print_row (column,
          i == 0 ? "  background" : "  region " + std::to_string (i - 1),
          finding.prediction->parts[i]);
  }
}

/* Explains the recommendation. */
std::string
reason (const Prediction *best, const Advise &arguments)
{
  if (!best)
    return format (
        "none of these reaches %g frames/s without overexposure; use a lower "
        "--min-rate or less light",
        arguments.min_rate);
  const double speed = arguments.conditions.scene.speed;
  if (!best->schedule)
    return format ("recommended: no masks; at %g pixels/s the camera is fast "
                   "enough",
        speed);
  return format (
      "recommended: %s; it has the highest PSNR for a scene of %g pixels/s",
      best->text ().c_str (), speed);
}

Exit
show (const Advise &arguments, const std::vector<Finding> &findings)
{
  std::vector<Prediction> predictions;
  Json list = Json::array ();
  for (const Finding &finding : findings) {
    if (finding.prediction)
      predictions.push_back (*finding.prediction);
    list.push_back (describe (finding));
  }
  const Prediction *best = recommend (predictions, arguments.min_rate);
  const std::string why = reason (best, arguments);
  if (arguments.json) {
    arguments.print ({{"schedules", list},
        {"recommended", best ? Json (best->text ()) : Json ()},
        {"reason", why}});
  } else {
    print_table (findings);
    std::printf ("\n%s\n", why.c_str ());
  }
  return best ? Exit::done : Exit::does_not_fit;
}

Exit
Advise::run ()
{
  const std::stop_token stop = stop_at_signals ();
  std::optional<BenchProfile> profile;
  if (bench) {
    profile = value_of (BenchProfile::parse (*bench), Exit::usage);
    use_bench (conditions.camera, *profile);
    if (const auto old = profile->why_doubtful (now_utc ()))
      say (*old);
  }
  use_options (conditions.camera, *this);
  const DmdInfo board = info ();
  auto compared = candidates (*this, board);
  if (profile)
    for (Schedule &schedule : compared)
      schedule = value_of (profile->with_leak (schedule), Exit::usage);
  /* The prediction without masks fails only if the conditions are invalid. */
  const Prediction none =
      value_of (predict (std::nullopt, conditions), Exit::usage);

  std::vector<Finding> findings{{none.text (), none}};
  for (const Schedule &schedule : compared) {
    if (stop.stop_requested ())
      fail ("interrupted", Exit::interrupted);
    findings.push_back (
        {schedule.text (), predict_on (board, schedule, conditions)});
  }
  return show (*this, findings);
}

void
Advise::declare (Options &options)
{
  constexpr double kMost = 1e12;
  const Rule<double> at_least_0 = real (0, kMost, "a number of at least 0");
  options.words (schedules);
  options.heading ("");
  options.value ("--bench", bench, "FILE",
      "bench profile with size, bits, full well, read noise and leakage; other "
      "options and a leak of a schedule win");
  options.value (
      "--size", size, "WxH", "size of the camera [768x576]", picture_size ());
  declare_rate (options);
  options.value ("--full-well", full_well, "E",
      "full-well capacity of a pixel, e- [10000]", at_least_0);
  options.value (
      "--read-noise", read_noise, "E", "read noise, e- rms [5]", at_least_0);
  options.value ("--bits", bits, "N", "bits of a pixel [8]", whole (1, 16));
  options.value ("--readout", readout, "TIME",
      "dead time of the camera at the end of a frame, such as 500us [0]",
      time_rule ());
  declare_board (options);
  options.value ("--light", conditions.light, "F",
      "electrons at white in a frame without masks, as a part of the full well "
      "[1]",
      at_least_0);
  options.value ("--speed", conditions.scene.speed, "V",
      "speed of motion, pixels of the coded frame per second", at_least_0);
  options.value ("--detail", conditions.scene.detail, "P",
      "size of details, pixels of the coded frame", at_least_0);
  options.value ("--contrast", conditions.scene.contrast, "F",
      "standard deviation of the scene, as a part of white", at_least_0);
  options.value ("--level", conditions.scene.level, "F",
      "mean of the scene, as a part of white", at_least_0);
  options.value (
      "--min-rate", min_rate, "R", "min subframes/s [0]", at_least_0);
  Printing::declare (options);
}

} // namespace

Command
advise_command ()
{
  return make_command<Advise> ({.name = "advise",
      .summary = "predict the accuracy of schedules and recommend one",
      .usage = "[option...] [SCHEDULE...]",
      .description = R"(
Predicts the accuracy of schedules [the usual ones] for a camera, its light and
a scene, and recommends one. Exit status 4: none can be recommended.
)",
      .notes = R"(
Examples:
  The best schedule for a fast scene with little light:
    codedexposure advise --speed 400 --light 0.3 --dmd dlp3000
)"});
}

} // namespace codedexposure::app
