/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Check "parts": what can be known before anything is measured. */
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "base/try.h"
#include "doctor/checks.h"
#include "doctor/rules.h"

namespace codedexposure
{

namespace
{

/* Packets below this size cost more time than they carry pixels, bytes. */
constexpr double kSmallPacket = 1000;
/* A second of frames shows a loss of packets that would ruin a recording. */
constexpr double kWatched = 1.0;
/* More is no single frame that a busy machine has lost. */
constexpr double kMissingPart = 0.1;

/** A setting of the camera that must have one of some values. */
struct Setting {
  const char *features; ///< with spaces between them
  const char *good;     ///< values, the same
  const char *unless;   ///< feature that switches this one off; empty: none
  const char *id;
  Verdict severity;
  const char *cause;
};

constexpr const char *kFalse = "false False 0";
constexpr Setting kSettings[] = {
    {"SensorShutterMode", "Global", "", "rolling-shutter", Verdict::fail,
        "rows of the picture are exposed one after the other, so that masks "
        "mix"},
    {"PixelColorFilter", "None", "", "colour", Verdict::fail,
        "each pixel sees one colour only"},
    {"TestPattern", "Off False", "", "test-image", Verdict::fail,
        "the camera sends a test picture"},
    {"Gamma", "1", "GammaEnable", "gamma", Verdict::fail,
        "pixel values are not proportional to light"},
    {"ExposureAuto", "Off", "", "auto-exposure", Verdict::fail,
        "the camera changes its exposure by itself"},
    {"GainAuto", "Off", "", "auto-gain", Verdict::fail,
        "the camera changes its gain by itself"},
    {"BalanceWhiteAuto", "Off", "", "auto-white-balance", Verdict::fail,
        "the camera changes the gain of its colours by itself"},
    {"LUTEnable", kFalse, "", "lut", Verdict::fail,
        "a table changes pixel values, which need not stay proportional to "
        "light"},
    {"SharpeningEnable", kFalse, "", "sharpening", Verdict::fail,
        "the camera makes neighbouring pixels differ more"},
    {"NoiseReductionEnable", kFalse, "", "noise-reduction", Verdict::fail,
        "the camera mixes neighbouring pixels"},
    {"BslSharpnessEnhancement", "0", "", "sharpening", Verdict::fail,
        "the camera makes neighbouring pixels differ more"},
    {"BslNoiseReduction", "0", "", "noise-reduction", Verdict::fail,
        "the camera mixes neighbouring pixels"},
    {"BlackLevelClampingEnable", kFalse, "", "black-clamp", Verdict::warn,
        "the camera moves its black level with the picture"},
    {"BlackLevelAuto", "Off", "", "black-clamp", Verdict::warn,
        "the camera moves its black level with the picture"},
    {"BinningHorizontal BinningVertical DecimationHorizontal "
     "DecimationVertical",
        "1", "", "binning", Verdict::warn,
        "pixels are put together, or left out"},
};

const std::string *
feature (const RigParts &parts, const std::string &name)
{
  const auto found = parts.features.find (name);
  return found == parts.features.end () ? nullptr : &found->second;
}

std::optional<double>
number (const RigParts &parts, const std::string &name)
{
  const std::string *text = feature (parts, name);
  return text ? parse_real (*text) : std::nullopt;
}

/* Whether @value is one of @good, as a text or as a number. */
bool
is_one_of (std::string_view good, const std::string &value)
{
  return std::ranges::any_of (split (good, ' '), [&] (std::string_view one) {
    const auto number = parse_real (one);
    return value == one || (number && number == parse_real (value));
  });
}

void
check_features (const RigParts &parts, Finding &finding)
{
  for (const Setting &setting : kSettings)
    for (const std::string_view piece : split (setting.features, ' ')) {
      const std::string name (piece);
      const std::string *value = feature (parts, name);
      const std::string *enabled = feature (parts, setting.unless);
      if (!value || is_one_of (setting.good, *value) ||
          (enabled && is_one_of (kFalse, *enabled)))
        continue;
      finding.blame (setting.id, name + " is " + *value + ": " + setting.cause,
          setting.severity,
          *rule_of (setting.id).remedy != 0
              ? ""
              : "set " + name + "=" +
                    std::string (split (setting.good, ' ')[0]));
    }
}

void
check_picture (const RigParts &parts, Finding &finding)
{
  for (const auto &[side, most] :
      {std::pair{"Width", "WidthMax"}, std::pair{"Height", "HeightMax"}}) {
    const auto used = number (parts, side), all = number (parts, most);
    if (used && all && *used < *all)
      finding.blame ("roi",
          std::string (side) + " is " + real_text (*used) + " of " +
              real_text (*all) +
              " pixels: the camera sends a part of its field",
          Verdict::warn,
          std::string ("set ") + side + "=" + real_text (*all) +
              ", unless this region is intended");
  }
  const std::string *formats = feature (parts, "PixelFormat.available");
  const bool deeper =
      formats && (formats->find ("Mono12") != std::string::npos ||
                     formats->find ("Mono10") != std::string::npos);
  if (parts.bits <= 8 && deeper)
    finding.blame ("pixel-format",
        "frames have " + std::to_string (parts.bits) +
            " bits, but the camera offers " + *formats +
            ": noise is rounded away",
        Verdict::warn);
}

/* A camera that counts its own frames leaves out triggers that come earlier. */
void
check_rate (const RigParts &parts, Finding &finding)
{
  const std::string *enabled = feature (parts, "AcquisitionFrameRateEnable");
  const auto own = number (parts, "AcquisitionFrameRate");
  const double rate = double (parts.rate.num) / parts.rate.den;
  if (enabled && !is_one_of (kFalse, *enabled) && own && *own < rate)
    finding.blame (
        "rate-limit", "AcquisitionFrameRate is " + real_text (*own) +
                          ", and the trigger comes " + real_text (rate) +
                          " times a second: the camera leaves out triggers");
}

void
check_firmware (const RigParts &parts, Finding &finding)
{
  /* The oldest that has all commands of the driver; docs/dmd.md. */
  constexpr int kOldest = 4;
  for (const auto &[name, text] : parts.dmd_status.details) {
    if (name != "firmware")
      continue;
    finding.notes.push_back ({"firmware of the DMD", text});
    if (const auto major = parse_int (text.substr (0, text.find ('.')));
        major && *major < kOldest)
      finding.blame ("firmware",
          "the DMD has firmware " + text + ", which is older than " +
              std::to_string (kOldest) + ".0 and not known to work",
          Verdict::warn);
  }
}

/** Bytes of a frame in memory. */
double
frame_bytes (const RigParts &parts)
{
  return double (parts.camera.size.width) * parts.camera.size.height *
         (parts.bits > 8 ? 2 : 1);
}

std::string
megabytes (double bytes)
{
  return shown (bytes / 1e6) + " MB";
}

void
check_host (const RigParts &parts, const HostFacts &host, Finding &finding)
{
  const double needed = frame_bytes (parts) * parts.rate.num / parts.rate.den;
  if (host.disk_rate) {
    const double rate = host.disk_rate->value;
    finding.readings.push_back ({"disk", scaled (*host.disk_rate, 1e-6), "MB/s",
        "at least " + megabytes (needed) + "/s"});
    if (rate < 2 * needed)
      finding.blame ("slow-disk",
          "the disk takes " + megabytes (rate) + "/s, and recording needs " +
              megabytes (needed) + "/s before compression",
          rate < needed ? Verdict::fail : Verdict::warn);
  }
  const auto packet = number (parts, "GevSCPSPacketSize");
  if (packet && *packet < kSmallPacket)
    finding.blame ("packet-size",
        "packets of the camera have " + real_text (*packet) +
            " bytes, so that there are many of them",
        Verdict::warn);
  if (packet && host.socket_buffer > 0 &&
      host.socket_buffer < frame_bytes (parts))
    finding.blame ("socket-buffer",
        "a frame has " + megabytes (frame_bytes (parts)) +
            ", but the network buffers of this machine hold " +
            megabytes (host.socket_buffer),
        Verdict::warn);
}

/** Frames that are missing between those that came: their stamps are whole
 * periods apart, some of them one, but where the masks begin anew. */
int
missing_frames (const std::vector<SeenFrame> &seen, double period)
{
  constexpr double kNear = 0.1; // of a period
  int missing = 0, steps_of_one = 0;
  for (std::size_t k = 1; k < seen.size (); k++) {
    const double steps = double (seen[k].time - seen[k - 1].time) / period;
    const double whole = std::max (1.0, std::round (steps));
    if (std::abs (steps - whole) > kNear)
      continue;
    missing += int (whole) - 1;
    steps_of_one += whole == 1.0;
  }
  return steps_of_one > 1 ? missing : 0;
}

/* A loss of packets shows in frames that are damaged. */
Result<void>
check_network (Examination &examination, Finding &finding)
{
  const FrameRate rate = examination.rig.parts ().rate;
  const int frames = std::max (10, int (kWatched * rate.num / rate.den));
  ASSIGN_OR_RETURN (auto seen, examination.rig.deliver (frames));
  const auto damaged = int (std::erase_if (seen, &SeenFrame::damaged));
  const int gaps = missing_frames (seen, double (rate.period ()));
  const int missing = std::max (0, gaps - damaged);
  const int all = int (seen.size ()) + damaged + missing;
  if (all == 0) {
    finding.blame ("no-trigger",
        "no frame came, so it is not known whether frames are damaged or lost",
        Verdict::unknown);
    return {};
  }
  for (const auto &[name, count] : {std::pair{"damaged frames", damaged},
           std::pair{"missing frames", missing}})
    finding.readings.push_back (
        {name, {double (count), std::sqrt (double (count))},
            "of " + std::to_string (all), "0"});
  const std::string of_all = " of " + std::to_string (all) + " frames ";
  if (damaged > 0)
    finding.blame (
        "packet-loss", std::to_string (damaged) + of_all + "lack packets");
  else if (missing > kMissingPart * all)
    finding.blame ("lose", std::to_string (missing) + of_all + "did not come");
  return {};
}

void
note_device (
    const char *what, const BenchProfile::Device &device, Finding &finding)
{
  std::string text;
  for (const std::string *part :
      {&device.vendor, &device.model, &device.serial})
    if (!part->empty ())
      text += *part + " ";
  finding.notes.push_back ({what, text + size_text (device.size)});
}

} // namespace

Result<Finding>
check_parts (Examination &examination)
{
  const RigParts &parts = examination.rig.parts ();
  Finding finding{"parts", "all mirrors on, for a second"};
  note_device ("camera", parts.camera, finding);
  note_device ("DMD", parts.dmd_device, finding);
  finding.notes.push_back ({"pixel format", parts.pixel_format});
  check_features (parts, finding);
  check_picture (parts, finding);
  check_rate (parts, finding);
  check_firmware (parts, finding);
  check_host (parts, examination.host, finding);
  RETURN_IF_ERROR (check_network (examination, finding));
  finding.sort ();

  BenchProfile &profile = examination.profile;
  profile.camera = parts.camera;
  profile.dmd = parts.dmd_device;
  profile.pixel_format = parts.pixel_format;
  profile.bits = parts.bits;
  return finding;
}

Finding
part_missing (const Error &why, bool camera)
{
  Finding finding{"parts", "nothing: a part could not be opened"};
  finding.blame (camera                          ? "camera-missing"
                 : why.code == ErrorCode::denied ? "dmd-permission"
                 : why.code == ErrorCode::busy   ? "dmd-busy"
                                                 : "dmd-missing",
      why.message);
  return finding;
}

} // namespace codedexposure
