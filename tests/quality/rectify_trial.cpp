/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Accuracy of subframes and fused frames of a misaligned camera, with and
 * without its mapping. */
#include "rectify_trial.h"

#include <chrono>
#include <iostream>
#include <utility>

#include "calibrate/calibration.h"
#include "extract/extractor.h"
#include "fuse/fuser.h"
#include "moire_bench.h"
#include "must.h"
#include "rectify/rectifier.h"
#include "upsample.h"

namespace codedexposure::quality
{

namespace
{

constexpr int kBorder = 16;

Mapping
measure (Extent size, const BenchOptions &options)
{
  const auto patterns = calibration_patterns (size);
  auto run = must (Calibration::make (size, size, patterns));
  MoireBench bench (options.alignment, options.psf_sigma, size);
  std::uint64_t number = 0;
  for (const Pattern &pattern : patterns) {
    const auto frame = bench.frame (pattern, number++);
    if (const auto added = run.add (pattern, frame.view ()); !added)
      std::cerr << added.error ().message << '\n';
  }
  return must (run.solve ()).mapping;
}

Fuser<std::uint8_t>
make_fuser (const Schedule &schedule, Extent size, const BenchOptions &bench)
{
  FuseOptions options;
  options.noise = {bench.full_well, bench.read_noise};
  return must (
      Fuser<std::uint8_t>::make (schedule, size.width, size.height, options));
}

/* Of the frames of one camera, one after the other. */
struct Errors {
  Fuser<std::uint8_t> fuser;
  PooledError point = {}, full = {}, fused = {};

  Errors (const Schedule &schedule, Extent size, const BenchOptions &options)
      : fuser (make_fuser (schedule, size, options))
  {
  }
  RectifyScore score () const
  {
    return {point.psnr (), full.psnr (), fused.psnr ()};
  }
};

/* Slots of the exposure for which pixel (@x, @y) sees one mask. */
int
held_at (const Schedule &schedule, int x, int y)
{
  const int region = schedule.region_at (x, y);
  const Schedule part =
      region < 0 ? schedule.background () : schedule.region (region);
  return schedule.slots () / part.slots ();
}

/* Mean of the scene at (@x, @y) over the slots of the mask in slot @k. */
double
mean_at (const Picture *slots, int x, int y, int k, int held)
{
  double sum = 0.0;
  for (int s = k / held * held; s < (k / held + 1) * held; s++)
    sum += slots[s].at (x, y);
  return sum / held;
}

/* @slots: the scene in each slot of this exposure. */
void
compare_fused (const Picture &coded, const Picture *slots,
    const Schedule &schedule, Errors &errors)
{
  std::vector<Picture> frames (std::size_t (errors.fuser.slots ()),
      Picture (coded.width (), coded.height ()));
  std::vector<ImageView<std::uint8_t>> views;
  for (Picture &frame : frames)
    views.push_back (frame.view ());
  must (errors.fuser.take (coded.view ()));
  must (errors.fuser.fuse (views));
  for (int y = kBorder; y < coded.height () - kBorder; y++)
    for (int x = kBorder; x < coded.width () - kBorder; x++) {
      const int held = held_at (schedule, x, y);
      for (std::size_t k = 0; k < frames.size (); k++)
        errors.fused.add (
            frames[k].at (x, y), mean_at (slots, x, y, int (k), held));
    }
}

/* Pixels of subframes, as bright as those of the brightest part. */
void
compare_points (const Picture &coded, const Picture *slots,
    const Schedule &schedule, Errors &errors)
{
  for (int y = kBorder; y < coded.height () - kBorder; y++)
    for (int x = kBorder; x < coded.width () - kBorder; x++) {
      const int held = held_at (schedule, x, y);
      int slot = 0;
      while (!schedule.on (x, y, slot))
        slot++;
      errors.point.add (coded.at (x, y) * schedule.white_slots () / held,
          mean_at (slots, x, y, slot, held));
    }
}

/* @slots: the scene in each slot of this exposure. */
void
compare (const Picture &coded, const Picture *slots, const Schedule &schedule,
    Errors &errors)
{
  compare_fused (coded, slots, schedule, errors);
  compare_points (coded, slots, schedule, errors);
  if (!schedule.regions ().empty ())
    return;

  const auto extractor = must (Extractor<std::uint8_t>::make (
      schedule, coded.width (), coded.height ()));
  const Extent size = extractor.subframe_size ();
  std::vector<Picture> subframes (
      std::size_t (extractor.subframes ()), Picture (size.width, size.height));
  std::vector<ImageView<std::uint8_t>> views;
  for (Picture &subframe : subframes)
    views.push_back (subframe.view ());
  must (extractor.run (coded.view (), views));

  for (std::size_t k = 0; k < subframes.size (); k++) {
    Image<float> values (size.width, size.height);
    for (int j = 0; j < size.height; j++)
      for (int i = 0; i < size.width; i++)
        values.at (i, j) = subframes[k].at (i, j);
    const Upsampler upsampler (schedule, int (k), false);
    const Extent cell = schedule.cell ();
    for (int y = kBorder; y < size.height * cell.height - kBorder; y++)
      for (int x = kBorder; x < size.width * cell.width - kBorder; x++)
        errors.full.add (upsampler.at (std::as_const (values).view (), x, y),
            slots[k].at (x, y));
  }
}

} // namespace

BenchOptions
misaligned_bench (double psf_sigma)
{
  BenchOptions options;
  options.alignment = {0.4, 0.4, 0.5, 1.01};
  options.psf_sigma = psf_sigma;
  options.full_well = 10000;
  options.read_noise = 5;
  return options;
}

RectifyOutcome
run_rectify (
    const Scene &scene, const Schedule &schedule, const BenchOptions &options)
{
  const Extent size = {
      scene.frames.front ().width (), scene.frames.front ().height ()};
  BenchOptions straight = options;
  straight.alignment = {};
  auto aligned = must (OpticalBench::make (size.width, size.height, straight));
  auto crooked = must (OpticalBench::make (size.width, size.height, options));
  const auto rectifier =
      must (Rectifier::make (measure (size, options), schedule));

  Errors on_aligned (schedule, size, options),
      on_crooked = {schedule, size, options},
      on_rectified = {schedule, size, options};
  RectifyOutcome outcome;
  const auto slots = std::size_t (schedule.slots ());
  Picture frame (size.width, size.height), mirrors = frame;
  std::uint64_t number = 0;
  for (std::size_t at = 0; at + slots <= scene.frames.size (); at += slots) {
    const Picture *light = scene.frames.data () + at;
    for (const auto &[bench, errors] : {std::pair (&aligned, &on_aligned),
             std::pair (&crooked, &on_crooked)}) {
      bench->begin (schedule);
      for (std::size_t s = 0; s < slots; s++)
        bench->expose (light[s].view (), int (s), 1.0);
      bench->read_out (number, frame.view ());
      compare (frame, light, schedule, *errors);
    }
    number++;
    const auto start = std::chrono::steady_clock::now ();
    must (rectifier.run (std::as_const (frame).view (), mirrors.view ()));
    outcome.milliseconds += std::chrono::duration<double, std::milli> (
        std::chrono::steady_clock::now () - start)
                                .count ();
    compare (mirrors, light, schedule, on_rectified);
  }
  outcome.milliseconds /= double (number);
  outcome.aligned = on_aligned.score ();
  outcome.misaligned = on_crooked.score ();
  outcome.rectified = on_rectified.score ();
  return outcome;
}

} // namespace codedexposure::quality
