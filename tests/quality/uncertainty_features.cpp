/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Writes what the uncertainty of fused pixels is computed from, and their
 * errors, for tests/quality/uncertainty. */
#include <array>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <random>

#include <glib.h>

#include "footage.h"
#include "fuse/engine.h"
#include "fusion_figures.h"
#include "must.h"
#include "partner_figures.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::quality;

/* One pixel, as float32: quality, slots, noisy, number of the scene, measured,
 * cameras, then the logarithms of A, D, L and V, N, the error in grey levels,
 * and the deviation by which the library says that it is expected. */
using Record = std::array<float, 13>;

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

/* What is looked at beside an aligned camera with a sharp lens. */
struct Setting {
  double blur = 0.0;     ///< of all lenses, which mappings have, px
  bool own_view = false; ///< of the second camera
};

Condition
condition_of (bool noisy, double blur)
{
  Condition condition =
      noisy ? Condition{.electrons = 10000.0, .read_noise = 5.0} : Condition{};
  condition.blur = blur;
  return condition;
}

/* Frames of the second camera as the fusion gets them. */
struct Partners {
  std::vector<Picture> frames;
  std::vector<Image<float>> errors; ///< none without a mapping
};

Partners
take_partners (const Scene &scene, const Schedule &schedule,
    const std::vector<Picture> &coded, Condition second, const Setting &setting)
{
  second.mapped = setting.blur > 0.0;
  if (setting.own_view)
    second = of_own_view (second);
  Partners partners;
  partners.frames =
      take (scene, must (schedule.complement ()), second, &partners.errors);
  if (second.mapped)
    correct_partners (
        partners.frames, coded, schedule, second, &partners.errors);
  return partners;
}

void
set_partner (
    const Partners &partners, std::size_t number, fuse::CodedFrame &frame)
{
  const Picture &seen = partners.frames[number];
  const int width = seen.width (), height = seen.height ();
  frame.has_partner = true;
  if (!partners.errors.empty ())
    frame.partner.errors = Field (width, height);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++) {
      frame.partner.light.row (y)[x] = seen.at (x, y) / float (kWhiteOfSecond);
      if (!partners.errors.empty ())
        frame.partner.errors.row (y)[x] = float (
            std::pow (partners.errors[number].at (x, y) / kWhiteOfSecond, 2));
    }
}

/* A sixteenth of the pixels that are not static. */
void
write_features (const Scene &scene, int number, int n, bool noisy, bool both,
    FuseQuality quality, const Setting &setting)
{
  const Condition condition = condition_of (noisy, setting.blur);
  const Schedule schedule = fusion_schedule (n);
  const auto coded = take (scene, schedule, condition);
  FuseOptions options;
  options.quality =
      quality == FuseQuality::kLearned ? FuseQuality::kBest : quality;
  options.refine = quality == FuseQuality::kLearned;
  options.noise = {condition.electrons, condition.read_noise};
  options.partner = both;
  const int width = coded[0].width (), height = coded[0].height ();
  Partners partners;
  if (both)
    partners = take_partners (
        scene, schedule, coded, second_camera (condition, n), setting);
  std::optional<Schedule> complement;
  if (both)
    complement = must (schedule.complement ());
  auto engine = must (fuse::Engine::make (schedule,
      complement ? &*complement : nullptr, width, height, options, 255.0, {}));

  Workers workers (1);
  std::mt19937 dice (std::mt19937::result_type (100 * number + n));
  for (std::size_t frame = 0; frame < coded.size (); frame++) {
    fuse::CodedFrame &next = engine->stream ().next ();
    for (int y = 0; y < height; y++)
      for (int x = 0; x < width; x++)
        next.light.row (y)[x] = coded[frame].at (x, y);
    if (both)
      set_partner (partners, frame, next);
    if (setting.blur > 0.0) {
      const Corrected seen = corrected (coded[frame], schedule, condition);
      next.errors = Field (width, height);
      for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
          next.light.row (y)[x] = seen.frame.at (x, y);
          next.errors.row (y)[x] =
              seen.errors.at (x, y) * seen.errors.at (x, y);
        }
    }
    engine->stream ().take ();
    std::vector<Field> fused (std::size_t (n), Field (width, height));
    const auto write = [&] (const fuse::Uncertainty::Row &row) {
      const Picture &truth =
          scene.frames[frame * std::size_t (n) + std::size_t (row.slot)];
      const float *light_of_slot = fused[std::size_t (row.slot)].row (row.y);
      for (int x = 0; x < width; x++) {
        const unsigned drawn = dice ();
        const auto &p = row.pixels[x];
        const int border = setting.own_view ? kWideBorder : 0;
        if (drawn % 16 != 0 || std::min (x, row.y) < border ||
            std::max (x - width, row.y - height) >= -border ||
            row.is_static[x] > 0.0f ||
            (p.measured && !noisy && setting.blur == 0.0))
          continue;
        /* The scene is rounded; where in its grey level the light was is not
         * known. */
        const float within = float (drawn >> 8) / 16777216.0f - 0.5f;
        const Record record{float (int (quality)), float (n), float (noisy),
            float (number), float (p.measured), float (1 + both), p.misfit,
            p.change, p.roughness, p.geometry, p.noise,
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
        {workers, {}}, write);
  }
}

} // namespace

/* uncertainty_features FOLDER|drawn [BLUR|own-view]: raw clips with a
 * manifest.json, or the project's own drawn scenes; of aligned cameras, whose
 * lenses have a blur that is known, px, or of a second camera with a view of
 * its own. */
int
main (int argc, char **argv)
{
  if (argc != 2 && argc != 3)
    return 2;
  Setting setting;
  setting.own_view = argc > 2 && std::string (argv[2]) == "own-view";
  if (argc > 2 && !setting.own_view)
    setting.blur = g_ascii_strtod (argv[2], nullptr);
  std::vector<Scene> scenes;
  if (std::string (argv[1]) == "drawn") {
    scenes.push_back (synthetic_scene (160, 128, kFrames));
    for (unsigned seed = 1; seed <= 8; seed++)
      scenes.push_back (leaves_scene (seed, 160, kFrames));
  } else {
    scenes = must (read_clips (argv[1], kFrames));
  }
  int number = 0;
  for (const Scene &scene : scenes) {
    number++;
    for (const int n : {4, 8})
      for (const bool noisy : {false, true})
        for (const bool both : {false, true})
          for (const FuseQuality quality :
              {FuseQuality::kFast, FuseQuality::kBalanced, FuseQuality::kBest,
                  FuseQuality::kLearned})
            write_features (
                cropped (scene), number, n, noisy, both, quality, setting);
    std::cerr << scene.name << '\n';
  }
  return 0;
}
