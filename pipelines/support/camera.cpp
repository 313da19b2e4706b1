/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-camera: an emulated GigE Vision camera that serves the coded
 * frames of a GStreamer pipeline, or what a bench with an emulated DMD on the
 * USB shows. */
#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <memory>
#include <string>
#include <thread>

#include <CLI/CLI.hpp>
#include <gst/app/gstappsink.h>
#include <gst/gst.h>

#include "base/text.h"
#include "base/try.h"
#include "bench/gige_camera.h"
#include "bench/simulated_rig.h"
#include "common/raii.h"
#include "usb_board.h"

using namespace codedexposure;
using namespace codedexposure::gst;

namespace
{

struct Arguments {
  GigeCameraOptions camera;
  std::string pipeline;
  std::string faults;
  std::string jitter = "0";
  std::string dmd;
  std::string size = "768x576";
  int bits = 0;
  bool loop = false;
  bool log = false;
};

void
say (const std::string &text)
{
  std::fprintf (stderr, "codedexposure-camera: %s\n", text.c_str ());
}

/* Reads the coded frames of a pipeline one by one. */
class Frames
{
public:
  static Result<std::unique_ptr<Frames>> open (
      const std::string &line, bool loop)
  {
    GError *error = nullptr;
    GstElement *pipeline = gst_parse_launch (
        (line + " ! appsink name=frames sync=false max-buffers=4 "
                "caps=\"video/x-raw,format={GRAY8,GRAY16_LE}\"")
            .c_str (),
        &error);
    if (error) {
      Error why{error->message};
      g_error_free (error);
      return why;
    }
    auto frames = std::unique_ptr<Frames> (new Frames);
    frames->loop_ = loop;
    frames->pipeline_.reset (GST_ELEMENT (gst_object_ref_sink (pipeline)));
    frames->sink_.reset (
        GST_APP_SINK (gst_bin_get_by_name (GST_BIN (pipeline), "frames")));
    gst_element_set_state (pipeline, GST_STATE_PLAYING);
    if (!frames->advance ())
      return Error{frames->why_ended ()};
    return frames;
  }
  ~Frames ()
  {
    if (pipeline_)
      gst_element_set_state (pipeline_.get (), GST_STATE_NULL);
  }

  const GstVideoInfo &info () const { return info_; }
  bool is_wide () const
  {
    return GST_VIDEO_INFO_FORMAT (&info_) == GST_VIDEO_FORMAT_GRAY16_LE;
  }
  bool ended () const { return ended_; }

  /* The next frame; false at the end. */
  bool take (ImageView<std::uint16_t> picture)
  {
    if (!sample_ && !advance ())
      return false;
    MappedFrame mapped (
        info_, gst_sample_get_buffer (sample_.get ()), GST_MAP_READ);
    if (mapped && is_wide ())
      copy (view_of<const std::uint16_t> (mapped), picture);
    else if (mapped)
      copy (view_of<const std::uint8_t> (mapped), picture);
    mapped.reset ();
    sample_.reset ();
    return true;
  }

  std::string why_ended () const
  {
    const ObjectPtr<GstBus> bus (gst_element_get_bus (pipeline_.get ()));
    std::unique_ptr<GstMessage, MiniObjectUnref> message (
        gst_bus_pop_filtered (bus.get (), GST_MESSAGE_ERROR));
    if (!message)
      return "the pipeline ended";
    GError *error = nullptr;
    gst_message_parse_error (message.get (), &error, nullptr);
    std::string text = error->message;
    g_error_free (error);
    return text;
  }

private:
  struct SampleUnref {
    void operator() (GstSample *sample) const { gst_sample_unref (sample); }
  };

  Frames () = default;

  bool advance ()
  {
    sample_.reset (gst_app_sink_pull_sample (sink_.get ()));
    if (!sample_ && loop_ && gst_app_sink_is_eos (sink_.get ()) &&
        gst_element_seek_simple (
            pipeline_.get (), GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH, 0))
      sample_.reset (gst_app_sink_pull_sample (sink_.get ()));
    ended_ = !sample_ || !gst_video_info_from_caps (
                             &info_, gst_sample_get_caps (sample_.get ()));
    return !ended_;
  }

  template <typename Pixel>
  static void copy (ImageView<const Pixel> from, ImageView<std::uint16_t> to)
  {
    for (int y = 0; y < to.height; y++)
      std::copy_n (from.row (y), to.width, to.row (y));
  }

