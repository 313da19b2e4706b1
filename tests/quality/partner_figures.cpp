/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "partner_figures.h"

#include "fusion_figures.h"
#include "must.h"

namespace codedexposure::quality
{

namespace
{

constexpr int kFrames = 8;
constexpr int kBorder = 8;
constexpr Condition kClean = {};
constexpr Condition kNoisy = {.electrons = 10000.0, .read_noise = 5.0};

double
inner_psnr (const std::vector<Picture> &frames, const Scene &scene)
{
  double sum = 0.0;
  for (std::size_t i = 0; i < frames.size (); i++) {
    const Picture &truth = scene.frames[i];
    PooledError error;
    for (int y = kBorder; y < truth.height () - kBorder; y++)
      for (int x = kBorder; x < truth.width () - kBorder; x++)
        error.add (frames[i].at (x, y), truth.at (x, y));
    sum += std::min (error.psnr (), 99.0);
  }
  return sum / double (frames.size ());
}

BeamGain
mean_gain (const std::vector<Scene> &scenes, int n, FuseQuality quality,
    const Condition &condition, const Condition &partner)
{
  BeamGain mean;
  for (const Scene &scene : scenes) {
    const BeamGain gain = beam_gain (scene, n, quality, condition, partner);
    mean.one += gain.one / double (scenes.size ());
    mean.two += gain.two / double (scenes.size ());
  }
  return mean;
}

/* White is not saturated. */
Condition
second_camera (const Condition &first, int slots)
{
  constexpr double kWhite = 0.95; // of the largest value
  Condition second = first.of_partner ();
  second.gain = kWhite * slots / (slots - 1);
  return second;
}

} // namespace

BeamGain
beam_gain (const Scene &scene, int n, FuseQuality quality,
    const Condition &condition, const Condition &partner)
{
  Scene part = scene;
  part.frames.resize (kFrames);
  const Schedule schedule = fusion_schedule (n);
  FuseOptions options;
  options.quality = quality;
  options.noise = {condition.electrons, condition.read_noise};
  const auto coded = take (part, schedule, condition);
  const auto one = fuse (coded, schedule, options);
  options.partner = true;
  const auto two = fuse (coded, schedule, options,
      take (part, must (schedule.complement ()), partner));
  return {inner_psnr (one, part), inner_psnr (two, part)};
}

std::vector<Table>
partner_tables (const std::vector<Scene> &scenes, const Progress &progress)
{
  std::vector<Table> tables;
  for (const bool noisy : {false, true}) {
    const Condition &condition = noisy ? kNoisy : kClean;
    const std::string name = noisy ? "noisy" : "clean";
    Table &table = tables.emplace_back (Table{"partner-" + name,
        "PSNR (dB) of the first 8 frames with one camera and with two, " + name,
        {{"slots"}, {"quality"}}, {}});
    for (const Scene &scene : scenes)
      table.columns.push_back ({"gain, " + scene.name, 2});
    for (const char *mean : {"mean of one", "of both", "gain"})
      table.columns.push_back ({mean, 2});
    for (const int n : {4, 8})
      for (const FuseQuality quality :
          {FuseQuality::kFast, FuseQuality::kBalanced, FuseQuality::kBest}) {
        progress ("two cameras, " + std::to_string (n) + " slots");
        auto &row = table.rows.emplace_back (std::vector<Cell>{
            std::to_string (n), std::string (quality_name (quality))});
        BeamGain mean;
        for (const Scene &scene : scenes) {
          const BeamGain gain = beam_gain (
              scene, n, quality, condition, second_camera (condition, n));
          row.emplace_back (gain.two - gain.one);
          mean.one += gain.one / double (scenes.size ());
          mean.two += gain.two / double (scenes.size ());
        }
        for (const double mean_of : {mean.one, mean.two, mean.two - mean.one})
          row.emplace_back (mean_of);
      }
  }
  return tables;
}

Table
partner_error_table (const std::vector<Scene> &scenes, const Progress &progress)
{
  struct Error {
    const char *name;
    void (*apply) (Condition &condition, Condition &partner, int slots);
  };
  using C = Condition;
  const Error errors[] = {
      {"none", [] (C &, C &, int) {}},
      {"shift of 0.05 px along both axes",
          [] (C &, C &p, int) { p.shift = 0.05; }},
      {"0.1 px", [] (C &, C &p, int) { p.shift = 0.1; }},
      {"0.25 px", [] (C &, C &p, int) { p.shift = 0.25; }},
      {"blur of 0.3 px", [] (C &, C &p, int) { p.blur = 0.3; }},
      {"light 5 % less", [] (C &, C &p, int) { p.gain *= 0.95; }},
      {"half of the light", [] (C &, C &p, int) { p.gain *= 0.5; }},
      {"white at the largest value", [] (C &, C &p, int) { p.gain = 0.0; }},
      {"black level 5 % of white",
          [] (C &, C &p, int) {
            p.black_level = 12.75;
            p.gain *= 0.95;
          }},
      {"0.3 px of blur on both",
          [] (C &c, C &p, int) { c.blur = p.blur = 0.3; }},
  };
  Table table{"partner-errors",
      "PSNR (dB) of fast with an error of the second camera that is not known, "
      "mean over scenes",
      {{"error"}}, {}};
  for (const int n : {4, 8})
    for (const char *name : {"clean", "noisy"})
      for (const char *cameras : {"one", "both"})
        table.columns.push_back ({std::string (cameras) + ", " + name +
                                      ", n = " + std::to_string (n),
            2});
  for (const Error &error : errors) {
    progress ("second camera: " + std::string (error.name));
    auto &row = table.rows.emplace_back (std::vector<Cell>{error.name});
    for (const int n : {4, 8})
      for (const Condition &usual : {kClean, kNoisy}) {
        Condition condition = usual, partner = second_camera (usual, n);
        error.apply (condition, partner, n);
        const BeamGain gain =
            mean_gain (scenes, n, FuseQuality::kFast, condition, partner);
        row.emplace_back (gain.one);
        row.emplace_back (gain.two);
      }
  }
  return table;
}

} // namespace codedexposure::quality
