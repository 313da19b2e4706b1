/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/simulated_rig.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/text.h"
#include "base/try.h"
#include "dmd/boards.h"
#include "dmd/erle.h"
#include "dmd/hid_link.h"
#include "dmd/pattern_timing.h"
#include "schedule/mask_renderer.h"

namespace codedexposure
{

namespace
{

constexpr Nanoseconds kStart = 60'000'000; // of masks that are there
/* More, as it happens: no lamp is in step with that, ns. */
constexpr double kStartSpread = 20e6;
constexpr Nanoseconds kTransfer = 8'000'000; // of a frame
constexpr Nanoseconds kMicrosecond = 1000;
constexpr int kInFlight = 2;
/* The camera's clock is not that of the machine; rms of its error. */
constexpr Nanoseconds kEpoch = 5'000'000'000'000;
constexpr double kClockError = 25e-6;
constexpr double kPacketBytes = 1444;

std::uint64_t
mixed (std::uint64_t seed, std::uint64_t number)
{
  std::uint64_t z = seed + (number + 1) * 0x9E3779B97F4A7C15u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

double
fraction (std::uint64_t seed, std::uint64_t number)
{
  return double (mixed (seed, number) >> 11) * 0x1p-53;
}

std::string
pixel_format_of (const SickBenchOptions &options)
{
  return options.bits > 12 ? "Mono16" : options.bits > 8 ? "Mono12" : "Mono8";
}

/** A number of normal distribution, by @p seed. */
double
normal (std::uint64_t seed)
{
  return std::sqrt (-2.0 * std::log (fraction (seed, 1) + 0x1p-54)) *
         std::cos (2.0 * std::numbers::pi * fraction (seed, 2));
}

RigParts
parts_of (const SickBenchOptions &options)
{
  RigParts parts;
  parts.camera = {"Codedexposure", "Simulated", "SIM1", options.camera};
  parts.bits = options.bits;
  parts.pixel_format = pixel_format_of (options);
  parts.dmd = *board_info (*find_board ("dlp6500"), {});
  parts.dmd.name = "sim:bench";
  parts.dmd.size = options.mirrors;
  parts.dmd.serial = "SIMDMD1";
  const auto firmware = options.parts.find ("firmware");
  parts.dmd_status.details = {{"controller", "DLPC900"},
      {"firmware",
          firmware == options.parts.end () ? "6.0.0" : firmware->second}};
  parts.dmd_device = {
      "Texas Instruments", "Simulated", "SIMDMD1", options.mirrors};
  parts.rate = options.rate;
  parts.features = camera_features (options);
  return parts;
}

/** How long a DLPC900 takes to receive @p mask. */
Nanoseconds
transfer_time (const StillMask &mask, Extent mirrors)
{
  constexpr Nanoseconds kPacketTime = 1'000'000;
  const auto rows = render_still<PlanePixel> (mask, mirrors);
  return Nanoseconds (hid_packets (encode_erle (rows, 0, mirrors.width).size)) *
         kPacketTime;
}

} // namespace

std::map<std::string, std::string>
camera_features (const SickBenchOptions &o)
{
  const auto choose = [&o] (const char *fault, const char *ill,
                          const char *well) {
    return std::string (o.has (fault) ? ill : well);
  };
  if (o.has ("mute"))
    return {{"Width", std::to_string (o.camera.width)},
        {"Height", std::to_string (o.camera.height)},
        {"PixelFormat", pixel_format_of (o)}, {"DeviceSerialNumber", "SIM1"}};
  const int whole = o.has ("roi") ? 2 : 1;
  const bool deep = o.bits > 8 || o.has ("pixel-format");
  return {
      {"SensorShutterMode", choose ("rolling-shutter", "Rolling", "Global")},
      {"PixelColorFilter", choose ("colour", "BayerRG", "None")},
      {"TestPattern", choose ("test-image", "GreyHorizontalRamp", "Off")},
      {"GammaEnable", choose ("gamma", "true", "false")},
      {"Gamma", o.has ("gamma") ? o.parts.at ("gamma") : "1"},
      {"SharpeningEnable", choose ("sharpening", "true", "false")},
      {"NoiseReductionEnable", choose ("noise-reduction", "true", "false")},
      {"AcquisitionFrameRateEnable", choose ("rate-limit", "true", "false")},
      {"AcquisitionFrameRate", choose ("rate-limit", "20", "1000")},
      {"ExposureAuto", choose ("auto-exposure", "Continuous", "Off")},
      {"GainAuto", choose ("auto-gain", "Continuous", "Off")},
      {"BlackLevelAuto", choose ("black-clamp", "Continuous", "Off")},
      {"LUTEnable", choose ("lut", "true", "false")},
      {"BinningHorizontal", choose ("binning", "2", "1")},
      {"BinningVertical", choose ("binning", "2", "1")},
      {"TriggerDelay", real_text (1e-3 * double (o.late))}, // us
      {"OffsetX", choose ("roi", "16", "0")}, {"OffsetY", "0"},
      {"Width", std::to_string (o.camera.width)},
      {"Height", std::to_string (o.camera.height)},
      {"WidthMax", std::to_string (whole * o.camera.width)},
      {"HeightMax", std::to_string (whole * o.camera.height)},
      {"PixelFormat", pixel_format_of (o)},
      {"PixelFormat.available", deep ? "Mono8 Mono12" : "Mono8"},
      {"GevSCPSPacketSize", choose ("packet-size", "576", "1500")},
      {"DeviceSerialNumber", "SIM1"}};
}

Result<std::unique_ptr<SimulatedRig>>
SimulatedRig::make (const SickBenchOptions &options)
{
  const struct {
    const char *fault, *what;
    ErrorCode code;
  } missing[] = {
      {"camera-missing", "no camera answers", ErrorCode::not_found},
      {"dmd-missing", "no DMD is connected", ErrorCode::not_found},
      {"dmd-busy", "another program uses the DMD", ErrorCode::busy},
      {"dmd-permission", "you may not open the DMD", ErrorCode::denied},
  };
  for (const auto &[fault, what, code] : missing)
    if (options.has (fault))
      return Error{what, code};
  ASSIGN_OR_RETURN (SickBench bench, SickBench::make (options));
  std::unique_ptr<SimulatedRig> rig (new SimulatedRig (std::move (bench)));
  for (const SickBenchOptions &other : options.second) {
    ASSIGN_OR_RETURN (rig->second_, make (other));
    rig->second_->first_ = rig.get ();
    rig->second_->parts_.camera.serial = "SIM2";
  }
  return rig;
}

SimulatedRig::SimulatedRig (SickBench bench)
    : bench_ (std::move (bench)), options_ (bench_.truth ().options),
      parts_ (parts_of (options_)),
      clock_error_ (kClockError * normal (options_.seed))
{
}

/** The next exposure, with the setting that is then in force. */
std::optional<Shot>
SimulatedRig::fetch (Nanoseconds until)
{
  if (setting_ && setting_->frames == 0) {
    bench_.expose (setting_->exposure);
    setting_.reset ();
  }
  const auto shot = bench_.next (until);
  if (shot && setting_)
    setting_->frames--;
  return shot;
}

Nanoseconds
SimulatedRig::arrival_of (const Shot &shot) const
{
  return shot.end + kTransfer +
         Nanoseconds (fraction (options_.seed + 1, shot.number) *
                      double (options_.frame_jitter));
}

/** How long a rig waits for a frame. */
Nanoseconds
SimulatedRig::patience () const
{
  constexpr Nanoseconds kPatience = 2'000'000'000;
  return std::max (kPatience, 10 * options_.rate.period ());
}

/** The next frame that arrives; none: none is exposed before @p until. */
std::optional<Shot>
SimulatedRig::arrive (Nanoseconds until)
{
  for (;;) {
    std::optional<Shot> shot;
    if (!on_their_way_.empty ()) {
      shot = on_their_way_.front ();
      on_their_way_.pop_front ();
    } else {
      shot = fetch (until);
    }
    if (!shot) {
      now_ = std::max (now_, until);
      return std::nullopt;
    }
    if (shot->lost)
      continue;
    now_ = std::max (now_, arrival_of (*shot));
    return shot;
  }
}

Nanoseconds
SimulatedRig::now () const
{
  return second_ ? std::max (now_, second_->now_) : now_;
}

/** Frames that nobody watched are gone. */
void
SimulatedRig::catch_up (Nanoseconds now)
{
  const Nanoseconds gone = now - kInFlight * options_.rate.period ();
  if (now_ < gone)
    on_their_way_.clear ();
  now_ = std::max (now_, now);
  while (fetch (gone))
    ;
}

/** The mirrors stop within an exposure. */
void
SimulatedRig::stop ()
{
  if (!shows_)
    return;
  const Nanoseconds period = options_.rate.period ();
  while (int (on_their_way_.size ()) < kInFlight) {
    const auto shot = fetch (now_ + 2 * period);
    if (!shot)
      break;
    on_their_way_.push_back (*shot);
    now_ = std::max (now_, shot->trigger + period / 2);
  }
  bench_.park (now_);
  shows_ = false;
}

void
SimulatedRig::start (MirrorProgram program, Nanoseconds transfer)
{
  park ();
  now_ += kStart +
          Nanoseconds (fraction (options_.seed + 3, starts_++) * kStartSpread) +
          transfer + options_.rate.period ();
  if (second_) {
    second_->now_ = now_;
    second_->bench_.show (now_, program.complement (options_.mirrors));
    second_->shows_ = true;
  }
  bench_.show (now_, std::move (program));
  shows_ = true;
}

Result<void>
SimulatedRig::show (const StillMask &mask, int slots)
{
  if (first_) {
    ASSIGN_OR_RETURN (const StillMask other, mask_for_second (mask, slots));
    return first_->show (other, slots);
  }
  ASSIGN_OR_RETURN (
      const SlotPlan plan, SlotPlan::fit ({}, slots, options_.rate));
  ASSIGN_OR_RETURN (const StillTimes times,
      with_prefix (fit_still (plan, mask, *parts_.dmd.patterns),
          parts_.dmd.name + ": "));
  MirrorProgram program{.period = options_.rate.period ()};
  program.masks = {std::make_shared<Image<std::uint8_t>> (
      render_still<std::uint8_t> (mask, options_.mirrors).image ())};
  const Nanoseconds begin = times.before * kMicrosecond;
  /* The whole of a period has no dark nanosecond at its end. */
  const Nanoseconds end = times.lit.dark == 0
                              ? program.period
                              : begin + times.lit.exposure * kMicrosecond;
  program.stretches = {{begin, end, 0}};
  program.slot = program.period / slots;
  start (std::move (program), transfer_time (mask, options_.mirrors));
  return {};
}

void
SimulatedRig::park ()
{
  if (first_)
    return first_->park ();
  if (second_) {
    second_->catch_up (now_);
    catch_up (second_->now_);
    second_->stop ();
  }
  stop ();
}

Result<void>
SimulatedRig::expose (std::optional<Nanoseconds> time)
{
  constexpr Nanoseconds kShortest = 20 * kMicrosecond;
  if (time && *time < kShortest)
    return Error{"the camera exposes for 20us at least, not for " +
                 time_text (std::max<Nanoseconds> (0, *time))};
  setting_ = {time, kInFlight};
  return {};
}

Nanoseconds
SimulatedRig::stamp_of (const Shot &shot) const
{
  /* A camera stamps in ticks, here of 1 us. */
  const double since = double (shot.begin) * (1.0 + clock_error_);
  return kEpoch + Nanoseconds (since) / kMicrosecond * kMicrosecond;
}

/** Blackens rows whose packets are lost; false: none is. */
bool
SimulatedRig::spoil (const Shot &shot, ImageView<std::uint16_t> picture) const
{
  if (options_.packet_loss <= 0.0)
    return false;
  const int row_bytes = picture.width * (options_.bits > 8 ? 2 : 1);
  const int rows = std::max (1, int (kPacketBytes / row_bytes));
  bool damaged = false;
  for (int y = 0; y < picture.height; y += rows) {
    const std::uint64_t packet = shot.number * 65536 + std::uint64_t (y);
    if (fraction (options_.seed + 2, packet) >= options_.packet_loss)
      continue;
    damaged = true;
    for (int row = y; row < std::min (y + rows, picture.height); row++)
      std::fill_n (picture.row (row), picture.width, std::uint16_t (0));
  }
  return damaged;
}

SeenFrame
SimulatedRig::frame_of (const Shot &shot)
{
  SeenFrame frame{.time = stamp_of (shot),
      .arrival = now_,
      .picture =
          Image<std::uint16_t> (options_.camera.width, options_.camera.height)};
  bench_.take (shot, frame.picture.view ());
  frame.damaged = spoil (shot, frame.picture.view ());
  return frame;
}

Result<std::vector<SeenFrame>>
SimulatedRig::watch_until (Nanoseconds until, int frames)
{
  const bool ends = until < std::numeric_limits<Nanoseconds>::max ();
  std::vector<SeenFrame> seen;
  while (int (seen.size ()) < frames && now_ < until) {
    const auto shot = arrive (ends ? until : now_ + patience ());
    if (!shot)
      break;
    seen.push_back (frame_of (*shot));
  }
  return seen;
}

Result<std::vector<SeenFrame>>
SimulatedRig::deliver (int frames)
{
  RETURN_IF_ERROR (
      show ({.name = "light", .on = [] (int, int) { return true; }}, 1));
  std::vector<SeenFrame> seen;
  while (int (seen.size ()) < frames) {
    ASSIGN_OR_RETURN (auto next, watch (1));
    if (next.empty ())
      break;
    next[0].picture = {};
    seen.push_back (std::move (next[0]));
  }
  return seen;
}

Result<void>
SimulatedRig::record (const Schedule &schedule, double seconds,
    const std::function<void (const RecordedFrame &)> &take)
{
  ASSIGN_OR_RETURN (const SlotPlan plan,
      SlotPlan::fit (schedule.timing (), schedule.slots (), options_.rate));
  MirrorProgram program{.period = options_.rate.period ()};
  program.slot = program.period / schedule.slots ();
  program.periods = schedule.masks () / schedule.slots ();
  const MaskRenderer renderer (schedule, options_.mirrors);
  for (int mask = 0; mask < schedule.masks (); mask++) {
    program.masks.push_back (std::make_shared<Image<std::uint8_t>> (
        renderer.render (mask).image ()));
    const Nanoseconds begin =
        plan.start (mask % schedule.slots ()) +
        Nanoseconds (mask / schedule.slots ()) * program.period;
    program.stretches.push_back (
        {begin, begin + plan.active (), std::size_t (mask)});
  }
  start (std::move (program));
  on_their_way_.clear ();
  const Nanoseconds began = now_;
  Image<std::uint16_t> picture (options_.camera.width, options_.camera.height);
  std::optional<std::uint64_t> last;
  while (now_ < began + Nanoseconds (seconds * 1e9)) {
    const auto shot = arrive (now_ + patience ());
    if (!shot)
      break;
    bench_.take (*shot, picture.view ());
    RecordedFrame frame{.time = shot->begin, .arrival = now_};
    frame.damaged = spoil (*shot, picture.view ());
    frame.lost_before = last ? shot->number - *last - 1 : 0;
    if (schedule.pilot_rows () > 0) // nothing else shows it
      frame.synchronised = options_.slip_every == 0 ||
                           shot->trigger - began < options_.slip_every;
    frame.uncertainty = 100 * kMicrosecond;
    frame.picture = picture.view ();
    last = shot->number;
    take (frame);
  }
  park ();
  on_their_way_.clear ();
  return {};
}

} // namespace codedexposure
