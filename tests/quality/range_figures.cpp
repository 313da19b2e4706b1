/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Highlights with a second camera behind a grey filter. */
#include "partner_figures.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "bench/bench.h"
#include "fusion_figures.h"
#include "must.h"

namespace codedexposure::quality
{

namespace
{

using Wide = Image<std::uint16_t>;

constexpr int kSlots = 4, kFrames = 8, kBorder = 8, kBits = 12;
constexpr double kWell = 10000.0, kReadNoise = 5.0;
constexpr double kWideWhite = 65535.0, kWhiteOfFrames = 4095.0;

/** Light from 160 grey levels on is stretched, so that white is `range` times
 * as bright. */
class Highlights
{
public:
  explicit Highlights (int range) : curve_ ((range - 1) * 255.0 / (95 * 95)) {}

  /** Both in grey levels. */
  double light (double level) const
  {
    const double above = std::max (level - kFirst, 0.0);
    return level + curve_ * above * above;
  }
  double level (double light) const
  {
    if (curve_ <= 0.0 || light <= kFirst)
      return light;
    return kFirst + (std::sqrt (1.0 + 4.0 * curve_ * (light - kFirst)) - 1.0) /
                        (2.0 * curve_);
  }

private:
  static constexpr double kFirst = 160.0;
  double curve_;
};

/** A camera before a scene whose white is `white` grey levels. */
struct Camera {
  double full_scale; ///< grey levels that are white in a coded frame
  double electrons;  ///< of the scene's white in a whole exposure
  std::uint64_t seed;
};

std::vector<Wide>
record (const std::vector<Wide> &slots, double white, const Schedule &schedule,
    const Camera &camera)
{
  BenchOptions options;
  options.bits = kBits;
  options.full_well = camera.electrons;
  options.read_noise = kReadNoise;
  options.gain =
      white / camera.full_scale * schedule.slots () / schedule.white_slots ();
  options.seed = camera.seed;
  const int width = slots.front ().width (), height = slots.front ().height ();
  auto bench = must (OpticalBench::make (width, height, options));
  std::vector<Wide> coded;
  for (std::size_t at = 0; at + kSlots <= slots.size (); at += kSlots) {
    bench.begin (schedule);
    for (int s = 0; s < kSlots; s++)
      bench.expose (slots[at + std::size_t (s)].view (), s, 1.0);
    bench.read_out (coded.size (), coded.emplace_back (width, height).view ());
  }
  return coded;
}

/* PSNR of levels. @partners: none, or one for each. @unit: grey levels that are
 * white in fused frames. */
double
psnr_of (const std::vector<Wide> &coded, const std::vector<Wide> &partners,
    const FuseOptions &options, double unit, const Highlights &highlights,
    const Scene &scene)
{
  const int width = coded.front ().width (), height = coded.front ().height ();
  auto fuser = must (Fuser<std::uint16_t>::make (
      fusion_schedule (kSlots), width, height, options));
  std::vector<Wide> fused (kSlots, Wide (width, height));
  std::vector<ImageView<std::uint16_t>> views;
  for (Wide &frame : fused)
    views.push_back (frame.view ());
  double sum = 0.0;
  for (std::size_t i = 0; i < coded.size (); i++) {
    std::optional<ImageView<const std::uint16_t>> partner;
    if (!partners.empty ())
      partner = partners[i].view ();
    must (fuser.take (coded[i].view (), partner));
    must (fuser.fuse (views));
    for (std::size_t s = 0; s < kSlots; s++) {
      const Picture &truth = scene.frames[i * kSlots + s];
      PooledError error;
      for (int y = kBorder; y < height - kBorder; y++)
        for (int x = kBorder; x < width - kBorder; x++)
          error.add (
              highlights.level (unit * fused[s].at (x, y) / kWhiteOfFrames),
              truth.at (x, y));
      sum += error.psnr ();
    }
  }
  return sum / double (coded.size () * kSlots);
}

/* With one camera whose white is that of the scene without highlights, with one
 * whose white is `range` times that, with the first and a second one behind a
 * filter, and with that one and a first which no highlight saturates. */
std::array<double, 4>
figures (const Scene &scene, int range, bool stretched)
{
  const Highlights highlights (stretched ? range : 1);
  const double white = 255.0 * range;
  std::vector<Wide> slots;
  for (int i = 0; i < kFrames; i++) {
    const Picture &levels = scene.frames[std::size_t (i)];
    Wide &light = slots.emplace_back (levels.width (), levels.height ());
    for (int y = 0; y < levels.height (); y++)
      for (int x = 0; x < levels.width (); x++)
        light.at (x, y) = std::uint16_t (std::lround (
            highlights.light (levels.at (x, y)) / white * kWideWhite));
  }
  const Schedule schedule = fusion_schedule (kSlots);
  const Schedule complement = must (schedule.complement ());
  FuseOptions options;
  options.bits = kBits;
  options.noise = {kWell, kReadNoise};
  const auto first = record (slots, white, schedule, {255.0, range * kWell, 0});
  const auto dim = record (slots, white, schedule, {white, kWell, 0});
  const double one = psnr_of (first, {}, options, 255.0, highlights, scene);
  const double darker = psnr_of (dim, {}, options, white, highlights, scene);
  options.partner = true;
  options.range = range;
  options.partner_noise = {kWell / range, kReadNoise};
  const auto second =
      record (slots, white, complement, {white / 0.95, kWell, 1});
  const double both =
      psnr_of (first, second, options, white, highlights, scene);
  const auto deep = record (slots, white, schedule, {white, range * kWell, 0});
  options.range = 1;
  options.noise = {range * kWell, kReadNoise};
  return {one, darker, both,
      psnr_of (deep, second, options, white, highlights, scene)};
}

} // namespace

Table
partner_range_table (const std::vector<Scene> &scenes, const Progress &progress)
{
  Table table{"partner-range",
      "PSNR (dB) of fast at n = 4, noisy, 12 bits, of grey levels up to "
      "white, with highlights of so many times white and without any, mean "
      "over "
      "scenes",
      {{"highlights"}, {"scene"}, {"one camera, white as without", 2},
          {"one, white is the highlights'", 2},
          {"one and a second behind a filter", 2},
          {"the same, if nothing saturated the first", 2}},
      {}};
  for (const int range : {4, 8})
    for (const bool stretched : {false, true}) {
      progress ("highlights of " + std::to_string (range));
      std::array<double, 4> mean{};
      for (const Scene &scene : scenes) {
        const auto of_scene = figures (scene, range, stretched);
        for (std::size_t i = 0; i < mean.size (); i++)
          mean[i] += of_scene[i] / double (scenes.size ());
      }
      table.rows.push_back ({std::to_string (range) + " times",
          stretched ? "with" : "without", mean[0], mean[1], mean[2], mean[3]});
    }
  return table;
}

} // namespace codedexposure::quality
