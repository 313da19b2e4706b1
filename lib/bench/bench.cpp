/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/bench.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <new>
#include <optional>
#include <sstream>
#include <vector>

#include "bench/diamond_view.h"
#include "bench/sensor.h"
#include "schedule/mask_renderer.h"

namespace codedexposure
{

namespace
{
constexpr int kParked = -1;
}

struct OpticalBench::State {
  State (int width, int height, const BenchOptions &opts)
      : options (opts), lens (opts.alignment, opts.psf_sigma, width, height),
        light (width, height)
  {
    if (!lens.ideal ())
      seen = Image<float> (width, height);
    if (options.diamond) {
      diamond.emplace (*options.diamond);
      shares.resize (std::size_t (width));
    }
  }

  BenchOptions options;
  Lens lens;
  Image<float> light; // on the mirrors, scene values times slots
  Image<float> seen;  // by the pixels
  std::optional<MaskRenderer> masks;
  int shown = kParked;
  MirrorRows<std::uint8_t> mirrors; // of the mask that is shown
  std::shared_ptr<const StillMask> held;
  MirrorRows<std::uint8_t> still; // of the mask that is held
  std::optional<DiamondView> diamond;
  std::vector<float> shares; // of a row
  double white = 0.0;        // of the scene
  bool empty = true;         // light is yet to be overwritten

  double gain () const;
  void begin (const Schedule &schedule, std::shared_ptr<const StillMask> mask);
  const MirrorRows<std::uint8_t> &show (int mask);
  template <typename Pixel>
  void expose (ImageView<const Pixel> scene, int mask, double slots);
  template <typename Pixel>
  void read_out (std::uint64_t frame, ImageView<Pixel> coded);
};

namespace
{

Error
out_of_range (const char *what, double value, double low, double high)
{
  std::ostringstream text;
  text << what << " = " << value << " is outside " << low << ".." << high;
  return Error{text.str ()};
}

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
  for (const auto &range : ranges)
    /* So written that not-a-number fails, too. */
    if (!(range.value >= range.low && range.value <= range.high))
      return out_of_range (range.what, range.value, range.low, range.high);
  if (options.read_noise > 0.0 && options.full_well == 0.0)
    return Error{"read noise is counted in electrons and needs a full well; "
                 "set it, 10000 for example"};
  return {};
}

/* One row: every mirror passes @on or @off of its light. */
template <bool kFirst, typename Pixel>
void
collect (const Pixel *scene, const std::uint8_t *mirrors, int width, float on,
    float off, float *light)
{
  for (int x = 0; x < width; x++) {
    const float passed = float (scene[x]) * (mirrors[x] != 0 ? on : off);
    light[x] = kFirst ? passed : light[x] + passed;
  }
}

/* The same where mirrors that are on cover a @share of each pixel. */
template <bool kFirst, typename Pixel>
void
collect_shares (const Pixel *scene, const float *share, int width, float on,
    float off, float *light)
{
  for (int x = 0; x < width; x++) {
    const float passed = float (scene[x]) * (off + (on - off) * share[x]);
    light[x] = kFirst ? passed : light[x] + passed;
  }
}

} // namespace

Result<OpticalBench>
OpticalBench::make (int width, int height, const BenchOptions &options)
{
  if (width < 1 || height < 1)
    return Error{"a bench of " + std::to_string (width) + "x" +
                 std::to_string (height) + " mirrors has no picture"};
  if (Result<void> checked = check (options); !checked)
    return checked.error ();
  try {
    return OpticalBench (std::make_unique<State> (width, height, options));
  } catch (const std::bad_alloc &) {
    return Error{"there is no memory for a bench of " + std::to_string (width) +
                     "x" + std::to_string (height) + " mirrors",
        ErrorCode::out_of_memory};
  }
}

OpticalBench::OpticalBench (std::unique_ptr<State> state)
    : state_ (std::move (state))
{
}