  ObjectPtr<GstElement> pipeline_;
  ObjectPtr<GstAppSink> sink_;
  std::unique_ptr<GstSample, SampleUnref> sample_;
  GstVideoInfo info_ = {};
  bool loop_ = false;
  std::atomic<bool> ended_ = false;
};

const char *
fault_text (Fault::Kind kind)
{
  static constexpr const char *names[] = {
      "sent", "lose", "incomplete", "delay", "duplicate", "late", "stop"};
  return names[int (kind)];
}

void
log_frame (const SentFrame &sent)
{
  std::printf ("{\"frame\":%llu,\"device_ns\":%lld,\"host_ns\":%lld,"
               "\"fault\":\"%s\"}\n",
      static_cast<unsigned long long> (sent.frame),
      static_cast<long long> (sent.device_time),
      static_cast<long long> (sent.host_time), fault_text (sent.fault.kind));
  std::fflush (stdout);
}

/* Adds faults from standard input; the thread ends with the process. */
void
read_faults (GigeCamera &camera)
{
  std::thread ([&camera] {
    for (std::string line; std::getline (std::cin, line);)
      if (const auto added = camera.add_faults (line); !added)
        say (added.error ().message);
  }).detach ();
}

/* Blocked before the thread of the camera starts, which inherits this. */
sigset_t
block_ends ()
{
  sigset_t ends;
  sigemptyset (&ends);
  sigaddset (&ends, SIGINT);
  sigaddset (&ends, SIGTERM);
  pthread_sigmask (SIG_BLOCK, &ends, nullptr);
  return ends;
}

void
say_serving (const GigeCameraOptions &options)
{
  say ("serving " + std::to_string (options.width) + "x" +
       std::to_string (options.height) + " as Aravis-Fake-" + options.serial +
       " at " + options.address);
}

/* Coded frames of the pipeline. */
Result<void>
serve_pipeline (Arguments &arguments)
{
  GigeCameraOptions &options = arguments.camera;
  RETURN_IF_ERROR (options.faults.add (arguments.faults));
  ASSIGN_OR_RETURN (
      const auto frames, Frames::open (arguments.pipeline, arguments.loop));
  Frames &source = *frames;
  options.width = source.info ().width;
  options.height = source.info ().height;
  options.bits = arguments.bits > 0  ? arguments.bits
                 : source.is_wide () ? 16
                                     : 8;
  const sigset_t ends = block_ends ();
  ASSIGN_OR_RETURN (const auto camera,
      GigeCamera::open (
          options, [&] (std::uint64_t, ImageView<std::uint16_t> picture) {
            return source.take (picture);
          }));
  say_serving (options);
  read_faults (*camera);
  const timespec moment{0, 100'000'000};
  while (!source.ended () && sigtimedwait (&ends, nullptr, &moment) < 0)
    ;
  if (source.ended ())
    say (source.why_ended ());
  return {};
}

/* Words with '@' are faults of frames; the others are of the bench. */
Result<SickBenchOptions>
bench_of (Arguments &arguments)
{
  std::string frames, bench;
  for (const std::string_view word : split (arguments.faults, ' '))
    (word.find ('@') == word.npos ? bench : frames) += std::string (word) + " ";
  RETURN_IF_ERROR (arguments.camera.faults.add (frames));
  const auto size = parse_size (arguments.size);
  if (!size)
    return Error{"size " + in_quotes (arguments.size) +
                 " is not WIDTHxHEIGHT; write for example 256x192"};
  SickBenchOptions options;
  options.camera = *size;
  options.rate = {
      int (std::lround (arguments.camera.trigger_rate * 1000)), 1000};
  options.bits = arguments.bits > 0 ? arguments.bits : 8;
  options.seed = arguments.camera.seed;
  RETURN_IF_ERROR (inflict (options, bench));
  return options;
}

/* The camera's side of a bench. */
void
look_at (LiveBench &bench, GigeCameraOptions &camera)
{
  const SickBenchOptions &options = bench.truth ().options;
  camera.width = options.camera.width;
  camera.height = options.camera.height;
  camera.bits = options.bits;
  camera.packet_loss = std::max (camera.packet_loss, options.packet_loss);
  camera.jitter = std::max (camera.jitter, options.frame_jitter);
  camera.features = camera_features (options);
  camera.deep = options.has ("pixel-format");
  if (options.trigger == SickBenchOptions::Trigger::double_rate)
    camera.trigger_rate *= 2;
  camera.shoot = [&bench] (ImageView<std::uint16_t> picture) {
    return bench.take (picture);
  };
  camera.started = [&bench] { bench.skip (); };
  camera.set_up = [&bench, say_set_up = camera.set_up] (
                      const CameraSettings &settings) {
    const double period = 1e6 / settings.frame_rate;
    bench.expose (settings.exposure_us < period
                      ? std::optional (Nanoseconds (settings.exposure_us * 1e3))
                      : std::nullopt);
    say_set_up (settings);
  };
}

/* What the board on the USB shows. */
Result<void>
serve_board (Arguments &arguments)
{
  ASSIGN_OR_RETURN (const int kind, board_kind (arguments.dmd));
  ASSIGN_OR_RETURN (SickBenchOptions options, bench_of (arguments));
  const bool dark = options.has ("camera-missing");
  const char *disk =
      options.has ("slow-disk") ? " CODEDEXPOSURE_SLOW_DISK=1" : "";
  /* The camera bends its values itself. */
  ASSIGN_OR_RETURN (
      const auto bench, LiveBench::make (std::move (options), kind));
  ASSIGN_OR_RETURN (const auto board, UsbBoard::plug (*bench));
  look_at (*bench, arguments.camera);
  const sigset_t ends = block_ends ();
  std::unique_ptr<GigeCamera> camera;
  if (!dark) {
    ASSIGN_OR_RETURN (camera, GigeCamera::open (arguments.camera, {}));
    read_faults (*camera);
  }
  say ("USB " + board->environment () + disk);
  say_serving (arguments.camera);
  int signal = 0;
  sigwait (&ends, &signal);
  return {};
}

int
serve (Arguments &arguments)
{
  const auto jitter = parse_time (arguments.jitter);
  if (!jitter) {
    say (jitter.error ().message);
    return 1;
  }
  GigeCameraOptions &options = arguments.camera;
  options.jitter = *jitter;
  options.set_up = [] (const CameraSettings &settings) {
    say ("sends " + camera_settings_text (settings));
  };
  if (arguments.log)
    options.sent = log_frame;
  const auto served = arguments.dmd.empty () ? serve_pipeline (arguments)
                                             : serve_board (arguments);
  if (!served)
    say (served.error ().message);
  return served ? 0 : 1;
}

} // namespace

