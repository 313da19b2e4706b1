/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/bench.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <new>
#include <sstream>

#include "base/pixels.h"
#include "base/text.h"
#include "base/try.h"
#include "bench/sensor.h"

namespace codedexposure
{

namespace
{

constexpr int kParked = -1;

Result<void>
check (const BenchOptions &options)
{
  using O = BenchOptions;
  const Alignment &a = options.alignment;
  const struct {
    const char *what;
    double value, low, high;
  } ranges[] = {
      {"PSF sigma (pixels)", options.psf_sigma, 0.0, O::kMaxPsfSigma},
      {"well (electrons)", options.well, 0.0, O::kMaxFullWell},
      {"black level (DN)", options.black_level, 0.0, 65535.0},
      {"full well (electrons)", options.full_well, 0.0, O::kMaxFullWell},
      {"read noise (electrons)", options.read_noise, 0.0, O::kMaxReadNoise},
      {"bits", double (options.bits), 0.0, 16.0},
      {"gain", options.gain, 0.0, O::kMaxGain},
      {"horizontal shift (mirrors)", a.shift_x, -O::kMaxShift, O::kMaxShift},
      {"vertical shift (mirrors)", a.shift_y, -O::kMaxShift, O::kMaxShift},
      {"rotation (degrees)", a.rotation, -180.0, 180.0},
      {"scale (pixels a mirror)", a.scale, O::kMinScale, O::kMaxScale},
      {"horizontal tilt", a.tilt_x, -O::kMaxTilt, O::kMaxTilt},
      {"vertical tilt", a.tilt_y, -O::kMaxTilt, O::kMaxTilt},
      {"distortion", a.distortion, -O::kMaxDistortion, O::kMaxDistortion},
  };
  for (const auto &[what, value, low, high] : ranges)
    if (!(value >= low && value <= high)) { // not-a-number fails, too
      std::ostringstream text;
      text << what << " = " << value << " is outside " << low << ".." << high;
      return Error{text.str ()};
    }
  if (options.mapping) {
    const double scale = options.mapping->pose ().magnification;
    if (!(scale >= O::kMinScale && scale <= O::kMaxScale))
      return Error{"a mapping with " + real_text (scale) +
                   " pixels a mirror is outside 0.5..4"};
  }
  if (options.read_noise > 0.0 && options.full_well == 0.0)
    return Error{"read noise is counted in electrons and needs a full well; "
                 "set it, 10000 for example"};
  return {};
}

/* The mirror of the first pixel of a scene of @size. */
Offset
first_mirror (const BenchOptions &options, Extent size)
{
  if (!options.mapping)
    return {};
  const Extent mirrors = options.mapping->mirrors ();
  return {(mirrors.width - size.width) / 2, (mirrors.height - size.height) / 2};
}

/* One row, of whose light each place passes a @part. */
template <bool kFirst, typename Pixel, typename Part>
void
collect (const Pixel *scene, int width, Part part, float *light)
{
  for (int x = 0; x < width; x++) {
    const float passed = float (scene[x]) * part (x);
    light[x] = kFirst ? passed : light[x] + passed;
  }
}

} // namespace

BenchOptions
BenchOptions::completed (
    const BenchProfile *profile, const Schedule &schedule) const
{
  BenchOptions made = *this;
  const auto complete = [] (double &number,
                            const std::optional<Measured> &measured) {
    if (number == kUnset)
      number = value_or (measured, 0.0);
  };
  if (profile) {
    if (bits == 0)
      made.bits = profile->bits;
    made.black_level = value_or (profile->black_level, 0.0);
    if (alignment == Alignment{})
      made.mapping = profile->mapping;
    const auto electrons = profile->electrons_per_number ();
    if (full_well == kUnset && electrons) {
      const double largest = profile->largest ();
      double white = *electrons * (largest - made.black_level);
      if (profile->full_well)
        white = std::min (white, made.well = profile->full_well->value);
      made.full_well = white * schedule.slots () / schedule.white_slots ();
      if (gain == 0.0)
        made.gain = made.full_well / (*electrons * largest);
    }
    complete (made.psf_sigma, profile->psf_sigma);
    if (made.full_well > 0.0)
      complete (made.read_noise, profile->read_noise);
  }
  for (double *number : {&made.psf_sigma, &made.full_well, &made.read_noise})
    complete (*number, std::nullopt);
  return made;
}

Result<OpticalBench>
OpticalBench::make (int width, int height, const BenchOptions &options)
{
  if (width < 1 || height < 1)
    return Error{"a bench of " + size_text ({width, height}) +
                 " mirrors has no picture"};
  RETURN_IF_ERROR (check (options));
  if (const auto &mapping = options.mapping;
      mapping && (mapping->mirrors ().width < width ||
                     mapping->mirrors ().height < height))
    return Error{"the mapping has " + size_text (mapping->mirrors ()) +
                 " mirrors, but each pixel of a scene of " +
                 size_text ({width, height}) + " needs one"};
  try {
    return OpticalBench (width, height, options);
  } catch (const std::bad_alloc &) {
    return Error{"there is no memory for a bench of " +
                     size_text ({width, height}) + " mirrors",
        ErrorCode::out_of_memory};
  }
}

OpticalBench::OpticalBench (int width, int height, const BenchOptions &options)
    : options_ (options),
      lens_ (options.alignment, options.psf_sigma, width, height,
          options.mapping, first_mirror (options, {width, height})),
      light_ (width, height), first_ (first_mirror (options, {width, height}))
{
  if (!lens_.ideal ())
    seen_ = Image<float> (width, height);
  if (options.diamond) {
    diamond_.emplace (*options.diamond);
    shares_.resize (std::size_t (width));
  }
}

void
OpticalBench::begin (
    const Schedule &schedule, std::shared_ptr<const StillMask> still)
{
  const Extent size = options_.mapping
                          ? options_.mapping->mirrors ()
                          : Extent{light_.width (), light_.height ()};
  if (!masks_ || !(masks_->schedule () == schedule)) {
    masks_.emplace (schedule, size);
    mirrors_ = masks_->render (shown_ = kParked);
  }
  if (still && still != held_)
    still_ = render_still<std::uint8_t> (*still, size);
  held_ = std::move (still);
  empty_ = true;
}

const MirrorRows<std::uint8_t> &
OpticalBench::mirrors_of (int mask)
{
  if (mask == kStillMask)
    return still_;
  mask = std::max (mask, kParked);
  if (mask != shown_)
    mirrors_ = masks_->render (shown_ = mask);
  return mirrors_;
}

template <typename Pixel>
void
OpticalBench::expose (ImageView<Pixel> scene, int mask, double slots)
{
  assert (masks_ && same_size (scene, light_.view ()));
  const float on = float (slots);
  const float off =
      mask == kAllMirrors ? on : float (slots * masks_->schedule ().leak ());
  const auto collect_row = [&] (int y, auto part) {
    float *const row = light_.view ().row (y);
    if (empty_)
      collect<true> (scene.row (y), scene.width, part, row);
    else
      collect<false> (scene.row (y), scene.width, part, row);
  };
  const MirrorRows<std::uint8_t> &rows = mirrors_of (mask);
  for (int y = 0; y < scene.height; y++)
    if (diamond_) {
      diamond_->look (rows, y, shares_.data ());
      collect_row (y, [on, off, share = shares_.data ()] (
                          int x) { return off + (on - off) * share[x]; });
    } else {
      collect_row (y, [on, off, mirrors = rows.row (y + first_.y) + first_.x] (
                          int x) { return mirrors[x] != 0 ? on : off; });
    }
  white_ = std::numeric_limits<Pixel>::max ();
  empty_ = false;
}

template <typename Pixel>
void
OpticalBench::read_out (std::uint64_t frame, ImageView<Pixel> coded)
{
  assert (masks_ && same_size (coded, light_.view ()));
  if (empty_) {
    for (int y = 0; y < coded.height; y++)
      std::fill_n (light_.view ().row (y), coded.width, 0.0f);
    white_ = std::numeric_limits<Pixel>::max ();
  }
  if (!lens_.ideal ())
    lens_.image (light_.view (), seen_.view ());

  const int bits = significant_bits_of<Pixel> (options_.bits);
  /* White is white above the black level, too. */
  const double range = 1.0 - options_.black_level / largest_pixel (bits);
  const Sensor sensor{.full_well = options_.full_well,
      .well = options_.well,
      .read_noise = options_.read_noise,
      .gain = options_.gain > 0.0 ? options_.gain : gain () * range,
      .black_level = options_.black_level,
      .bits = bits,
      .seed = options_.seed};
  sensor.read_out<Pixel> (lens_.ideal () ? light_.view () : seen_.view (),
      white_ * masks_->schedule ().slots (), frame, coded);
}

double
OpticalBench::gain () const
{
  if (options_.gain > 0.0 || !masks_)
    return options_.gain;
  return masks_->schedule ().slots () / masks_->schedule ().white_slots ();
}

template void OpticalBench::expose (ImageView<std::uint8_t>, int, double);
template void OpticalBench::expose (ImageView<const std::uint8_t>, int, double);
template void OpticalBench::expose (ImageView<std::uint16_t>, int, double);
template void OpticalBench::expose (
    ImageView<const std::uint16_t>, int, double);
template void OpticalBench::read_out (std::uint64_t, ImageView<std::uint8_t>);
template void OpticalBench::read_out (std::uint64_t, ImageView<std::uint16_t>);

} // namespace codedexposure
