/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "partner_figures.h"

#include <span>

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
inner_psnr (const std::vector<Picture> &frames, const Scene &scene, int border)
{
  double sum = 0.0;
  for (std::size_t i = 0; i < frames.size (); i++) {
    const Picture &truth = scene.frames[i];
    PooledError error;
    for (int y = border; y < truth.height () - border; y++)
      for (int x = border; x < truth.width () - border; x++)
        error.add (frames[i].at (x, y), truth.at (x, y));
    sum += std::min (error.psnr (), 99.0);
  }
  return sum / double (frames.size ());
}

BeamGain
mean_gain (const std::vector<Scene> &scenes, int n, FuseQuality quality,
    const Condition &condition, const Condition &partner, int border)
{
  BeamGain mean;
  for (const Scene &scene : scenes) {
    const BeamGain gain =
        beam_gain (scene, n, quality, condition, partner, border);
    mean.one += gain.one / double (scenes.size ());
    mean.two += gain.two / double (scenes.size ());
  }
  return mean;
}

} // namespace

Condition
second_camera (const Condition &first, int slots)
{
  Condition second = first.of_partner ();
  second.gain = kWhiteOfSecond * slots / (slots - 1);
  return second;
}

Condition
of_own_view (Condition second, double stretch, double keystone)
{
  second.view = View{.mirrored = true,
      .shift_x = 0.3,
      .shift_y = 0.4,
      .rotation = 0.5,
      .scale = 1.01,
      .stretch = stretch,
      .keystone = keystone};
  second.blur = 0.3;
  second.mapped = true;
  return second;
}

BeamGain
beam_gain (const Scene &scene, int n, FuseQuality quality,
    const Condition &condition, const Condition &partner, int border)
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
  options.partner_noise = {partner.electrons, partner.read_noise};
  auto partners = take (part, must (schedule.complement ()), partner);
  if (partner.mapped)
    correct_partners (partners, coded, schedule, partner);
  const auto two = fuse (coded, schedule, options, partners);
  return {inner_psnr (one, part, border), inner_psnr (two, part, border)};
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
          {FuseQuality::kFast, FuseQuality::kBalanced, FuseQuality::kBest,
              FuseQuality::kLearned}) {
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

namespace
{

/** What is other than usual with a pair of cameras. */
struct Change {
  const char *name;
  void (*apply) (Condition &condition, Condition &partner, int slots);
};

/* PSNR of fast, a row for each change. */
void
add_rows (Table &table, std::span<const Change> changes,
    const std::vector<Scene> &scenes, int border, const Progress &progress)
{
  for (const int n : {4, 8})
    for (const char *name : {"clean", "noisy"})
      for (const char *cameras : {"one", "both"})
        table.columns.push_back ({std::string (cameras) + ", " + name +
                                      ", n = " + std::to_string (n),
            2});
  for (const Change &change : changes) {
    progress ("second camera: " + std::string (change.name));
    auto &row = table.rows.emplace_back (std::vector<Cell>{change.name});
    for (const int n : {4, 8})
      for (const Condition &usual : {kClean, kNoisy}) {
        Condition condition = usual, partner = second_camera (usual, n);
        change.apply (condition, partner, n);
        const BeamGain gain = mean_gain (
            scenes, n, FuseQuality::kFast, condition, partner, border);
        row.emplace_back (gain.one);
        row.emplace_back (gain.two);
      }
  }
}

} // namespace

Table
partner_error_table (const std::vector<Scene> &scenes, const Progress &progress)
{
  using C = Condition;
  const Change errors[] = {
      {"none", [] (C &, C &, int) {}},
      {"shift of 0.05 px along both axes",
          [] (C &, C &p, int) { p.shift = 0.05; }},
      {"0.1 px", [] (C &, C &p, int) { p.shift = 0.1; }},
      {"0.25 px", [] (C &, C &p, int) { p.shift = 0.25; }},
      {"blur of 0.3 px", [] (C &, C &p, int) { p.blur = 0.3; }},
      {"light 5 % less", [] (C &, C &p, int) { p.gain *= 0.95; }},
      {"half of the light", [] (C &, C &p, int) { p.gain *= 0.5; }},
      {"a filter that passes 1 of n - 1",
          [] (C &, C &p, int slots) { p.electrons /= slots - 1; }},
      {"white at the largest value", [] (C &, C &p, int) { p.gain = 0.0; }},
      {"black level 5 % of white",
          [] (C &, C &p, int) {
            p.black_level = 12.75;
            p.gain *= 0.95;
          }},
      {"0.3 px of blur on both",
          [] (C &c, C &p, int) { c.blur = p.blur = 0.3; }},
      {"the same, which both mappings have",
          [] (C &c, C &p, int) {
            c.blur = p.blur = 0.3;
            c.mapped = p.mapped = true;
          }},
  };
  Table table{"partner-errors",
      "PSNR (dB) of fast with an error of the second camera that is not known, "
      "or a lens, mean over scenes",
      {{"error"}}, {}};
  add_rows (table, errors, scenes, kBorder, progress);
  return table;
}

Table
partner_view_table (const std::vector<Scene> &scenes, const Progress &progress)
{
  using C = Condition;
  const Change views[] = {
      {"as the first camera, no blur", [] (C &, C &, int) {}},
      {"mirror image, 0.5 degrees, 1 %, shift (0.3, 0.4), blur of 0.3 px",
          [] (C &, C &p, int) { p = of_own_view (p); }},
      {"the same, seen at 24 degrees",
          [] (C &, C &p, int) { p = of_own_view (p, 1.05, 0.011); }},
      {"seen at 48 degrees, pixels of 1.5 x 1 mirrors",
          [] (C &, C &p, int) { p = of_own_view (p, 1.5, 0.022); }},
  };
  Table table{"partner-views",
      "PSNR (dB) of fast with a second camera of its own view, which its "
      "mapping "
      "has, mean over scenes, without a border of 24 px",
      {{"view"}}, {}};
  add_rows (table, views, scenes, kWideBorder, progress);
  return table;
}

} // namespace codedexposure::quality
