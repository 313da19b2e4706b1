/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Check "parts": what can be known before anything is measured. */
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "base/text.h"
#include "base/try.h"
#include "doctor/checks.h"

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
struct Rule {
  const char *feature;
  std::array<const char *, 3> good; ///< null: no other one
  const char *unless; ///< feature that switches this one off; null: none
  const char *id;
  Verdict severity;
  const char *cause, *remedy;
};

constexpr Rule kRules[] = {
    {"SensorShutterMode", {"Global", nullptr, nullptr}, nullptr,
        "rolling-shutter", Verdict::fail,
        "rows of the picture are exposed one after the other, so that masks "
        "mix",
        "set SensorShutterMode=Global, or use a camera with a global shutter"},
    {"PixelColorFilter", {"None", nullptr, nullptr}, nullptr, "colour",
        Verdict::fail, "each pixel sees one colour only",
        "use the monochrome model of this camera"},
    {"TestPattern", {"Off", "False", nullptr}, nullptr, "test-image",
        Verdict::fail, "the camera sends a test picture",
        "set TestPattern=Off"},
    {"Gamma", {"1", nullptr, nullptr}, "GammaEnable", "gamma", Verdict::fail,
        "pixel values are not proportional to light", "set Gamma=1"},
    {"ExposureAuto", {"Off", nullptr, nullptr}, nullptr, "auto-exposure",
        Verdict::fail, "the camera changes its exposure by itself",
        "set ExposureAuto=Off"},
    {"GainAuto", {"Off", nullptr, nullptr}, nullptr, "auto-gain", Verdict::fail,
        "the camera changes its gain by itself", "set GainAuto=Off"},
    {"BalanceWhiteAuto", {"Off", nullptr, nullptr}, nullptr,
        "auto-white-balance", Verdict::fail,
        "the camera changes the gain of its colours by itself",
        "set BalanceWhiteAuto=Off"},
    {"LUTEnable", {"false", "False", "0"}, nullptr, "lut", Verdict::fail,
        "a table changes pixel values, which need not stay proportional to "
        "light",
        "set LUTEnable=false"},
    {"BlackLevelClampingEnable", {"false", "False", "0"}, nullptr,
        "black-clamp", Verdict::warn,
        "the camera moves its black level with the picture",
        "set BlackLevelClampingEnable=false"},
    {"BlackLevelAuto", {"Off", nullptr, nullptr}, nullptr, "black-clamp",
        Verdict::warn, "the camera moves its black level with the picture",
        "set BlackLevelAuto=Off"},
    {"BinningHorizontal", {"1", nullptr, nullptr}, nullptr, "binning",
        Verdict::warn, "a pixel value is that of several pixels",
        "set BinningHorizontal=1"},
    {"BinningVertical", {"1", nullptr, nullptr}, nullptr, "binning",
        Verdict::warn, "a pixel value is that of several pixels",
        "set BinningVertical=1"},
    {"DecimationHorizontal", {"1", nullptr, nullptr}, nullptr, "binning",
        Verdict::warn, "pixels are left out", "set DecimationHorizontal=1"},
    {"DecimationVertical", {"1", nullptr, nullptr}, nullptr, "binning",
        Verdict::warn, "pixels are left out", "set DecimationVertical=1"},
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

bool
is_off (const RigParts &parts, const char *name)
{
  const std::string *text = name ? feature (parts, name) : nullptr;
  return text && (*text == "false" || *text == "False" || *text == "0");
}

bool
is_good (const Rule &rule, const std::string &value)
{
  const auto same = [&value] (const char *good) {
    const auto a = good ? parse_real (good) : std::nullopt;
    const auto b = parse_real (value);
    return good && (value == good || (a && b && *a == *b));
  };
  return std::ranges::any_of (rule.good, same);
}

void
check_features (const RigParts &parts, Finding &finding)
{
  for (const Rule &rule : kRules) {
    const std::string *value = feature (parts, rule.feature);
    if (!value || is_off (parts, rule.unless) || is_good (rule, *value))
      continue;
    finding.diagnoses.push_back ({rule.id, rule.severity,
        std::string (rule.feature) + " is " + *value + ": " + rule.cause,
        rule.remedy});
  }
}

void
check_picture (const RigParts &parts, Finding &finding)
{
  for (const auto &[side, most] :
      {std::pair{"Width", "WidthMax"}, std::pair{"Height", "HeightMax"}}) {
    const auto used = number (parts, side), all = number (parts, most);
    if (used && all && *used < *all)
      finding.diagnoses.push_back ({"roi", Verdict::warn,
          std::string (side) + " is " + real_text (*used) + " of " +
              real_text (*all) +
              " pixels: the camera sends a part of its field",
          std::string ("set ") + side + "=" + real_text (*all) +
              ", unless this region is intended"});
  }
  const std::string *formats = feature (parts, "PixelFormat.available");
  const bool deeper =
      formats && (formats->find ("Mono12") != std::string::npos ||
                     formats->find ("Mono10") != std::string::npos);
  if (parts.bits <= 8 && deeper)
    finding.diagnoses.push_back ({"pixel-format", Verdict::warn,
        "frames have " + std::to_string (parts.bits) +
            " bits, but the camera " + "offers " + *formats +
            ": noise is rounded away",
        "set --pixel-format Mono12"});
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
      finding.diagnoses.push_back ({"firmware", Verdict::warn,
          "the DMD has firmware " + text + ", which is older than " +
              std::to_string (kOldest) + ".0 and not known to work",
          "update it with TI's program"});
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
  char text[32];
  std::snprintf (text, sizeof text, "%.3g MB", bytes / 1e6);
  return text;
}

void
check_host (const RigParts &parts, const HostFacts &host, Finding &finding)
{
  const double needed = frame_bytes (parts) * parts.rate.num / parts.rate.den;
  if (host.disk_rate) {
    const double rate = host.disk_rate->value;
    finding.readings.push_back (
        {"disk", {rate / 1e6, host.disk_rate->sigma / 1e6}, "MB/s",
            "at least " + megabytes (needed) + "/s"});
    if (rate < 2 * needed)
      finding.diagnoses.push_back ({"slow-disk",
          rate < needed ? Verdict::fail : Verdict::warn,
          "the disk takes " + megabytes (rate) + "/s, and recording needs " +
              megabytes (needed) + "/s before compression",
          "choose an --output folder on a faster disk"});
  }
  const auto packet = number (parts, "GevSCPSPacketSize");
  if (packet && *packet < kSmallPacket)
    finding.diagnoses.push_back ({"packet-size", Verdict::warn,
        "packets of the camera have " + real_text (*packet) +
            " bytes, so that there are many of them",
        "set the MTU of the network interface to 9000, and packet-size with "
        "it"});
  if (packet && host.socket_buffer > 0 &&
      host.socket_buffer < frame_bytes (parts))
    finding.diagnoses.push_back ({"socket-buffer", Verdict::warn,
        "a frame has " + megabytes (frame_bytes (parts)) +
            ", but the network buffers of this machine hold " +
            megabytes (host.socket_buffer),
        "run sysctl net.core.rmem_max=33554432"});
}

/** Frames that are missing between those that came: their stamps are whole
 * periods apart, some of them one. */
int
missing_frames (const std::vector<SeenFrame> &seen, double period)
{
  constexpr double kNear = 0.1; // of a period
  int missing = 0, steps_of_one = 0;
  for (std::size_t k = 1; k < seen.size (); k++) {
    const double steps = double (seen[k].time - seen[k - 1].time) / period;
    const double whole = std::max (1.0, std::round (steps));
    if (std::abs (steps - whole) > kNear)
      return 0;
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
  for (const auto &[name, count] : {std::pair{"damaged frames", damaged},
           std::pair{"missing frames", missing}})
    finding.readings.push_back (
        {name, {double (count), std::sqrt (double (count))},
            "of " + std::to_string (all), "0"});
  const std::string of_all = " of " + std::to_string (all) + " frames ";
  const std::string remedy =
      "connect the camera to a network interface of its own, and check cable "
      "and switch";
  if (damaged > 0)
    finding.diagnoses.push_back ({"packet-loss", Verdict::fail,
        std::to_string (damaged) + of_all + "lack packets", remedy});
  else if (missing > kMissingPart * all)
    finding.diagnoses.push_back ({"lose", Verdict::fail,
        std::to_string (missing) + of_all + "did not come", remedy});
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
  check_firmware (parts, finding);
  check_host (parts, examination.host, finding);
  RETURN_IF_ERROR (check_network (examination, finding));
  std::ranges::stable_sort (
      finding.diagnoses, std::ranges::greater (), &Diagnosis::severity);

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
  const auto add = [&] (const char *id, const char *remedy) {
    finding.diagnoses.push_back ({id, Verdict::fail, why.message, remedy});
  };
  if (camera)
    add ("camera-missing",
        "check its cable and power, and whether another program has it open; "
        "gst-device-monitor-1.0 Source/Video lists the cameras");
  else if (why.code == ErrorCode::denied)
    add ("dmd-permission",
        "install the udev rule 60-codedexposure-dmd.rules and connect the "
        "board again");
  else if (why.code == ErrorCode::busy)
    add ("dmd-busy", "close the other program that uses the board");
  else
    add ("dmd-missing",
        "check its cable and power; codedexposure dmd list shows the boards");
  return finding;
}

} // namespace codedexposure