OpticalBench::OpticalBench (OpticalBench &&) noexcept = default;
OpticalBench &OpticalBench::operator= (OpticalBench &&) noexcept = default;
OpticalBench::~OpticalBench () = default;

void
OpticalBench::begin (
    const Schedule &schedule, std::shared_ptr<const StillMask> still)
{
  state_->begin (schedule, std::move (still));
}

void
OpticalBench::State::begin (
    const Schedule &schedule, std::shared_ptr<const StillMask> mask)
{
  const Extent size{light.width (), light.height ()};
  if (!masks || !(masks->schedule () == schedule)) {
    masks.emplace (schedule, size);
    mirrors = masks->render (shown = kParked);
  }
  if (mask && mask != held)
    still = render_still<std::uint8_t> (*mask, size);
  held = std::move (mask);
  empty = true;
}

const MirrorRows<std::uint8_t> &
OpticalBench::State::show (int mask)
{
  if (mask == kStillMask)
    return still;
  mask = std::max (mask, kParked);
  if (mask != shown)
    mirrors = masks->render (shown = mask);
  return mirrors;
}

template <typename Pixel>
void
OpticalBench::State::expose (
    ImageView<const Pixel> scene, int mask, double slots)
{
  assert (masks && same_size (scene, light.view ()));
  const float on = float (slots);
  const float off = float (slots * masks->schedule ().leak ());
  const auto collect_row = empty ? collect<true, Pixel> : collect<false, Pixel>;
  const auto collect_shared =
      empty ? collect_shares<true, Pixel> : collect_shares<false, Pixel>;
  const MirrorRows<std::uint8_t> &rows = show (mask);
  for (int y = 0; y < scene.height; y++) {
    float *const row = light.view ().row (y);
    if (diamond) {
      diamond->look (rows, y, shares.data ());
      collect_shared (scene.row (y), shares.data (), scene.width, on, off, row);
    } else {
      collect_row (scene.row (y), rows.row (y), scene.width, on, off, row);
    }
  }
  white = std::numeric_limits<Pixel>::max ();
  empty = false;
}

void
OpticalBench::expose (
    ImageView<const std::uint8_t> scene, int mask, double slots)
{
  state_->expose (scene, mask, slots);
}

void
OpticalBench::expose (
    ImageView<const std::uint16_t> scene, int mask, double slots)
{
  state_->expose (scene, mask, slots);
}

template <typename Pixel>
void
OpticalBench::State::read_out (std::uint64_t frame, ImageView<Pixel> coded)
{
  assert (masks && same_size (coded, light.view ()));
  if (empty) {
    for (int y = 0; y < coded.height; y++)
      std::fill_n (light.view ().row (y), coded.width, 0.0f);
    white = std::numeric_limits<Pixel>::max ();
  }
  if (!lens.ideal ())
    lens.image (light.view (), seen.view ());

  const int all_bits = std::numeric_limits<Pixel>::digits;
  Sensor sensor;
  sensor.full_well = options.full_well;
  sensor.read_noise = options.read_noise;
  sensor.gain = gain ();
  sensor.bits = options.bits > 0 ? std::min (options.bits, all_bits) : all_bits;
  sensor.seed = options.seed;
  sensor.read_out<Pixel> (lens.ideal () ? light.view () : seen.view (),
      white * masks->schedule ().slots (), frame, coded);
}

void
OpticalBench::read_out (std::uint64_t frame, ImageView<std::uint8_t> coded)
{
  state_->read_out (frame, coded);
}

void
OpticalBench::read_out (std::uint64_t frame, ImageView<std::uint16_t> coded)
{
  state_->read_out (frame, coded);
}

double
OpticalBench::State::gain () const
{
  if (options.gain > 0.0 || !masks)
    return options.gain;
  return masks->schedule ().slots () / masks->schedule ().white_slots ();
}

double
OpticalBench::gain () const
{
  return state_->gain ();
}

} // namespace codedexposure
