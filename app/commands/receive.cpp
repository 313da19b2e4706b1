/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure receive: coded frames of another machine to subframes. */
#include "base/text.h"
#include "command.h"
#include "options/network.h"
#include "options/picture.h"
#include "pipeline/decoder.h"
#include "pipeline/program.h"
#include "pipeline/recording.h"
#include "pipeline/status.h"
#include "pipeline/video_output.h"
#include "window/window.h"

namespace codedexposure::app
{

namespace
{

constexpr double kWait = 10; // s

class Receive
{
public:
  void declare (Options &options)
  {
    declared_ = &options;
    options.heading ("");
    address_.declare (options, "address of the sender", "its TCP port");
    options.value ("--wait", wait_, "SECONDS",
        "how long to try to connect [10]", seconds ());
    decode_.declare_method (options, "the stream");
    decode_.declare_frames (options, "the stream");
    options.value ("--output", output_, "OUT",
        "subframes: .mkv (FFV1, lossless), .mp4 (H.264), .ome.tif, .h5, "
        ".ome.zarr or FOLDER/");
    options.value ("--coded", coded_, "FILE.mkv",
        "coded frames, in the format of \"codedexposure record\"",
        file_ending_in (".mkv"));
    window_.declare (options);
    run_.declare (options);
    options.exclude ({"--sink", "--keep-on"}, "--output");
  }

  Exit run ()
  {
    check ();
    if (!run_.print)
      address_.check ();
    start_gstreamer ();
    Job job ("receive", run_);
    job.ends_by_signal = true;
    job.retry = wait_.value_or (kWait);
    build (job);
    const Exit exit = play (job).exit;
    say (exit);
    return exit;
  }

private:
  bool has_window () const { return !output_ && (!coded_ || window_.sink); }

  /* What the relations between options cannot say. */
  void check () const
  {
    if (run_.force && !output_ && !coded_)
      usage_error ("--force is for --output and --coded; leave it out");
    if (window_.keep_on && !has_window ())
      usage_error (
          "--keep-on is for a window, and --coded keeps all frames; set "
          "--sink as well, or leave it out");
    for (const char *name : {"--method", "--mapping", "--schedule", "--bits"})
      if (declared_->has (name) && !output_ && !has_window ())
        usage_error (name +
                     std::string (" is for subframes; set --output OUT, "
                                  "or leave ") +
                     name + " out");
  }

  void build (Job &job) const
  {
    constexpr int kWaiting = 50; // frames: a receiver that is late gets them
    constexpr GstClockTime kDelay = GST_SECOND / 5; // of the window
    Chain frames = read_sender (job, address_.host (), address_.port ());
    GstElement *entry = frames.queue (kWaiting).last ();
    if (has_window ())
      job.times.shift_to = kDelay;
    else if (!output_ || form_of (*output_) != VideoForm::mp4)
      keep_times (entry);
    if (coded_) {
      GstElement *tee = frames.to ("tee").last ();
      Chain recorded = job.graph.from (tee, "src_%u");
      write_recording (job, recorded, *coded_, {});
      frames = job.graph.from (tee, "src_%u");
    }
    if (has_window ())
      job.keeper = window_.add_keeper (frames, "receive", decode_.bits);
    DecoderPads pads = add_demux (job, frames, decode_);
    job.counted = entry;
    if (has_window ()) {
      add_window (job, {pads.coded (), pads.pictures}, window_, decode_.bits);
      return;
    }
    Chain pictures = pads.pictures.to ("queue");
    VideoStyle style;
    style.bits = decode_.bits;
    style.coded = job.counted;
    if (output_)
      write_video (job, pictures, *output_, style);
    else
      pictures.to ("fakesink");
  }

  void say (Exit exit) const
  {
    Status status ("receive", false);
    if (exit == Exit::nobody)
      status.line (
          "nobody listens at " + address_.host () + ":" +
          std::to_string (address_.port ()) + " after " +
          real_text (wait_.value_or (kWait)) +
          " s; start \"codedexposure send\" there, or increase --wait");
    else if (exit == Exit::damaged)
      status.line (
          "the stream is not complete" +
          std::string (output_ || coded_ ? "; what came was kept" : ""));
  }

  const Options *declared_ = nullptr;
  AddressOptions address_;
  DecodeOptions decode_;
  WindowOptions window_;
  RunOptions run_;
  std::optional<double> wait_;
  std::optional<Text> output_, coded_;
};

} // namespace

Command
receive_command ()
{
  return make_command<Receive> ({.name = "receive",
      .summary = "receive coded frames, to watch or to keep them",
      .usage = "[option...]",
      .description = R"(
Receives the coded frames of "codedexposure send" and splits them. Shows them in
a window, or writes files. May be started before or after the sender. Ends with
the stream, with Ctrl-C or when the window is closed.

)" + WindowOptions::keys_of ("receive"),
      .notes = R"(
Exit status: 3 if the sender ended in the middle, or frames were damaged; 4 if
nobody listens at that address; 130 stopped before the first frame.

Examples:
  Subframes of a sender on this machine, as a video:
    codedexposure receive --output received.mp4
  Its coded frames, through another port; they can be decoded later:
    codedexposure receive --port 5001 --coded received.mkv
  A window with the subframes of the machine that is called bench:
    codedexposure receive --host bench
)"});
}

} // namespace codedexposure::app
