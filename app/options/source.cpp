/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "source.h"

#include <filesystem>
#include <memory>

#include <gst/pbutils/pbutils.h>

#include "base/text.h"
#include "common/raii.h"
#include "common/tag.h"
#include "failure.h"

namespace codedexposure::app
{

namespace
{

/* Of videotestsrc. */
Rule<Text>
patterns ()
{
  return one_of ({"ball", "bar", "black", "blink", "blue", "checkers-1",
      "checkers-2", "checkers-4", "checkers-8", "chroma-zone-plate", "circular",
      "colors", "gamut", "gradient", "green", "pinwheel", "red", "smpte",
      "smpte-rp-219", "smpte100", "smpte75", "snow", "solid-color", "spokes",
      "white", "zone-plate"});
}

Rule<Text>
pixel_formats ()
{
  return one_of ({"Mono8", "Mono10", "Mono10Packed", "Mono10p", "Mono12",
      "Mono12Packed", "Mono12p", "Mono16"});
}

} // namespace

void
SourceOptions::declare_scene (Options &options, Kind kind)
{
  options.heading ("Scene (each frame is one slot of the exposure)");
  options.value (
      "--input", input, "FILE", "video file; each frame becomes one slot");
  options.value ("--input-rate", input_rate, "R",
      "frame rate of the input, if the file does not have one",
      frame_rate_rule ());
  options.value ("--scene", scene, "NAME",
      std::string ("a drawn scene: candle, blown-out or pour") +
          (kind == Kind::watched ? " [pour]" : ""),
      one_of ({"candle", "blown-out", "pour"}));
  options.value ("--pattern", pattern, "NAME",
      std::string ("a moving test picture, as of videotestsrc") +
          (kind == Kind::watched ? "" : " [ball]"),
      patterns ());
  options.value ("--size", size, "WxH",
      "size of scene and camera [that of the input; 768x576]", picture_size ());
  options.value ("--bits", bits, "N",
      "significant bits of the camera, 8 to 16 [8]", whole (8, 16));
  options.need ({"--input-rate"}, "--input");
  options.exclude ({"--scene", "--pattern"}, "--input");
  options.exclude ({"--pattern"}, "--scene");
}

void
SourceOptions::declare_bench (Options &options, Kind kind)
{
  constexpr double kMost = 1e9;
  const Rule<double> at_least_0 = real (0, kMost, "a number of at least 0");
  const bool examined = kind == Kind::examined;
  options.heading ("Bench");
  options.value ("--schedule", schedule, "S",
      "CODE:TILE[,key=value...] or a JSON file [sequential:2x2]");
  options.value ("--frame-rate", frame_rate, "R",
      "coded frames/s, such as 25 or 30000/1001 [25]", frame_rate_rule ());
  options.value ("--bench", bench, "FILE",
      examined ? "bench profile (JSON) whose numbers the simulated bench has "
                 "[drawn by the seed]"
               : "bench profile (JSON) of camera and DMD; the simulated bench "
                 "has its noise, black level, leakage, blur and mapping, "
                 "recordings carry it, and other options win");
  options.value ("--seed", seed, "N",
      examined ? "seed of the simulated bench [1]" : "seed of the noise [0]",
      Rule<std::uint64_t>{
          [] (const std::string &text) -> std::optional<std::uint64_t> {
            if (text.empty () || text.size () >= 20 ||
                text.find_first_not_of ("0123456789") != text.npos)
              return std::nullopt;
            return std::stoull (text);
          },
          "a whole number"});
  if (examined) {
    options.exclude ({"--bench", "--seed"}, "--camera");
    return;
  }
  options.value ("--frames", frames, "N", "stop after N coded frames",
      whole (1, 999'999'999, "a number of coded frames"));
  options.value ("--full-well", full_well, "E",
      "electrons at white, e-; 0: no noise [0]", at_least_0);
  options.value (
      "--read-noise", read_noise, "E", "read noise, e- rms [0]", at_least_0);
  options.value ("--psf-sigma", psf_sigma, "P", "blur of the lens, pixels [0]",
      at_least_0);
  options.value ("--gain", gain, "G",
      "gain; 0: automatic, white maps to the largest value [0]", at_least_0);
  options.value (
      "--shift-x", shift_x, "P", "misalignment, pixels", any_real ());
  options.value (
      "--shift-y", shift_y, "P", "misalignment, pixels", any_real ());
  options.value (
      "--rotation", rotation, "DEG", "misalignment, degrees", any_real ());
  options.value ("--scale", scale, "F", "magnification [1]", at_least_0);
  if (kind == Kind::simulated)
    return;
  for (const char *other : {"--camera", "--source"}) {
    options.exclude (
        {"--input", "--scene", "--pattern", "--psf-sigma", "--gain", "--seed",
            "--shift-x", "--shift-y", "--rotation", "--scale"},
        other);
    if (kind != Kind::watched)
      options.exclude ({"--full-well", "--read-noise"}, other);
  }
}

void
SourceOptions::declare_camera (Options &options, Kind kind)
{
  const bool examined = kind == Kind::examined;
  options.heading (
      examined ? "Instead of the simulated bench" : "Instead of the bench");
  options.value ("--camera", camera, "NAME",
      "a GenICam camera, as \"codedexposure camera list\" shows it");
  if (!examined)
    options.value ("--trigger", trigger, "M",
        "which device triggers: dmd, camera, or none [dmd]",
        one_of ({"dmd", "camera", "none"}));
  options.value ("--trigger-line", trigger_line, "L",
      examined ? "line of the camera from the DMD [Line0]"
               : "line of the camera to or from the DMD [Line0; Line1]");
  options.value ("--trigger-edge", trigger_edge, "E",
      "rising or falling [rising]", one_of ({"rising", "falling"}));
  options.value ("--exposure", exposure, "US",
      examined ? "longest exposure time, microseconds [99 % of the period]"
               : "exposure time, microseconds [as the camera has it]",
      real (1e-3, 1e8, "a time in microseconds"));
  options.value ("--pixel-format", pixel_format, "F",
      "Mono8, Mono12, Mono12Packed ... [Mono8; Mono16]", pixel_formats ());
  options.value (
      "--features", features, "\"A=1 ...\"", "camera features beyond these");
  options.value ("--device", device, "DEV",
      examined ? "the DMD [usb:]"
               : "the DMD, or external: another program drives it\n"
                 "[sim:bench on the bench]");
  options.need ({"--trigger", "--trigger-line", "--trigger-edge", "--exposure",
                    "--pixel-format", "--features", "--reconnect"},
      "--camera");
  if (examined) {
    options.need ({"--device"}, "--camera");
    return;
  }
  options.value ("--reconnect", reconnect, "N",
      "tries to restart a camera that went away [0]",
      whole (0, 999'999'999, "a number of tries"));
  options.value (
      "--source", source, "\"GST\"", "any GStreamer source of coded frames");
  options.exclude ({"--source"}, "--camera");
}

void
SourceOptions::declare (Options &options, Kind kind)
{
  if (kind != Kind::simulated)
    declare_camera (options, kind);
  if (kind != Kind::examined)
    declare_scene (options, kind);
  declare_bench (options, kind);
}

std::string
rate_text (FrameRate rate)
{
  return std::to_string (rate.num) + "/" + std::to_string (rate.den);
}

BenchProfile
bench_of (const char *option, const std::string &path)
{
  auto profile = BenchProfile::parse (path);
  if (!profile)
    usage_error (std::string (option) + " " + path +
                 " is not valid: " + profile.error ().message);
  return *profile;
}

namespace
{

void
use_bench (SourcePlan &plan, const SourceOptions &options)
{
  plan.bench = bench_of ("--bench", *options.bench).of_beam (options.off_beam);
  plan.size = plan.bench->camera.size;
  plan.bits = plan.bench->bits;
  if (options.camera && !plan.bench->pixel_format.empty ())
    plan.pixel_format = plan.bench->pixel_format;
  if (options.source && !options.device && !options.schedule)
    usage_error ("--bench with --source needs --schedule, or --device for the "
                 "DMD");
}

/* Reads the head of the video. */
void
use_input (SourcePlan &plan, const SourceOptions &options)
{
  constexpr GstClockTime kPatience = 30 * GST_SECOND;
  const std::string &path = *options.input;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file (path, ignored))
    fail ("cannot read " + path + "; give the name of a video file");
  const gst::ObjectPtr<GstDiscoverer> discoverer (
      gst_discoverer_new (kPatience, nullptr));
  const gst::CharPtr uri (gst_filename_to_uri (path.c_str (), nullptr));
  const gst::ObjectPtr<GstDiscovererInfo> info (
      discoverer && uri
          ? gst_discoverer_discover_uri (discoverer.get (), uri.get (), nullptr)
          : nullptr);
  const std::unique_ptr<GList, FreeWith<gst_discoverer_stream_info_list_free>>
      streams (
          info ? gst_discoverer_info_get_video_streams (info.get ()) : nullptr);
  if (!streams)
    fail (path + " is no video that the installed decoders can read");
  auto *video = GST_DISCOVERER_VIDEO_INFO (streams->data);
  for (const GstTagList *tags : {gst_discoverer_info_get_tags (info.get ()),
           gst_discoverer_stream_info_get_tags (
               GST_DISCOVERER_STREAM_INFO (video))})
    if (tags && gst::setup_from_tags (tags))
      fail (path + " has coded frames, which are no scene; decode it first",
          Exit::usage);
  plan.size = {int (gst_discoverer_video_info_get_width (video)),
      int (gst_discoverer_video_info_get_height (video))};
  plan.input_rate = options.input_rate.value_or (
      FrameRate{int (gst_discoverer_video_info_get_framerate_num (video)),
          int (gst_discoverer_video_info_get_framerate_denom (video))});
  if (plan.input_rate.num == 0)
    usage_error (path + " has no fixed frame rate; set --input-rate");
}

/* A shorter exposure leaves masks out, and a longer one misses the trigger of
 * the next frame; what is recorded of a frame would then be wrong. */
void
check_exposure (const SourcePlan &plan, double exposure)
{
  const SlotPlan slots = value_of (SlotPlan::fit (plan.schedule.timing (),
                                       plan.schedule.slots (), plan.frame_rate),
      Exit::usage);
  const double least = 1e-3 * double (slots.start (slots.slots () - 1));
  const double most = 1e-3 * double (slots.frame_period ());
  if (exposure <= least || exposure > most)
    usage_error ("--exposure " + real_text (exposure) + " does not fit " +
                 plan.schedule.text () + ": the last slot begins after " +
                 real_text (least) + " us, and the next frame after " +
                 real_text (most) + " us; set a time between them, such as " +
                 real_text (1e-3 * double (slots.exposure ())));
}

} // namespace

