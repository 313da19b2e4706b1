/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Writes what the uncertainty of fused pixels is computed from, and their
 * errors, for tests/quality/uncertainty. */
#include <array>
#include <cstdio>
#include <iostream>
#include <random>

#include <glib.h>

#include "footage.h"
#include "fuse/engine.h"
#include "fusion_figures.h"
#include "must.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::quality;

/* One pixel, as float32: quality, slots, noisy, number of the scene, measured,
 * then the logarithms of A, D, L and V, N, the error in grey levels, and the
 * deviation by which the library says that it is expected. */
using Record = std::array<float, 12>;

constexpr int kFrames = 16, kSide = 256;

Scene
cropped (const Scene &scene)
{
  Scene part{scene.name, {}};
  for (const Picture &frame : scene.frames) {
    if (part.frames.size () == kFrames)
      break;
    Picture crop (
        std::min (kSide, frame.width ()), std::min (kSide, frame.height ()));
    for (int y = 0; y < crop.height (); y++)
      for (int x = 0; x < crop.width (); x++)
        crop.at (x, y) = frame.at (x, y);
    part.frames.push_back (std::move (crop));
  }
  return part;
}

/* A tenth of the pixels that are not static. @blur: of the lens, px. */
void
write_features (const Scene &scene, int number, int n, bool noisy,
    FuseQuality quality, double blur)
{
  Condition condition =
      noisy ? Condition{.electrons = 10000.0, .read_noise = 5.0} : Condition{};
  condition.blur = blur;
  const Schedule schedule = fusion_schedule (n);
  const auto coded = take (scene, schedule, condition);
  FuseOptions options;
  options.quality =
      quality == FuseQuality::kLearned ? FuseQuality::kBest : quality;
  options.refine = quality == FuseQuality::kLearned;
  options.noise = {condition.electrons, condition.read_noise};
  const int width = coded[0].width (), height = coded[0].height ();
  auto engine = must (fuse::Engine::make (
      schedule, nullptr, width, height, options, 255.0, {}));

  Workers workers (1);
  std::mt19937 dice (std::mt19937::result_type (100 * number + n));
  for (std::size_t frame = 0; frame < coded.size (); frame++) {
    fuse::CodedFrame &next = engine->stream ().next ();
    for (int y = 0; y < height; y++)
      for (int x = 0; x < width; x++)
        next.light.row (y)[x] = coded[frame].at (x, y);
    if (blur > 0.0) {
      const Corrected seen = corrected (coded[frame], schedule, condition);
      next.errors = Field (width, height);
      for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
          next.light.row (y)[x] = seen.frame.at (x, y);
          next.errors.row (y)[x] =
              seen.errors.at (x, y) * seen.errors.at (x, y);
        }
    }
    engine->stream ().take (engine->kernels ());
    std::vector<Field> fused (std::size_t (n), Field (width, height));
    const auto write = [&] (const fuse::Uncertainty::Row &row) {
      const Picture &truth =
          scene.frames[frame * std::size_t (n) + std::size_t (row.slot)];
      const float *light_of_slot = fused[std::size_t (row.slot)].row (row.y);
      for (int x = 0; x < width; x++) {
        const unsigned drawn = dice ();
        const auto &p = row.pixels[x];
        if (drawn % 16 != 0 || row.is_static[x] > 0.0f ||
            (p.measured && !noisy && blur == 0.0))
          continue;
        /* The scene is rounded; where in its grey level the light was is not
         * known. */
        const float within = float (drawn >> 8) / 16777216.0f - 0.5f;
        const Record record{float (int (quality)), float (n), float (noisy),
            float (number), float (p.measured), p.misfit, p.change, p.roughness,
            p.geometry, p.noise,
            light_of_slot[x] - float (truth.at (x, row.y)) + within,
            row.deviations[x]};
        std::fwrite (record.data (), sizeof record, 1, stdout);
      }
    };
    engine->fuse (
        [&] (int y, const float *const *rows) {
          for (int s = 0; s < n; s++)
            std::copy_n (rows[s], width, fused[std::size_t (s)].row (y));
        },
        workers, {}, write);
  }
}

} // namespace

/* uncertainty_features FOLDER|drawn [BLUR]: raw clips with a manifest.json, or
 * the project's own drawn scenes; of an aligned camera, whose lens has a blur
 * that is known, px. */
int
main (int argc, char **argv)
{
  if (argc != 2 && argc != 3)
    return 2;
  const double blur = argc > 2 ? g_ascii_strtod (argv[2], nullptr) : 0.0;
  std::vector<Scene> scenes;
  if (std::string (argv[1]) == "drawn") {
    scenes.push_back (synthetic_scene (160, 128, kFrames));
    for (unsigned seed = 1; seed <= 8; seed++)
      scenes.push_back (leaves_scene (seed, 160, kFrames));
  } else {
    auto clips = read_clips (argv[1], kFrames);

    scenes = *std::move (clips);
  }
  int number = 0;
  for (const Scene &scene : scenes) {
    number++;
    for (const int n : {4, 8})
      for (const bool noisy : {false, true})
        for (const FuseQuality quality :
            {FuseQuality::kFast, FuseQuality::kBalanced, FuseQuality::kBest,
                FuseQuality::kLearned})
          write_features (cropped (scene), number, n, noisy, quality, blur);
    std::cerr << scene.name << '\n';
  }
  return 0;
}
