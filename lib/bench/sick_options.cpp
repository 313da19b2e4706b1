/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/sick_options.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <set>
#include <type_traits>

#include "base/pixels.h"
#include "base/text.h"
#include "base/try.h"

namespace codedexposure
{

namespace
{

using Bench = SickBenchOptions;
/** The numbers of a word's value, at most two. */
using Values = std::array<double, 2>;

/** What a number of a word's value may be. */
struct Range {
  double low, high;
  enum class Kind { real, whole, time } kind = Kind::real;
};
constexpr auto kWhole = Range::Kind::whole;
constexpr Range kPart{0.0, 1.0}, kAny{-1e4, 1e4};
constexpr Range kTime{0.0, 1e12, Range::Kind::time};
constexpr Range kCount{0.0, 10'000.0, kWhole};

/** A word of inflict (). */
struct Word {
  const char *name;
  const char *value; ///< for people: "HZ:DEPTH"; empty: it has none
  const char *usual; ///< taken where a word has no value
  const char *help;
  Range ranges[2] = {}; ///< of the numbers in the value
  /** Null: others read the value, any text, from SickBenchOptions::parts. */
  void (*set) (Bench &bench, const Values &values) = nullptr;
};

/** Sets members to numbers; what has no number is a flag, and becomes true. */
template <auto... kMembers>
constexpr auto put = [] (auto &whole, const Values &values) {
  const double *value = values.data ();
  ((whole.*kMembers =
           std::remove_reference_t<decltype (whole.*kMembers)> (*value++)),
      ...);
};
/** The same of a part of the bench. */
template <auto kMember, auto... kMembers>
constexpr auto put_in = [] (Bench &b, const Values &values) {
  put<kMembers...> (b.*kMember, values);
};

Nanoseconds
ns (double time)
{
  return Nanoseconds (std::llround (time));
}

/** A level of 8 bits in DN of the bench. */
double
scaled_black (const Bench &b, double level)
{
  return level * largest_pixel (b.bits) / 255.0;
}

using T = Bench::Trigger;
using A = Alignment;

constexpr Word kWords[] = {
    /* Parts. */
    {"healthy", "SEED", "1", "all numbers drawn from those of good benches",
        {{0.0, 1e9, kWhole}},
        [] (Bench &b, const Values &v) {
          b = random_healthy_bench (std::uint64_t (v[0]), b);
        }},
    {"dmd-missing", "", "", "no board answers on the USB"},
    {"dmd-busy", "", "", "another program uses the board"},
    {"dmd-permission", "", "", "the user may not open the board"},
    {"firmware", "VERSION", "3.0.0", "firmware that is too old"},
    {"camera-missing", "", "", "no camera answers"},
    {"test-image", "", "", "the camera sends a test picture"},
    {"mute", "", "", "no feature tells how the camera is set"},
    {"rolling-shutter", "TIME", "8ms",
        "rows are exposed one after the other, for so long in all", {kTime},
        put<&Bench::rolling>},
    {"colour", "", "", "the sensor has a colour filter", {},
        put<&Bench::colour>},
    {"gamma", "GAMMA", "0.45", "pixel values are a power of the light",
        {{0.1, 4.0}}, put<&Bench::gamma>},
    {"auto-exposure", "LEVEL", "0.4", "the exposure keeps that mean level",
        {kPart}, put<&Bench::auto_exposure>},
    {"auto-gain", "LEVEL", "0.4", "the gain keeps that mean level", {kPart},
        put<&Bench::auto_gain>},
    {"black-clamp", "PART", "0.03",
        "the black level falls by that part of the mean light", {kPart},
        put<&Bench::black_clamp>},
    {"lut", "", "", "a look-up table changes pixel values", {},
        put<&Bench::lut>},
    {"noise-reduction", "PART", "0.5", "pixels get part of a mean of 3x3",
        {kPart}, put<&Bench::noise_reduction>},
    {"sharpening", "PART", "0.5", "differences from a mean of 3x3 grow",
        {{0.0, 4.0}}, put<&Bench::sharpening>},
    {"dark-subtraction", "", "", "a dark frame is taken from each frame", {},
        put<&Bench::dark_subtraction>},
    {"low-bits", "BITS", "12", "16 bits are sent, the lowest are used",
        {{8.0, 15.0, kWhole}},
        [] (Bench &b, const Values &v) {
          b.low_bits = int (v[0]);
          b.bits = 16;
        }},
    {"high-bits", "BITS", "12", "16 bits are sent, the highest are used",
        {{8.0, 15.0, kWhole}},
        [] (Bench &b, const Values &v) {
          b.missing_bits = 16 - int (v[0]);
          b.bits = 16;
        }},
    {"binning", "", "", "pixels are joined, 2 by 2", {},
        [] (Bench &b, const Values &) {
          b.alignment.scale *= 0.5;
          b.mirrors.width *= 2;
          b.mirrors.height *= 2;
        }},
    {"roi", "", "", "a part of the sensor is read"},
    {"pixel-format", "", "", "8 bits are sent, and the sensor has more", {},
        [] (Bench &b, const Values &) {
          b.black_level *= 255.0 / largest_pixel (b.bits);
          b.bits = 8;
        }},
    {"packet-size", "", "", "packets of 576 bytes"},
    {"packet-loss", "PART", "0.02", "packets are lost on the network", {kPart},
        put<&Bench::packet_loss>},
    {"slow-disk", "", "", "the disk is slower than the camera"},
    /* Trigger and exposure. */
    {"no-trigger", "", "", "the trigger does not reach the camera", {},
        [] (Bench &b, const Values &) { b.trigger = T::none; }},
    {"free-running", "RATE", "24.7", "the camera ignores the trigger",
        {{0.1, 10'000.0}},
        [] (Bench &b, const Values &v) {
          b.trigger = T::free_running;
          b.free_rate = v[0];
        }},
    {"half-rate", "", "", "every other trigger is ignored", {},
        [] (Bench &b, const Values &) { b.trigger = T::half_rate; }},
    {"rate-limit", "", "", "the camera's own rate ignores early triggers", {},
        [] (Bench &b, const Values &) { b.trigger = T::half_rate; }},
    {"double-rate", "", "", "two frames come for each trigger", {},
        [] (Bench &b, const Values &) { b.trigger = T::double_rate; }},
    {"trigger-edge", "TIME", "20ms",
        "the exposure begins with the end of a pulse of that length", {kTime},
        put<&Bench::edge>},
    {"exposure-late", "TIME", "2ms", "the exposure begins later", {kTime},
        put<&Bench::late>},
    {"exposure-short", "TIME", "4ms",
        "the longest exposure ends that long before the period", {kTime},
        put<&Bench::ends_early>},
    {"exposure-long", "TIME", "2ms",
        "the longest exposure ends that long after the period", {kTime},
        [] (Bench &b, const Values &v) { b.ends_early = -ns (v[0]); }},
    {"frame-late", "FRAMES", "1", "a frame has an earlier exposure",
        {{0.0, 16.0, kWhole}}, put<&Bench::frame_late>},
    {"frame-late-varies", "", "", "the same, by 0 to 2 frames", {},
        put<&Bench::late_varies>},
    {"jitter", "TIME", "200us", "jitter of the trigger's delay, rms", {kTime},
        put<&Bench::jitter>},
    {"delay", "TIME", "50us", "from the trigger to the exposure", {kTime},
        put<&Bench::delay>},
    {"readout", "TIME", "100us", "time that no exposure covers", {kTime},
        put<&Bench::readout>},
    /* Light. */
    {"dark", "LEVEL", "0.03", "too little light; 1: saturation", {kPart},
        put<&Bench::level>},
    {"bright", "LEVEL", "1.6", "too much light; 1: saturation", {{0.0, 100.0}},
        put<&Bench::level>},
    {"level", "LEVEL", "0.8", "light of all mirrors; 1: saturation",
        {{0.0, 100.0}}, put<&Bench::level>},
    {"vignetting", "PART", "0.6", "light that a corner loses", {kPart},
        put<&Bench::vignetting>},
    {"flicker", "HZ:DEPTH", "100:0.1", "amplitude / mean of the light",
        {{0.01, 100'000.0}, kPart},
        put<&Bench::flicker_rate, &Bench::flicker_depth>},
    {"drift", "PART", "0.1", "change of the light in a minute", {{-1.0, 1.0}},
        put<&Bench::drift>},
    {"pulsed", "HZ:PART", "1000:0.5", "the lamp is on for part of each pulse",
        {{1.0, 1e6}, {0.001, 1.0}},
        put<&Bench::pulse_rate, &Bench::pulse_duty>},
    {"texture", "PART", "0.2", "the target is not uniform, rms", {{0.0, 0.5}},
        put<&Bench::texture>},
    {"moving", "SPEED", "5", "a target with texture moves, pixels/s",
        {{-1e4, 1e4}},
        [] (Bench &b, const Values &v) {
          b.moving = v[0];
          b.texture = std::max (b.texture, 0.05);
        }},
    /* Sensor. */
    {"nonlinear", "PART", "0.05", "bow of the response, part of the range",
        {{-0.2, 0.2}}, put<&Bench::nonlinear>},
    {"noise", "ELECTRONS", "100", "read noise, e- rms", {{0.0, 1e5}},
        put<&Bench::read_noise>},
    {"black-clipped", "DN", "2", "DN of 8 bits that black lies below 0",
        {{0.0, 100.0}},
        [] (Bench &b, const Values &v) {
          b.black_level = -scaled_black (b, v[0]);
        }},
    {"hot-pixels", "N", "200", "pixels with a dark current", {kCount},
        put<&Bench::hot_pixels>},
    {"dead-pixels", "N", "200", "pixels that see nothing", {kCount},
        put<&Bench::dead_pixels>},
    {"missing-bits", "N", "2", "lowest bits that are always 0",
        {{0.0, 8.0, kWhole}}, put<&Bench::missing_bits>},
    {"dead-rows", "N", "2", "rows of pixels that see nothing", {kCount},
        put<&Bench::dead_rows>},
    {"dead-blocks", "N", "1", "16x16 pixels that see nothing", {kCount},
        put<&Bench::dead_blocks>},
    {"full-well", "ELECTRONS", "10000", "electrons at saturation", {{1.0, 1e7}},
        put<&Bench::full_well>},
    {"black", "DN", "4", "black level, DN of 8 bits", {{0.0, 100.0}},
        [] (Bench &b, const Values &v) {
          b.black_level = scaled_black (b, v[0]);
        }},
    {"prnu", "PART", "0.01", "rms difference of sensitivity", {kPart},
        put<&Bench::prnu>},
    /* Mirrors. */
    {"leak", "PART", "0.03", "light of mirrors that are off", {kPart},
        put<&Bench::leak>},
    {"slow-mirrors", "TIME", "500us", "time of a transition", {kTime},
        put<&Bench::switching>},
    {"stuck-on", "N", "20", "mirrors that stay on", {kCount},
        put<&Bench::stuck_on>},
    {"stuck-off", "N", "20", "mirrors that stay off", {kCount},
        put<&Bench::stuck_off>},
    {"stuck-rows", "N", "2", "rows of mirrors that stay off", {kCount},
        put<&Bench::stuck_rows>},
    {"stuck-blocks", "N", "1", "16x16 mirrors that stay off", {kCount},
        put<&Bench::stuck_blocks>},
    {"flipped-x", "", "", "the picture is mirrored, left to right", {},
        put_in<&Bench::orientation, &Orientation::flipped_x>},
    {"flipped-y", "", "", "the picture is mirrored, top to bottom", {},
        put_in<&Bench::orientation, &Orientation::flipped_y>},
    {"turned", "90|180|270", "90", "the camera is turned, degrees",
        {{90.0, 270.0, kWhole}},
        [] (Bench &b,
            const Values &v) { b.orientation.turned = int (v[0]) / 90 * 90; }},
    /* Optics. */
    {"blur", "PIXELS", "3", "standard deviation of the blur", {{0.0, 16.0}},
        put<&Bench::blur>},
    {"focus-tilt", "PIXELS:DEGREES", "3:30",
        "blur that grows across the frame, towards that direction",
        {{0.0, 16.0}, kAny}, put<&Bench::focus_tilt, &Bench::focus_direction>},
    {"perspective", "X/Y", "0.03/0.02", "tilt of the mirrors",
        {{-0.3, 0.3}, {-0.3, 0.3}},
        put_in<&Bench::alignment, &A::tilt_x, &A::tilt_y>},
    {"distortion", "PART", "0.02", "radial shift of a corner", {{-0.1, 0.1}},
        put_in<&Bench::alignment, &A::distortion>},
    {"rotation", "DEGREES", "4", "of the camera", {{-45.0, 45.0}},
        put_in<&Bench::alignment, &A::rotation>},
    {"scale", "PIXELS", "1.1", "pixels for each mirror", {{0.5, 4.0}},
        put_in<&Bench::alignment, &A::scale>},
    {"shift", "X/Y", "100/0", "of the camera, mirrors", {kAny, kAny},
        put_in<&Bench::alignment, &A::shift_x, &A::shift_y>},
    {"dust", "N", "6", "spots that block light", {kCount}, put<&Bench::dust>},
    /* Frames on their way. */
    {"lose", "PART", "0.05", "frames that are lost", {kPart},
        put<&Bench::lose>},
    {"slip", "TIME", "7s", "the masks come a slot later that often", {kTime},
        put<&Bench::slip_every>},
    {"frame-jitter", "TIME", "30ms", "max delay of a frame on its way", {kTime},
        put<&Bench::frame_jitter>},
};

std::optional<double>
parse_number (std::string_view text, const Range &range)
{
  std::optional<double> number;
  if (range.kind == Range::Kind::time) {
    if (const auto time = parse_time (text))
      number = double (*time);
  } else {
    number = parse_real (text);
  }
  const bool fits = number && *number >= range.low && *number <= range.high &&
                    (range.kind != kWhole || *number == std::floor (*number));
  return fits ? number : std::nullopt;
}

/** None if @p text is not as @p word wants its value. */
std::optional<Values>
parse_values (const Word &word, std::string_view text)
{
  Values values = {1.0, 1.0}; // of flags
  const std::string_view wanted = word.value;
  if (wanted.empty () || !word.set)
    return values;
  const char separator = wanted.find ('/') != wanted.npos ? '/' : ':';
  const auto pieces = split (text, separator);
  if (pieces.size () != split (wanted, separator).size ())
    return std::nullopt;
  for (std::size_t i = 0; i < pieces.size (); i++) {
    const auto number = parse_number (pieces[i], word.ranges[i]);
    if (!number)
      return std::nullopt;
    values[i] = *number;
  }
  return values;
}

Result<void>
apply (Bench &bench, std::string_view piece)
{
  constexpr std::string_view kSecond = "second:";
  if (piece.starts_with (kSecond)) {
    if (bench.second.empty ())
      return Error{"fault " + in_quotes (piece) +
                   " is of a second camera, and this bench has one; simulate "
                   "both, or leave it out"};
    return apply (bench.second.front (), piece.substr (kSecond.size ()));
  }
  const auto equals = piece.find ('=');
  const std::string_view name = piece.substr (0, equals);
  const auto found = std::ranges::find (kWords, name, &Word::name);
  if (found == std::end (kWords))
    return Error{"fault " + in_quotes (piece) +
                 " has no known name; \"--faults help\" lists the names"};
  const bool given = equals != piece.npos;
  if (given && found->value[0] == '\0')
    return Error{
        "fault " + in_quotes (piece) + " has no value; write " + found->name};
  const std::string_view text =
      given ? piece.substr (equals + 1) : std::string_view (found->usual);
  const auto values = parse_values (*found, text);
  if (!values)
    return Error{"fault " + in_quotes (piece) + " is not " + found->name + "=" +
                 found->value + " within its limits; write for example " +
                 found->name + "=" + found->usual};
  if (found->set)
    found->set (bench, *values);
  bench.parts[found->name] = std::string (text);
  if (bench.has ("pixel-format") + bench.has ("low-bits") +
          bench.has ("high-bits") >
      1)
    return Error{"the faults pixel-format, low-bits and high-bits all set the "
                 "bits that are sent; leave only one of them"};
  return {};
}

} // namespace

Result<void>
inflict (SickBenchOptions &bench, std::string_view words)
{
  SickBenchOptions changed = bench;
  std::set<std::string_view> names;
  auto pieces = split (words, ' ');
  /* It draws all numbers, and those of other words win. */
  std::ranges::stable_partition (pieces, [] (std::string_view piece) {
    return piece.substr (0, piece.find ('=')).ends_with ("healthy");
  });
  for (const std::string_view piece : pieces) {
    if (piece.empty ())
      continue;
    const std::string_view name = piece.substr (0, piece.find ('='));
    if (!names.insert (name).second)
      return Error{"fault " + in_quotes (name) +
                   " is there twice; leave one of them "
                   "out"};
    RETURN_IF_ERROR (apply (changed, piece));
  }
  bench = std::move (changed);
  return {};
}

std::string
fault_help ()
{
  std::string text;
  for (const Word &word : kWords) {
    std::string left = "  " + std::string (word.name);
    if (word.value[0] != '\0')
      left += "[=" + std::string (word.value) + "]";
    left.resize (std::max<std::size_t> (left.size () + 2, 34), ' ');
    text += left + word.help;
    if (word.usual[0] != '\0')
      text += " [" + std::string (word.usual) + "]";
    text += '\n';
  }
  return text +
         "  second:NAME[=VALUE]             the same of a second camera\n";
}

SickBenchOptions
random_healthy_bench (std::uint64_t seed, const SickBenchOptions &like)
{
  std::mt19937_64 random (seed * 0x9E3779B97F4A7C15u + 1);
  const auto any = [&random] (double low, double high) {
    /* A standard distribution may differ between libraries. */
    return low + (high - low) * double (random () >> 11) * 0x1p-53;
  };
  SickBenchOptions b = like;
  b.seed = seed;
  b.delay = ns (any (0, 300e3));
  b.readout = ns (any (10e3, 500e3));
  b.jitter = any (0, 10e3);
  b.level = any (0.7, 0.95);
  b.vignetting = any (0, 0.2);
  const double rates[] = {100.0, 120.0, any (1, 500)};
  b.flicker_rate = rates[std::size_t (any (0, 3))];
  b.flicker_depth = any (0, 0.005);
  b.drift = any (-0.01, 0.01);
  b.full_well = any (5000, 30000);
  b.read_noise = any (2, 12);
  b.black_level = scaled_black (b, any (2, 20));
  b.prnu = 0.01;
  b.hot_pixels = int (any (0, 11));
  b.dead_pixels = int (any (0, 11));
  b.leak = any (0.001, 0.01);
  b.switching = ns (any (1e3, 5e3));
  b.alignment = {.shift_x = any (-2, 2),
      .shift_y = any (-2, 2),
      .rotation = any (-0.5, 0.5),
      .scale = any (0.99, 1.01),
      .tilt_x = any (-0.003, 0.003),
      .tilt_y = any (-0.003, 0.003),
      .distortion = any (-0.002, 0.002)};
  b.blur = any (0.2, 0.7);
  return b;
}

SickBenchOptions
second_camera_of (const SickBenchOptions &first)
{
  SickBenchOptions second = first;
  second.second.clear ();
  second.parts.clear ();
  second.seed = first.seed + 1000;
  second.orientation.flipped_x = true;
  return second;
}

SickBenchOptions
random_second_camera (const SickBenchOptions &first)
{
  const SickBenchOptions like = second_camera_of (first);
  SickBenchOptions b = random_healthy_bench (like.seed, like);
  b.flicker_rate = first.flicker_rate; // the lamp is the same
  b.flicker_depth = first.flicker_depth;
  b.drift = first.drift;
  return b;
}

void
replay (SickBenchOptions &bench, const BenchProfile &profile)
{
  const auto set = [] (auto &number, const std::optional<Measured> &measured) {
    using Number = std::remove_reference_t<decltype (number)>;
    if (measured)
      number = Number (measured->value);
  };
  bench.camera = profile.camera.size;
  if (profile.dmd)
    bench.mirrors = profile.dmd->size;
  bench.mapping = profile.mapping;
  if (profile.mapping)
    bench.mirrors = profile.mapping->mirrors ();
  bench.bits = profile.bits;
  set (bench.black_level, profile.black_level);
  set (bench.read_noise, profile.read_noise);
  if (const auto gain = profile.electrons_per_number ())
    bench.full_well = *gain * (profile.largest () - bench.black_level);
  const auto &bow = profile.linearity_error;
  if (bow && bow->value > 2.0 * bow->sigma)
    bench.nonlinear = bow->value;
  set (bench.leak, profile.leak);
  set (bench.delay, profile.trigger_delay);
  if (profile.exposure)
    bench.readout =
        bench.rate.period () - Nanoseconds (profile.exposure->value);
  set (bench.blur, profile.psf_sigma);
}

} // namespace codedexposure
