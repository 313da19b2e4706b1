/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Subframes and fused frames of a misaligned camera: the table of
 * docs/calibration.md. */
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "footage.h"
#include "rectify_trial.h"
#include "trial.h"

using namespace codedexposure;
using namespace codedexposure::quality;

namespace
{

/* Max loss in dB of a rectified camera against an aligned one, unless its lens
 * is sharper than this. A sharp lens mixes mirrors only for pixels that see the
 * border between them. */
constexpr double kWorse = 0.3;
constexpr double kSharp = 0.3;

std::string
text_of (const RectifyScore &score, const char *format)
{
  std::string text;
  for (const double figure : {score.point, score.full, score.fused}) {
    char number[32];
    std::snprintf (number, sizeof number, format, figure);
    text += (text.empty () ? "" : " / ") +
            std::string (std::isfinite (figure) ? number : "-");
  }
  return text;
}

bool
print_row (const Scene &scene, const char *preset, double psf_sigma)
{
  const RectifyOutcome o =
      run_rectify (scene, schedule_of (preset), misaligned_bench (psf_sigma));
  const RectifyScore gain = {o.rectified.point - o.aligned.point,
      o.rectified.full - o.aligned.full, o.rectified.fused - o.aligned.fused};
  std::printf ("| %s | `%s` | %.1f ", scene.name.c_str (), preset, psf_sigma);
  for (const RectifyScore *score : {&o.aligned, &o.misaligned, &o.rectified})
    std::printf ("| %s ", text_of (*score, "%.2f").c_str ());
  std::printf (
      "| %s | %.1f |\n", text_of (gain, "%+.2f").c_str (), o.milliseconds);
  std::fflush (stdout);
  return psf_sigma < kSharp ||
         !(gain.point < -kWorse || gain.full < -kWorse || gain.fused < -kWorse);
}

} // namespace

int
main (int argc, char **argv)
{
  CLI::App app ("Subframes of a misaligned camera, with its mapping");
  std::string clips;
  std::vector<double> blurs = {0.3, 0.5, 0.7};
  app.add_option ("--clips", clips, "folder with a manifest.json");
  app.add_option ("--blur", blurs, "between mirrors and pixels, sigma, pixels");
  CLI11_PARSE (app, argc, argv);

  std::vector<Scene> scenes = {synthetic_scene (256, 192, 16)};
  if (!clips.empty ()) {
    auto read = read_clips (clips, 16);
    if (!read) {
      std::fprintf (stderr, "%s\n", read.error ().message.c_str ());
      return 2;
    }
    for (Scene &scene : *read)
      scenes.push_back (std::move (scene));
  }
  std::puts ("| scene | schedule | blur | aligned | misaligned | rectified | "
             "rectified less aligned | ms a frame |\n"
             "|---|---|---|---|---|---|---|---|");
  bool good = true;
  for (const Scene &scene : scenes)
    for (const char *preset : {"sequential:2x2", "sequential:lattice:8/3",
             "sequential:2x2,region=96x64+64+48:sequential:lattice:8/3"})
      for (const double blur : blurs)
        good = print_row (scene, preset, blur) && good;
  return good ? 0 : 1;
}