void
SecondCamera::declare (Options &options)
{
  options.value (
      "--second-camera", camera, "NAME", "that camera, beside --camera");
  options.value ("--second-bench", bench, "FILE",
      "what was measured with it [what --bench says of a second camera]");
  options.value ("--second-size", size, "WxH",
      "size of its frames [that of its profile; that of the first camera]",
      picture_size ());
  options.need ({"--second-size"}, "--second-camera");
}

void
SecondCamera::declare_relations (Options &options) const
{
  options.need ({"--second-camera", "--second-bench"}, "--second");
  options.need ({"--second-camera"}, "--camera");
  options.exclude ({"--source"}, "--second");
}

void
SecondCamera::check (const SourceOptions &first) const
{
  if (first.camera && !camera)
    usage_error ("two cameras are used, but only --camera " + *first.camera +
                 " is named; name the other one by --second-camera");
  if (first.camera && *first.camera == *camera)
    usage_error ("--camera and --second-camera are both " + *first.camera +
                 "; name two cameras");
  if (bench)
    bench_of ("--second-bench", *bench);
}

SourceOptions
SecondCamera::options (const SourceOptions &first) const
{
  SourceOptions options = first;
  options.device.reset ();
  options.camera = camera;
  options.bench = bench;
  if (!bench && first.bench &&
      !bench_of ("--bench", *first.bench).second.empty ())
    options.bench = first.bench;
  options.off_beam = true;
  if (options.bench)
    options.size.reset (); // that of its camera
  if (size)
    options.size = size;
  return options;
}

SourcePlan
SourcePlan::make (const SourceOptions &options)
{
  SourcePlan plan;
  if (options.is_simulated () && options.device == "external")
    usage_error ("--device external is for a DMD beside a camera, and the "
                 "simulated bench has none; set --camera, or leave it out");
  const std::string text = options.schedule_text ();
  auto schedule = Schedule::parse (text);
  if (!schedule)
    usage_error (
        "--schedule " + text + " is not valid: " + schedule.error ().message);
  plan.schedule = std::move (*schedule);
  if (options.bench)
    use_bench (plan, options);
  if (options.input)
    use_input (plan, options);
  plan.frame_rate = options.frame_rate.value_or (plan.frame_rate);
  plan.size = options.size.value_or (plan.size);
  plan.bits = options.bits.value_or (plan.bits);
  plan.pixel_format = options.pixel_format.value_or (plan.pixel_format);
  const Extent cell = plan.schedule.cell ();
  if (plan.size.width < cell.width || plan.size.height < cell.height)
    usage_error (size_text (plan.size) +
                 " pixels are less than one exposure group of " + text + ", " +
                 size_text (cell) + "; set a larger --size");
  if (options.exposure)
    check_exposure (plan, *options.exposure);
  return plan;
}

} // namespace codedexposure::app