int
main (int argc, char **argv)
{
  gst_init (&argc, &argv);
  Arguments arguments;
  GigeCameraOptions &camera = arguments.camera;
  CLI::App app{"Serves the coded frames of a GStreamer pipeline as a GigE "
               "Vision camera, one for each exposure of the camera. Faults can "
               "also be entered on standard input, such as lose@now:3."};
  app.add_option (
      "pipeline", arguments.pipeline, "GStreamer pipeline description");
  app.add_option ("--dmd", arguments.dmd,
      "in place of a pipeline: the camera sees an emulated DMD, dlp6500 or "
      "dlp5500, on an emulated USB");
  app.add_option ("--size", arguments.size, "pixels of the camera, with --dmd")
      ->capture_default_str ();
  app.add_option ("--address", camera.address, "address of the interface")
      ->capture_default_str ();
  app.add_option ("--serial", camera.serial, "serial number")
      ->capture_default_str ();
  app.add_option ("--bits", arguments.bits, "significant bits of the frames")
      ->check (CLI::Range (1, 16));
  app.add_option ("--trigger-rate", camera.trigger_rate,
         "rate of the trigger on its lines, 1/s")
      ->check (CLI::Range (0.1, 1000.0))
      ->capture_default_str ();
  app.add_option ("--drift", camera.drift, "how much its clock is fast, ppm")
      ->check (CLI::Range (-500.0, 500.0));
  app.add_option (
      "--jitter", arguments.jitter, "max random delay of frames, such as 5ms");
  app.add_option ("--packet-loss", camera.packet_loss,
         "part of the packets that is lost, 0 to 1")
      ->check (CLI::Range (0.0, 1.0));
  app.add_option ("--seed", camera.seed, "seed of the jitter");
  app.add_option ("--faults", arguments.faults,
      "faults of frames: lose@10:3 incomplete@20 delay@30:5ms duplicate@40 "
      "late@50 stop@60");
  app.add_flag ("!--no-outputs", camera.outputs,
      "no line is an output, and it has no feature LineSelector");
  app.add_flag ("--loop", arguments.loop, "restart the pipeline at its end");
  app.add_flag ("--log", arguments.log, "print a line of JSON for every frame");
  CLI11_PARSE (app, argc, argv);
  if (arguments.faults == "help") {
    std::fputs (fault_help ().c_str (), stdout);
    return 0;
  }
  if (arguments.pipeline.empty () == arguments.dmd.empty ()) {
    say ("give either a pipeline or --dmd");
    return 1;
  }
  const int result = serve (arguments);
  gst_deinit ();
  return result;
}
