/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure advise: recommends a schedule. */
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "advise/advice.h"
#include "base/text.h"
#include "base/try.h"
#include "setup/bench_profile.h"
#include "tools/tool.h"

namespace codedexposure::tool
{

namespace
{

struct Arguments {
  Conditions conditions;
  std::vector<std::string> schedules;
  std::string size = "768x576";
  std::string readout = "0";
  std::string bench;
  /** On the command line, and not to be taken from the bench profile. */
  bool size_given = false, full_well_given = false, read_noise_given = false,
       bits_given = false;
  double min_rate = 0.0;
};

/** The prediction for a schedule, or the reason why it cannot be used. */
struct Finding {
  std::string text;
  Result<Prediction> prediction;
};

/** The schedules to compare: those on the command line, else the usual ones. */
std::vector<Schedule>
candidates (const Arguments &arguments, const DmdInfo &board)
{
  const Nanoseconds readout =
      value_of (parse_time (arguments.readout), Exit::usage);
  if (arguments.schedules.empty ())
    return usual_schedules (board.minimum_switching, readout);
  std::vector<Schedule> schedules;
  for (const std::string &text : arguments.schedules)
    schedules.push_back (value_of (Schedule::parse (text), Exit::usage));
  return schedules;
}

/** Takes over from the bench profile what is not on the command line. */
void
use_bench (Session &session, Arguments &arguments, const BenchProfile &bench)
{
  Camera &camera = arguments.conditions.camera;
  if (!arguments.size_given)
    arguments.size = size_text (bench.camera.size);
  if (!arguments.bits_given)
    camera.bits = bench.bits;
  if (bench.read_noise && !arguments.read_noise_given)
    camera.noise.read_noise = bench.read_noise->value;
  if (!arguments.full_well_given) {
    if (bench.full_well)
      camera.noise.full_well = bench.full_well->value;
    else if (const auto electrons = bench.electrons_per_number ())
      camera.noise.full_well = *electrons * (bench.largest () - bench.black ());
  }
  if (const auto old = bench.why_old (now_utc ()))
    session.say (*old);
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
reason (const Prediction *best, const Arguments &arguments)
{
  char text[200];
  if (!best)
    std::snprintf (text, sizeof text,
        "none of these reaches %g frames/s without overexposure; use a lower "
        "--min-rate or less light",
        arguments.min_rate);
  else if (!best->schedule)
    std::snprintf (text, sizeof text,
        "recommended: no masks; at %g pixels/s the camera is fast enough",
        arguments.conditions.scene.speed);
  else
    std::snprintf (text, sizeof text,
        "recommended: %s; it has the highest PSNR for a scene of %g pixels/s",
        best->text ().c_str (), arguments.conditions.scene.speed);
  return text;
}

void
show (Session &session, const Arguments &arguments,
    const std::vector<Finding> &findings)
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
  if (session.json) {
    session.print ({{"schedules", list},
        {"recommended", best ? Json (best->text ()) : Json ()},
        {"reason", why}});
  } else {
    print_table (findings);
    std::printf ("\n%s\n", why.c_str ());
  }
  if (!best)
    session.exit = Exit::does_not_fit;
}

void
advise (Session &session, Arguments arguments)
{
  Conditions &conditions = arguments.conditions;
  std::optional<BenchProfile> bench;
  if (!arguments.bench.empty ()) {
    bench = value_of (BenchProfile::parse (arguments.bench), Exit::usage);
    use_bench (session, arguments, *bench);
  }
  const auto size = parse_size (arguments.size);
  if (!size)
    throw Failure{
        Exit::usage, Error{"cannot use " + in_quotes (arguments.size) +
                           " as a size; use WIDTHxHEIGHT, such as 768x576"}};
  conditions.camera.size = *size;
  conditions.camera.rate = parse_rate (session.rate);
  const DmdInfo board = find_board (session.board);
  auto schedules = candidates (arguments, board);
  if (bench)
    for (Schedule &schedule : schedules)
      schedule = value_of (bench->with_leak (schedule), Exit::usage);
  /* The prediction without masks fails only if the conditions are invalid. */
  const Prediction none =
      value_of (predict (std::nullopt, conditions), Exit::usage);

  std::vector<Finding> findings{{none.text (), none}};
  for (const Schedule &schedule : schedules) {
    if (session.stop.stop_requested ())
      throw Failure{Exit::interrupted, Error{"interrupted"}};
    findings.push_back (
        {schedule.text (), predict_on (board, schedule, conditions)});
  }
  show (session, arguments, findings);
}

} // namespace

Command
advise_command (Session &session)
{
  const auto arguments = std::make_shared<Arguments> ();
  auto &[camera, light, scene] = arguments->conditions;
  return {.name = "advise",
      .help = "Predict the accuracy of schedules and recommend one",
      .options =
          {
              {"schedules", &arguments->schedules,
                  "CODE:TILE[,key=value...] or JSON files; default: the usual "
                  "ones"},
              {"--bench", &arguments->bench,
                  "Bench profile with size, bits, full well, read noise and "
                  "leakage; other options and a leak of a schedule win"},
              {"--size", &arguments->size, "Size of the camera, WIDTHxHEIGHT",
                  &arguments->size_given},
              rate_option (session),
              {"--full-well", &camera.noise.full_well,
                  "Full-well capacity of a pixel, e-",
                  &arguments->full_well_given},
              {"--read-noise", &camera.noise.read_noise, "Read noise, e- rms",
                  &arguments->read_noise_given},
              {"--bits", &camera.bits, "Bits of a pixel",
                  &arguments->bits_given},
              {"--readout", &arguments->readout,
                  "Dead time of the camera at the end of a frame, such as "
                  "500us"},
              board_option (session),
              {"--light", &light,
                  "Electrons at white in a frame without masks, as a part of "
                  "the full well"},
              {"--speed", &scene.speed,
                  "Speed of motion, pixels of the coded frame per second"},
              {"--detail", &scene.detail,
                  "Size of details, pixels of the coded frame"},
              {"--contrast", &scene.contrast,
                  "Standard deviation of the scene, as a part of white"},
              {"--level", &scene.level,
                  "Mean of the scene, as a part of white"},
              {"--min-rate,--least-rate", &arguments->min_rate,
                  "Min subframes/s"},
          },
      .run = [&session, arguments] { advise (session, *arguments); }};
}

} // namespace codedexposure::tool
