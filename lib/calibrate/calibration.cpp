/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "calibrate/calibration.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <new>

#include "base/pixels.h"
#include "base/statistics.h"
#include "base/try.h"
#include "calibrate/displacement_fit.h"
#include "calibrate/phase_fit.h"

namespace codedexposure
{

namespace
{

/* A pixel that gets less than this part of the light of the bright ones sees no
 * mirrors. */
constexpr float kCovered = 0.2f;

/* Side of the squares over which light is averaged for the weights. */
constexpr int kSmooth = 16;

/* Reduced chi-square of blocks above which a displacement grid is fitted. */
constexpr double kDisplaced = 1.3;

/* Pixels between the nodes of a displacement grid. */
constexpr int kNodeDistance = 32;

constexpr int kRounds = 12;
/* Mirrors; shorter steps end the fit. */
constexpr double kConverged = 1e-7;

/* Every pixel is the mean of its kSmooth x kSmooth square. */
Image<float>
smoothed (const Image<float> &image)
{
  Image<float> out (image.width (), image.height ());
  for (int y0 = 0; y0 < image.height (); y0 += kSmooth)
    for (int x0 = 0; x0 < image.width (); x0 += kSmooth) {
      const int width = std::min (kSmooth, image.width () - x0);
      const int height = std::min (kSmooth, image.height () - y0);
      const auto square = out.view ().block (x0, y0, width, height);
      const auto mean =
          float (mean_of (image.view ().block (x0, y0, width, height)));
      each_pixel (square, [&] (int x, int y) { square.at (x, y) = mean; });
    }
  return out;
}

/* Mean residuals of blocks, in mirrors. */
Image<float>
shifts_of (const PhaseFit &fit, const std::vector<PhaseFit::Block> &blocks)
{
  Image<float> shifts (fit.blocks_across (), fit.blocks_down ());
  std::transform (blocks.begin (), blocks.end (), shifts.view ().data,
      [] (const PhaseFit::Block &b) {
        return b.information > 0.0 ? float (b.score / b.information) : 0.0f;
      });
  return shifts;
}

/* Copies the result of the fit. */
Result<void>
report (const PhaseFit &fit, CalibrationResult &result)
{
  const double magnification = fit.mapping.pose ().magnification;
  result.psf_sigma =
      magnification * std::sqrt (0.5 * (fit.blur_x + fit.blur_y));
  ASSIGN_OR_RETURN (result.mapping,
      Mapping::make ({fit.camera, fit.mirrors, fit.mapping.homography (),
          fit.covariance, fit.mapping.displacement (), result.psf_sigma}));
  result.misfit =
      std::sqrt (0.5 * (reduced_chi_square (fit.blocks_x, fit.noise_ratio) +
                           reduced_chi_square (fit.blocks_y, fit.noise_ratio)));
  each_pixel (result.quality, [&] (int x, int y) {
    PixelQuality &quality = result.quality.at (x, y);
    if (quality != PixelQuality::good)
      return;
    if (!result.mapping.covers (result.mapping.mirror_at (x, y)))
      quality = PixelQuality::uncovered;
    else if (fit.faint.at (x, y) != 0)
      quality = PixelQuality::low_contrast;
    else if (fit.outlier.at (x, y) != 0)
      quality = PixelQuality::outlier;
  });
  return {};
}

/* Repeats rounds until they converge; the noise is estimated with them. */
Result<void>
converge (PhaseFit &fit)
{
  double before = std::numeric_limits<double>::infinity ();
  for (int round = 0; round < kRounds; round++) {
    const auto step = fit.round (8);
    if (!step)
      return Error{"the gratings do not determine a mapping; check light and "
                   "focus, and that each frame shows its own pattern"};
    if (*step < kConverged || (round > 3 && *step > 0.5 * before))
      break;
    before = *step;
    if (round < 4)
      fit.estimate_noise ();
  }
  return {};
}

/* Adds a displacement grid if the residuals of blocks exceed the noise. */
Result<void>
displace (PhaseFit &fit)
{
  if (std::max (reduced_chi_square (fit.blocks_x, fit.noise_ratio),
          reduced_chi_square (fit.blocks_y, fit.noise_ratio)) < kDisplaced)
    return {};
  const auto nodes = [] (int size) {
    return std::clamp (
        1 + (size + kNodeDistance / 2) / kNodeDistance, 3, Mapping::kMaxNodes);
  };
  Displacement grid;
  grid.columns = nodes (fit.camera.width);
  grid.rows = nodes (fit.camera.height);
  grid.x.resize (std::size_t (grid.columns) * std::size_t (grid.rows));
  grid.y = grid.x;
  for (int round = 0; round < 3; round++) {
    add_displacement (grid, grid.x, fit.blocks_x, fit.block_size, fit.camera);
    add_displacement (grid, grid.y, fit.blocks_y, fit.block_size, fit.camera);
    ASSIGN_OR_RETURN (fit.mapping, Mapping::make ({fit.camera, fit.mirrors,
                                       fit.mapping.homography (), {}, grid}));
    if (!fit.round (0))
      return Error{"the gratings do not determine a displacement grid"};
  }
  return {};
}

} // namespace

Result<Calibration>
Calibration::make (Extent camera, Extent mirrors,
    std::span<const Pattern> patterns, int row_step)
try {
  RETURN_IF_ERROR (Mapping::make ({camera, mirrors}));
  if (std::min (camera.width, camera.height) < 32)
    return Error{"a calibration needs frames of 32x32 pixels or more, not " +
                 size_text (camera)};
  Calibration made (camera, mirrors, row_step);
  for (const Pattern &pattern : patterns) {
    if (made.find (pattern) != nullptr)
      return Error{"pattern " + pattern.text () +
                   " is listed twice; list each pattern of a calibration once"};
    made.slots_.push_back ({pattern, {}, 0, {}});
  }
  for (const Axis axis : {Axis::x, Axis::y}) {
    const auto gratings = made.gratings (axis);
    const bool whole = !gratings.empty () &&
                       int (gratings.size ()) == gratings[0]->pattern.period &&
                       gratings.size () >= 4;
    if (!whole || !made.has_gray_code (axis) ||
        made.find ({Pattern::Kind::dark}) == nullptr ||
        made.find ({Pattern::Kind::white}) == nullptr)
      return Error{"a calibration needs dark, white, the Gray codes of x and y "
                   "with their inverses and gratings of one period, 4 or "
                   "more, at all phases, as calibration_patterns () has them"};
  }
  return made;
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

Calibration::Calibration (Extent camera, Extent mirrors, int row_step)
    : camera_ (camera), mirrors_ (mirrors), row_step_ (row_step),
      saturated_ (camera.width, camera.height)
{
}

Calibration::Slot *
Calibration::find (const Pattern &pattern)
{
  const auto at = std::ranges::find (slots_, pattern, &Slot::pattern);
  return at == slots_.end () ? nullptr : &*at;
}

template <typename Pixel>
Result<void>
Calibration::add (
    const Pattern &pattern, ImageView<const Pixel> frame, int bits)
try {
  Slot *slot = find (pattern);
  if (slot == nullptr)
    return Error{
        "pattern " + pattern.text () + " is not part of this calibration"};
  if (frame.width != camera_.width || frame.height != camera_.height)
    return Error{"a calibration frame has " +
                 size_text ({frame.width, frame.height}) + " pixels; " +
                 size_text (camera_) + " are expected"};
  if (solved_ ||
      (slot->frames > 0 && slot->sum.width () == 0 && slot->mean.width () == 0))
    return Error{"a frame of pattern " + pattern.text () +
                 " comes after this pattern was evaluated; add all frames of a "
                 "pattern before those of the next one"};
  evaluate_pairs (pattern);
  const Pixel largest = largest_pixel_of<Pixel> (bits);
  /* 16 bits hold a DN's parts, too. */
  unit_ = std::exp2 (float (std::bit_width (unsigned (largest))) - 16.0f);
  shrink_gratings (pattern);
  if (slot->sum.width () == 0)
    slot->sum = Image<float> (camera_.width, camera_.height);
  if (slot->mean.width () > 0) {
    const float times = unit_ * float (slot->frames);
    each_pixel (slot->mean, [&] (int x, int y) {
      slot->sum.at (x, y * row_step_) = times * float (slot->mean.at (x, y));
    });
    slot->mean = {};
  }
  for (int y = 0; y < frame.height; y++) {
    const Pixel *in = frame.row (y);
    float *sum = slot->sum.view ().row (y);
    std::uint8_t *full = saturated_.view ().row (y);
    for (int x = 0; x < frame.width; x++) {
      sum[x] += float (in[x]);
      full[x] |= in[x] >= largest;
    }
  }
  slot->frames++;
  return {};
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

template Result<void> Calibration::add (
    const Pattern &, ImageView<const std::uint8_t>, int);
template Result<void> Calibration::add (
    const Pattern &, ImageView<const std::uint16_t>, int);

std::vector<Pattern>
Calibration::missing () const
{
  std::vector<Pattern> patterns;
  for (const auto &slot : slots_)
    if (slot.frames == 0)
      patterns.push_back (slot.pattern);
  return patterns;
}

bool
Calibration::has_gray_code (Axis axis) const
{
  int bits = 0, width = 1;
  for (;; bits++) {
    int pair = 0;
    for (const Slot &slot : slots_)
      if (const Pattern &pattern = slot.pattern;
          pattern.kind == Pattern::Kind::gray && pattern.axis == axis &&
          pattern.bit == bits) {
        pair |= pattern.inverse ? 1 : 2;
        width = pattern.period;
      }
    if (pair != 3)
      break;
  }
  const int size = axis == Axis::x ? mirrors_.width : mirrors_.height;
  return bits > 0 && (size - 1) / width < 1 << bits;
}

void
Calibration::evaluate_pairs (const Pattern &pattern)
{
  Pattern now = pattern;
  now.inverse = false;
  for (Slot &slot : slots_) {
    if (slot.pattern.kind != Pattern::Kind::gray || slot.pattern.inverse ||
        slot.pattern == now || slot.sum.width () == 0)
      continue;
    Pattern opposite = slot.pattern;
    opposite.inverse = true;
    Slot *other = find (opposite);
    if (other == nullptr || other->frames == 0)
      continue;
    const bool along_x = slot.pattern.axis == Axis::x;
    GrayCode &code = along_x ? gray_x_ : gray_y_;
    if (code.bits.width () == 0)
      code.bits = Image<std::uint16_t> (camera_.width, camera_.height);
    code.width = slot.pattern.period;
    const float part = 1.0f / float (slot.frames);
    const float other_part = 1.0f / float (other->frames);
    const auto bit = std::uint16_t (1u << slot.pattern.bit);
    each_pixel (code.bits, [&] (int x, int y) {
      if (slot.sum.at (x, y) * part > other->sum.at (x, y) * other_part)
        code.bits.at (x, y) |= bit;
    });
    slot.sum = {};
    other->sum = {};
  }
}

void
Calibration::shrink_gratings (const Pattern &pattern)
{
  for (Slot &slot : slots_) {
    if (slot.pattern.kind != Pattern::Kind::grating ||
        slot.pattern == pattern || slot.sum.width () == 0)
      continue;
    const float part = 1.0f / (unit_ * float (slot.frames));
    slot.mean = Image<std::uint16_t> (
        camera_.width, (camera_.height + row_step_ - 1) / row_step_);
    each_pixel (slot.mean, [&] (int x, int y) {
      slot.mean.at (x, y) =
          std::uint16_t (std::lround (part * slot.sum.at (x, y * row_step_)));
    });
    slot.sum = {};
  }
}

std::vector<const Calibration::Slot *>
Calibration::gratings (Axis axis) const
{
  std::vector<const Slot *> found;
  for (const Slot &slot : slots_)
    if (slot.pattern.kind == Pattern::Kind::grating &&
        slot.pattern.axis == axis)
      found.push_back (&slot);
  std::ranges::sort (
      found, {}, [] (const Slot *slot) { return slot->pattern.phase; });
  return found;
}

/* The pixels that dark and white show to be usable. */
Result<Image<std::uint8_t>>
Calibration::usable_pixels (CalibrationResult &result) const
{
  const float covered =
      std::max (1.0f, kCovered * quantile (result.contrast, 0.9));
  Image<std::uint8_t> usable (camera_.width, camera_.height);
  each_pixel (usable, [&] (int x, int y) {
    PixelQuality &quality = result.quality.at (x, y);
    quality = result.contrast.at (x, y) < covered ? PixelQuality::uncovered
              : saturated_.at (x, y) != 0         ? PixelQuality::saturated
                                                  : PixelQuality::good;
    usable.at (x, y) = quality == PixelQuality::good;
  });
  if (result.pixels (PixelQuality::saturated) >
      std::uint64_t (camera_.width) * std::uint64_t (camera_.height) / 2)
    return Error{"more than half of the pixels have the largest value; "
                 "reduce light, exposure or gain, and calibrate again"};
  return usable;
}

/* A stripe is wider than what is sought: it shows in the pixels that are beyond
 * the border of the stripe which they see by the mapping. */
double
Calibration::gray_difference (Axis axis, const CalibrationResult &result) const
{
  const GrayCode &code = axis == Axis::x ? gray_x_ : gray_y_;
  double sum = 0.0, pixels = 0.0;
  each_pixel (result.quality, [&] (int x, int y) {
    if (result.quality.at (x, y) != PixelQuality::good)
      return;
    const Position at = result.mapping.mirror_at (x, y);
    const double border = ((axis == Axis::x ? at.x : at.y) + 0.5) / code.width;
    const double stripes =
        (code.mirror_at (x, y) + 0.5) / code.width - 0.5 - std::floor (border);
    sum += std::clamp (stripes, -1.0, 1.0) * code.width;
    pixels++;
  });
  return sum / std::max (1.0, pixels);
}

Result<CalibrationResult>
Calibration::fit ()
{
  const Image<float> &dark = find ({Pattern::Kind::dark})->sum;
  const Image<float> &white = find ({Pattern::Kind::white})->sum;
  const Image<float> dark_smooth = smoothed (dark);
  const Image<float> white_smooth = smoothed (white);
  CalibrationResult result = {Mapping (camera_), 0, 0, 0,
      Image<PixelQuality> (camera_.width, camera_.height),
      difference (white, dark), {}, {}};
  ASSIGN_OR_RETURN (const Image<std::uint8_t> usable, usable_pixels (result));
  ASSIGN_OR_RETURN (const Homography coarse,
      fit_gray_codes (gray_x_, gray_y_, usable.view ()));
  ASSIGN_OR_RETURN (
      const Mapping start, Mapping::from_centred (camera_, mirrors_, coarse));

  PhaseFit fit = {camera_, mirrors_, {}, {}, usable.view (),
      dark_smooth.view (), white_smooth.view (), start};
  fit.block_size = CalibrationResult::kBlock;
  fit.frames = std::numeric_limits<int>::max ();
  for (const Axis axis : {Axis::x, Axis::y}) {
    PhaseStack &stack = axis == Axis::x ? fit.x : fit.y;
    stack.unit = unit_;
    stack.step = row_step_;
    for (const Slot *slot : gratings (axis)) {
      stack.frames.push_back (slot->mean.view ());
      fit.frames = std::min (fit.frames, slot->frames);
    }
  }

  RETURN_IF_ERROR (converge (fit));
  result.residual_x = shifts_of (fit, fit.blocks_x);
  result.residual_y = shifts_of (fit, fit.blocks_y);
  RETURN_IF_ERROR (displace (fit));
  RETURN_IF_ERROR (report (fit, result));
  result.gray_difference = std::hypot (
      gray_difference (Axis::x, result), gray_difference (Axis::y, result));
  return result;
}

Result<CalibrationResult>
Calibration::solve ()
try {
  if (const auto patterns = missing (); !patterns.empty ())
    return Error{std::to_string (patterns.size ()) +
                 " patterns of the calibration have no frame, the first is " +
                 patterns.front ().text () + "; add their frames"};
  if (solved_)
    return Error{"a calibration is solved once; make another one"};
  solved_ = true;
  evaluate_pairs ({});
  shrink_gratings ({});
  for (Slot &slot : slots_)
    for (float &sum : slot.sum.pixels ())
      sum *= 1.0f / float (slot.frames);
  return fit ();
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

std::uint64_t
CalibrationResult::pixels (PixelQuality what) const
{
  return std::uint64_t (std::ranges::count (quality.pixels (), what));
}

} // namespace codedexposure
